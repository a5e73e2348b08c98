/**
 * The beginning of a session on a page: it finds or starts the session and has its picture shown, before the rest of what
 * belongs to it has been loaded. Hence few imports.
 */

import { api } from "../shared/api.js";
import { whenCompiled, whenPlaceFree } from "../shared/compiling.js";
import { h } from "../shared/dom.js";
import { PARTS, arrange } from "./layout.js";
import { Scene } from "./scene.js";

/** @import { SessionPublic } from "../shared/messages.js" */
/** @import { NewSession } from "../shared/share_link.js" */

/** @typedef {{session: SessionPublic, recipe: NewSession|null}} Begun A session, and what it was started with if it was started here. */

/**
 * @typedef {object} Beginning
 * @property {string} [session] Id of a session that there is.
 * @property {NewSession|Promise<NewSession>} [recipe] Otherwise what to start one with.
 * @property {string} [name] What a session that is started shall be called; the server's choice if not given.
 * @property {readonly import("./layout.js").Part[]} [parts] What of it to show; everything if not given.
 * @property {import("./view_choice.js").ViewKind} [view] How the run itself is seen; the page's choice if not given.
 * @property {boolean} [isBare] Whether the 3-D scene's own panel stays away.
 * @property {import("./flat/overlay.js").Overlay} [overlay] Says how the flat view is painted where several lie over each other.
 * @property {readonly string[]} [layers] Names of layers that the flat view shows from the beginning, beside those declared so.
 */

export class SessionStart {
  #end = new AbortController();

  /**
   * @param {HTMLElement} element What holds the session.
   * @param {Beginning} beginning
   */
  constructor(element, { session, recipe, name, parts = PARTS, view, layers, overlay, isBare }) {
    this.element = element;
    this.places = arrange(element, parts);
    this.isNew = recipe !== undefined;
    /** The scene, if it is among the parts. */
    this.scene = this.places.scene ? new Scene(this.places.scene, this.signal, { view, hasLegend: parts.includes("panel"), layers, overlay, isBare }) : null;
    this.begun = recipe === undefined ? this.#find(session ?? "") : this.#start(recipe, name);
    // A failure is reported by the code that awaits this promise.
    this.begun.catch(() => {});
  }

  /** Aborted when the session is taken from the page. */
  get signal() {
    return this.#end.signal;
  }

  /** Take the session from the page. What it is on the server stays. */
  end() {
    this.#end.abort();
    this.element.replaceChildren();
  }

  /**
   * @param {NewSession|Promise<NewSession>} given
   * @param {string} [name]
   * @returns {Promise<Begun>}
   */
  async #start(given, name) {
    const recipe = await given;
    const { play, ...body } = recipe;
    // A link of an earlier version has no recipe.
    const { experiment } = /** @type {{experiment: string}} */ (body.recipe ?? body);
    const start = () => api.start({ ...body, id: name });
    const begin = () => whenCompiled(experiment, start, (sentence, meter) => this.#wait(sentence, meter), this.signal, "usable");
    const session = await whenPlaceFree(begin, (sentence) => this.#wait(sentence, h("a", { href: "work?show=sessions" }, "Running sessions")), this.signal);
    if (!this.signal.aborted) this.scene?.open(session.id, Promise.resolve(session), !recipe.position);
    return { session, recipe };
  }

  /**
   * Show what the session has to wait for: the compiler, once after an installation, or a place; nothing when it need not.
   *
   * @param {string} sentence
   * @param {Element} [more] How far it is, or where something can be done about it.
   */
  #wait(sentence, more) {
    this.element.querySelector(".compiling")?.remove();
    if (!sentence) return;
    this.element.prepend(h("p", { class: "note compiling", role: "status" }, `${sentence}. The session begins by itself. `, more));
  }

  /**
   * @param {string} id
   * @returns {Promise<Begun>}
   */
  async #find(id) {
    const session = api.session(id);
    this.scene?.open(id, session, false);
    return { session: await session, recipe: null };
  }
}
