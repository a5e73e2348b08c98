/**
 * Why the target was lost, in the place of the plots: a sentence, since when, and what it is said from. It is asked for by
 * a button beside the words of the frame, or by a key; nothing of it is computed before.
 */

import { api, messageOf } from "../../shared/api.js";
import { fill, h } from "../../shared/dom.js";
import { iconButton } from "../../shared/icons.js";
import { later } from "../../shared/timing.js";
import { isGone } from "../history.js";
import { evidence } from "./evidence.js";

/** @import { Diagnosis, Sign } from "../../shared/messages.js" */
/** @import { Mounted } from "../mount.js" */

const SKELETON_AFTER_MS = 200;

export class Why {
  #root;
  #view;
  #words = h("div", { class: "why-words", role: "status" });
  /** What is shown ends with the next question. */
  #shown = new AbortController();

  /**
   * @param {HTMLElement} root
   * @param {Mounted} view
   */
  constructor(root, view) {
    this.#root = root;
    this.#view = view;
    const ask = () => this.ask(view.store.known.position);
    const here = h("button", { type: "button", class: "quiet", title: "Ask about the frame that is shown", on: { click: ask } }, "This frame");
    fill(root, h("header", {}, h("h2", {}, "Why?"), here, iconButton("close", "Back to the plots", () => this.close())), this.#words);
    view.store.on(["branch"], () => this.close());
    view.signal.addEventListener("abort", () => this.#shown.abort());
  }

  /** Ask about the loss in which the frame is that is shown, else about the first one. */
  open() {
    const { able, store } = this.#view;
    if (!able) return; // a key may be pressed before there is a session
    const { position } = store.known;
    this.ask(isGone(store.history.at(position)) ? position : undefined);
  }

  close() {
    this.#shown.abort();
    this.#root.hidden = true;
    fill(this.#words);
  }

  /** @param {number} [frame] The first lasting loss if not given. */
  async ask(frame) {
    if (!this.#view.able) return;
    this.#shown.abort();
    const { signal } = (this.#shown = new AbortController());
    this.#root.hidden = false;
    const there = later(() => fill(this.#words, h("div", { class: "bone shimmer" })), SKELETON_AFTER_MS, signal);
    try {
      const { diagnosis } = await api.explanation(this.#view.store.known.id, frame);
      there();
      if (!signal.aborted) this.#show(diagnosis, signal);
    } catch (error) {
      there();
      if (!signal.aborted) fill(this.#words, h("p", { class: "error" }, messageOf(error)));
    }
  }

  /**
   * @param {Diagnosis} diagnosis
   * @param {AbortSignal} signal
   */
  #show({ sentence, signs }, signal) {
    fill(this.#words, h("p", { class: "why-sentence" }, sentence), signs.map((sign) => this.#sign(sign, signal)));
    this.#root.scrollIntoView({ block: "nearest" });
  }

  /**
   * @param {Sign} sign
   * @param {AbortSignal} signal
   */
  #sign({ title, since, words, evidence: columns }, signal) {
    const go = () => this.#view.steering.seek(since);
    return h(
      "section",
      { class: "sign" },
      h(
        "h3",
        {},
        h("span", {}, title),
        h("button", { type: "button", class: "quiet", title: "Go to where it began", on: { click: go } }, `Frame ${since}`),
      ),
      h("p", {}, words),
      h("div", { class: "evidences", on: { click: go } }, columns.map((column) => evidence(column, since, signal))),
    );
  }
}

/**
 * The button that asks. A clip without a loss may have one that nobody tells: there it says what to do.
 *
 * @param {Mounted} view
 * @param {() => void} ask
 */
export function whyButton({ store }, ask) {
  const button = h("button", { type: "button", class: "why-ask", title: "Why was it lost? (W)", hidden: true, on: { click: ask } }, "Why?");
  const isAsked = () => store.knowsLoss || (Boolean(store.session?.recipe.footage) && store.history.length > 1);
  store.on(["history", "branch"], () => (button.hidden = store.isReadOnly || !isAsked()));
  return button;
}
