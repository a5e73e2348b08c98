/**
 * A session as a component: any part of it in any element of a page, several on one page, and none of it left when it is
 * taken away again.
 */

import { START } from "../shared/address.js";
import { api, messageOf, statusOf } from "../shared/api.js";
import { fill, h as made } from "../shared/dom.js";
import { follow, until } from "../shared/effects.js";
import { remember, remembered } from "../shared/memory.js";
import { isParticipant } from "../shared/participant.js";
import { notice } from "../shared/notice.js";
import { toast } from "../shared/toast.js";
import { h, html, options as drawing, render } from "../vendor/preact.js";
import { Inspection, Inspector } from "./inspect/inspector.js";
import { listen, moves } from "./keys.js";
import { Panel } from "./panel/panel.js";
import { plots } from "./plots/plots.js";
import { Branches, Folded, Numbers, Status } from "./readout.js";
import { SceneNotes } from "./scene_notes.js";
import { Scrubber } from "./scrubber/scrubber.js";
import { SessionStart } from "./session_start.js";
import { SessionStream } from "./session_stream.js";
import { Commands, Steering } from "./steering.js";
import { Store } from "./store.js";
import { Bookmarks, transport } from "./transport.js";
import { Loss } from "./why/loss.js";
import { LostCard } from "./why/lost_card.js";
import { Beside, WhyButton } from "./why/why.js";

// Components are drawn with the next frame of the display, together with the picture that their numbers belong to.
drawing.debounceRendering = (draw) => requestAnimationFrame(draw);

/** The experiments that were seen in this browser: the first time they play slowly. */
const SEEN = "pftrack-seen";
const WAY = isParticipant ? { label: "Back to the class", href: START } : { label: "Back to the experiments", href: START };
const KEPT = isParticipant ? "" : "Runs that you saved are in My work.";

/**
 * Whether an experiment is seen for the first time in this browser; it is remembered from then on.
 *
 * @param {string} experiment
 */
function isFirstVisit(experiment) {
  const seen = (remembered(SEEN) ?? "").split(" ");
  if (seen.includes(experiment)) return false;
  remember(SEEN, [...seen, experiment].join(" ").trim());
  return true;
}

/** @import { NewSession } from "../shared/share_link.js" */
/** @import { Child } from "../vendor/preact.js" */

/**
 * @typedef {object} Options
 * @property {SessionStart} [start] A beginning that was made before, instead of `session` or `recipe` and `parts`.
 * @property {string} [session]
 * @property {NewSession|Promise<NewSession>} [recipe]
 * @property {readonly import("./layout.js").Part[]} [parts]
 * @property {import("./view_choice.js").ViewKind} [view] How the run itself is seen; the page's choice if not given.
 * @property {import("./clock.js").Clock} [clock] Keeps those that share it at the same frame.
 * @property {number} [first] With a clock, the frame that belongs to frame 0 of the session that leads.
 * @property {readonly string[]} [plots] Ids of the plots to show; all of them if none is named.
 * @property {Partial<import("./keys.js").Actions>} [actions] What keys do beyond what the session does by itself.
 * @property {HTMLElement|null} [keys] Where the keys are the session's own: its element if not given, nowhere if null.
 * @property {boolean} [readOnly] Whether it can be looked at and not be steered: cameras have their keys, it has none.
 */

/**
 * What the parts need that show a run's course and move through it. Several runs in step have one for all of them.
 *
 * @typedef {Pick<Mounted, "store"|"steering"|"able"|"signal"|"scene"|"plots">} View
 */

/**
 * Put a session into an element.
 *
 * @param {HTMLElement} element
 * @param {Options} options
 * @returns {Mounted}
 */
export function mount(element, options) {
  return new Mounted(options.start ?? new SessionStart(element, options), options);
}

/** What the parts of a session need to know of it. */
export class Mounted {
  #start;
  #clock;
  #steering;
  #keys;
  /** @type {Inspector|null} */
  #inspector = null;
  /** @type {Loss|null} */
  #loss = null;

