/**
 * Two sessions of a page in step, with one transport and one scrubber for both. They belong to the page: they begin with
 * it, and end when it is left.
 */

import { fill, h } from "../shared/dom.js";
import { Clock } from "../session/clock.js";
import { mount } from "../session/mount.js";
import { OwnSession } from "../session/own_session.js";

/** @import { FailurePublic } from "../shared/messages.js" */
/** @import { Column } from "./column.js" */
/** @import { Mounted } from "../session/mount.js" */

export class Pair {
  #sessions;
  #end;
  /** @type {Mounted[]} */
  #views = [];

  /**
   * @param {readonly Column[]} columns The first one leads.
   * @param {HTMLElement} deck Gets the transport and the scrubber.
   * @param {FailurePublic} failure
   * @param {AbortController} end Aborted when both have ended.
   */
  constructor(columns, deck, failure, end) {
    this.#end = end;
    const clock = new Clock();
    this.#sessions = columns.map(({ place, side }) => {
      const recipe = { recipe: failure[side], position: failure.frame };
      return new OwnSession(place, { recipe, parts: ["scene", "readout"], view: "flat" });
    });
    this.#views = this.#sessions.map(({ start }) => mount(start.element, { start, clock, keys: null }));
    /** Resolves when both runs stand at the frame before. */
    this.begun = this.#begin(deck, failure.frame);
  }

  /** End both sessions, on the server as well; also when the page is about to be left. */
  end() {
    if (this.#end.signal.aborted) return;
    this.#end.abort();
    for (const view of this.#views) view.dispose();
    for (const session of this.#sessions) session.end();
  }

  /**
   * @param {HTMLElement} deck
   * @param {number} frame
   */
  async #begin(deck, frame) {
    // Both are waited for, so that whoever tries again finds the places of both free.
    const begun = this.#sessions.map(({ start }) => start.begun);
    await Promise.allSettled(begun);
    const [{ session }] = await Promise.all(begun);
    if (this.#end.signal.aborted) return;
    const place = h("div", {});
    const lead = mount(place, { session: session.id, parts: ["transport", "scrubber"], keys: document.body });
    this.#views.push(lead);
    const before = h(
      "button",
      { type: "button", class: "before", on: { click: () => lead.steering.seek(frame) } },
      `Frame ${frame}, before it happens`,
    );
    fill(deck, before, place);
  }
}