  /**
   * @param {SessionStart} start
   * @param {Options} options
   */
  constructor(start, { clock, first = 0, plots: ids = [], actions = {}, readOnly = false, keys = readOnly ? null : start.element }) {
    this.#start = start;
    this.#keys = keys;
    this.#clock = clock;
    this.signal = start.signal;
    this.scene = start.scene;
    /** Ids of the plots to show; all of them if none is named. */
    this.plots = ids;
    this.store = new Store({ readOnly });
    this.commands = new Commands(this.store);
    this.#steering = new Steering(this.store, this.signal);
    clock?.join({ store: this.store, steering: this.#steering, first }, this.signal);
    this.actions = { ...this.#ownActions(), ...actions };
    this.#fill();
    this.#begin();
  }

  /** What moves the run: that of the session which leads, where several share a clock. */
  get steering() {
    return this.#clock?.leader?.steering ?? this.#steering;
  }

  /** Whether what steers can be used. */
  get able() {
    return this.store.connection === "open" && this.store.isSteerable;
  }

  /** Take the session from the page; nothing of it goes on here. The session itself stays. */
  dispose() {
    this.#start.end();
  }

  /** Look into the frame, or no more; one card at a time takes the place of the plots. */
  #look() {
    if (this.#loss) this.#loss.tab.value = null;
    this.#inspector?.toggle();
  }

  /** Ask why the target was lost. */
  #ask() {
    if (this.#inspector?.isOpen.peek()) this.#inspector.toggle();
    this.#loss?.open();
  }

  #fill() {
    const { places } = this.#start;
    if (places.transport) transport(places.transport, this, h(Bookmarks, { view: this }));
    if (places.scrubber) new Scrubber(places.scrubber, this);
    if (places.panel) this.#show(places.panel, h(Panel, { view: this }));
    if (!this.store.isReadOnly) this.#questions(places);
    this.#fillReadout(places);
    if (places.branches) this.#show(places.branches, h(Branches, { view: this, place: places.branches }));
    if (places.plots) plots(places.plots, this);
    if (this.scene) {
      this.scene.follow(this);
      this.scene.lay(this.#placeOf(h(SceneNotes, { view: this })));
    }
    if (this.#keys) listen(this.#keys, this.actions, this.signal);
    const { refused } = this.store;
    follow(() => refused.value, () => refused.value && toast(refused.value.message, { kind: "error" }), this.signal);
  }

  /**
   * What can be asked about the run: why it was lost, what would have saved it, what is in a frame.
   *
   * @param {import("./layout.js").Places} places
   */
  #questions({ inspection, why }) {
    if (why) {
      const loss = (this.#loss = new Loss(this));
      this.#show(why, h(Beside, { loss }));
      this.scene?.lay(this.#placeOf(h(LostCard, { loss })));
    }
    if (inspection) {
      const inspector = (this.#inspector = new Inspector(this));
      this.#show(inspection, h(Inspection, { inspector }));
    }
  }

  /**
   * A component in a place of its own, beside parts that are not components.
   *
   * @param {Child} content
   */
  #placeOf(content) {
    const place = made("div", { class: "made" });
    this.#show(place, content);
    return place;
  }

  /** @param {import("./layout.js").Places} places */
  #fillReadout({ status, readout, plots: beside }) {
    const ask = this.#loss && h(WhyButton, { loss: this.#loss });
    if (status) this.#show(status, h(Status, { view: this, ask }));
    if (status && readout) this.#show(readout, h(Folded, { view: this, plots: beside ?? null }));
    else if (readout) this.#show(readout, html`${h(Status, { view: this, ask })}${h(Numbers, { view: this })}`);
  }

  /**
   * Have a component in a place as long as the session is on the page.
   *
   * @param {HTMLElement} place
   * @param {Child} content
   */
  #show(place, content) {
    render(content, place);
    this.signal.addEventListener("abort", () => render(null, place));
  }

  async #begin() {
    let begun;
    try {
      begun = await this.#start.begun;
    } catch (error) {
      if (!this.signal.aborted) this.#refuse(error);
      return;
    }
    if (this.signal.aborted) return;
    const { session, recipe } = begun;
    const on = {
      lost: () => (this.store.connection = "lost"),
      gone: (/** @type {Error} */ { message }) => {
        this.store.connection = "gone";
        this.#fail("This session has ended", isParticipant ? message : KEPT);
      },
    };
    new SessionStream(session.id, this.store, this.scene, on, this.signal);
    if (!recipe?.play) return;
    await this.scene?.seen;
    await until(() => this.able, this.signal);
    if (isFirstVisit(session.recipe.experiment)) await this.steering.slowDown();
    await this.steering.toggle();
  }

  /** @param {unknown} error */
  #refuse(error) {
    if (statusOf(error) === 404 && !this.#start.isNew) this.#fail("There is no such session", `It may have ended. ${KEPT}`.trim());
    else this.#fail(this.#start.isNew ? "This session could not be started" : "This session cannot be shown", messageOf(error));
  }

  /**
   * @param {string} title
   * @param {string} message
   */
  #fail(title, message) {
    const way = this.store.isReadOnly ? null : WAY;
    if (this.scene) this.scene.fail(title, message, way);
    else fill(this.#start.element, notice(title, message, way));
  }

  /** @returns {Partial<import("./keys.js").Actions>} */
  #ownActions() {
    return {
      ...moves(this),
      bookmark: () => this.commands.bookmark(),
      branch: () => this.#branch(),
      inspect: () => this.#look(),
      why: () => this.#ask(),
      truth: async () => {
        if (!isParticipant) (await import("./truth/marking.js")).markTruth(this);
      },
    };
  }

  async #branch() {
    if (!this.able) return;
    const experiment = await api.experiment(this.store.known.recipe.experiment).catch(() => null);
    const { branchDialog } = await import("./branch_dialog.js");
    if (!this.signal.aborted) branchDialog(this, experiment?.default_tracker);
  }
}
