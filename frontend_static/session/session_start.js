/** The beginning of a session on a page: it finds or starts the session and shows its picture before the rest of its code has been loaded.
 Hence few imports. */

import { forget, request } from "../shared/api.js";
import { whenCompiled, whenPlaceFree } from "../shared/compiling.js";
import { build, fill } from "../shared/dom.js";
import { Scene } from "./scene.js";

/** @import { Properties } from "../shared/elements.js" */
/** @import { SessionPublic } from "../shared/messages.js" */
/** @import { NewSession } from "../shared/share_link.js" */

// The places of a session's parts within an element, still empty.

/** @typedef {"scene"|"panel"|"branches"|"inspection"|"why"|"plots"|"readout"|"transport"|"scrubber"} Part */
/** @typedef {Partial<Record<Part|"status", HTMLElement>>} Places Beside a panel the line on how it goes stands above the plots. */

/** @type {readonly Part[]} */
export const PARTS = ["scene", "panel", "branches", "inspection", "why", "plots", "readout", "transport", "scrubber"];

/** Make a place for each requested part; other parts take no room.
 *
 * @param {HTMLElement} element The element, which is emptied.
 * @param {readonly Part[]} parts
 * @returns {Places}
 */
export function arrange(element, parts) {
  /** @type {Places} */
  const places = {};
  /** @param {Part} name @param {"section"|"nav"|"div"} tag @param {Properties} properties */
  const place = (name, tag, properties) => {
    if (!parts.includes(name)) return null;
    return (places[name] = build(tag, { ...properties, data: { part: name } }));
  };
  // A page may show several sessions, each in its own section; an element not yet on the page names its section itself.
  const around = element.dataset.within ?? element.closest("section[aria-label]")?.getAttribute("aria-label");
  const named = (/** @type {string} */ label) => (around ? `${around}: ${label.toLowerCase()}` : label);
  const scene = place("scene", "section", { class: "scene", "aria-label": named("Scene") });
  const panel = place("panel", "section", { class: "controls", "aria-label": named("Parameters") });
  if (panel && parts.includes("readout")) places.status = build("section", { class: "status", "aria-label": named("This frame") });
  const side = [
    panel,
    places.status ?? null,
    place("branches", "nav", { class: "branches", "aria-label": named("Branches"), hidden: true }),
    place("inspection", "section", { class: "inspection", "aria-label": named("Inspect the frame") }),
    place("why", "section", { class: "why", "aria-label": named("Why the target was lost") }),
    place("plots", "div", { class: "plots" }),
    place("readout", "section", { class: "readout" }),
  ].filter((it) => it !== null);
  const deck = [place("transport", "div", { class: "transport" }), place("scrubber", "div", {})].filter((it) => it !== null);
  const aside = side.length > 0 && build("aside", { class: "side", "aria-label": named("Plots") }, side);
  fill(
    element,
    build("div", { class: "session-view", role: "group", "aria-label": named("Session"), tabindex: -1 }, [
      (scene || aside) && build("div", { class: scene && aside ? "stage" : "stage alone" }, scene, aside),
      deck.length > 0 && build("footer", { class: "deck", "aria-label": named("Transport") }, deck),
    ]),
  );
  return places;
}

/** @typedef {{session: SessionPublic, recipe: NewSession|null}} Begun A session, and what it was started with if it was started here. */

/**
 * @typedef {object} Beginning
 * @property {string} [session] Id of an existing session.
 * @property {NewSession|Promise<NewSession>} [recipe] Otherwise the recipe of a new session.
 * @property {boolean} [isOwn] Whether the started session ends with the element.
 * @property {readonly Part[]} [parts] Parts to show; all by default.
 * @property {import("./scene.js").ViewKind} [view] The view; by default the page's choice.
 * @property {boolean} [isBare] Whether the 3-D scene's own panel is hidden.
 * @property {import("./flat/drawing.js").Overlay} [overlay] How the flat view is painted among several that lie over each other.
 * @property {readonly string[]} [layers] Names of layers that the flat view shows at first, in addition to the default ones.
 */

/** A session in an element. The element's own session ends with it, also on the server and when the page is left. If the answer to its
 start is still under way then, it is ended by its name, which is chosen here; if it has yet to begin, the server ends it, since nobody
 waits for it. */
export class SessionStart {
  #end = new AbortController();
  #hasBegun = false;

  /**
   * @param {HTMLElement} element Element of the session.
   * @param {Beginning} beginning
   */
  constructor(element, { session, recipe, isOwn = false, parts = PARTS, view, layers, overlay, isBare }) {
    this.element = element;
    this.places = arrange(element, parts);
    this.isNew = recipe !== undefined;
    /** The scene, if it is among the parts. */
    this.scene = this.places.scene ? new Scene(this.places.scene, this.signal, { view, hasLegend: parts.includes("panel"), layers, overlay, isBare }) : null;
    const name = isOwn ? newName() : undefined;
    this.begun = recipe === undefined ? this.#find(session ?? "") : this.#start(recipe, name);
    // A failure is reported by the code that awaits this promise.
    this.begun.then(() => (this.#hasBegun = true), () => {});
    if (name === undefined) return;
    this.signal.addEventListener("abort", () => this.begun.then(() => forget("DELETE sessions/{session}", { session: name }), () => {}));
    // Also when the page goes to the browser's cache: from there it starts again.
    globalThis.addEventListener("pagehide", () => {
      this.end();
      if (!this.#hasBegun) forget("DELETE sessions/{session}", { session: name });
    }, { signal: this.signal });
  }

  /** Aborted when the session is removed from the page. */
  get signal() {
    return this.#end.signal;
  }

  /** Remove the session from the page. On the server it stays, unless it is the element's own. */
  end() {
    this.#end.abort();
    this.element.replaceChildren();
  }

  /**
   * @param {NewSession|Promise<NewSession>} given
   * @param {string} [name] Its name; by default the server chooses one.
   * @returns {Promise<Begun>}
   */
  async #start(given, name) {
    const recipe = await given;
    const { play, ...body } = recipe;
    // A link of an earlier version has no recipe.
    const { experiment } = /** @type {{experiment: string}} */ (body.recipe ?? body);
    const start = () => request("POST sessions", { body: { ...body, id: name } });
    const begin = () => whenCompiled(experiment, start, (sentence, meter) => this.#wait(sentence, meter), this.signal, "usable");
    const session = await whenPlaceFree(begin, (sentence) => this.#wait(sentence, build("a", { href: "work?show=sessions" }, "Running sessions")), this.signal);
    if (!this.signal.aborted) this.scene?.open(session.id, Promise.resolve(session), !recipe.position);
    return { session, recipe };
  }

  /** Show what the session waits for: the compiler, once after an installation, or a place; nothing if it need not wait.
   *
   * @param {string} sentence
   * @param {Element} [more] The progress, or a link to a remedy.
   */
  #wait(sentence, more) {
    this.element.querySelector(".compiling")?.remove();
    if (!sentence) return;
    this.element.prepend(build("p", { class: "note compiling", role: "status" }, `${sentence}. The session begins by itself. `, more));
  }

  /**
   * @param {string} id
   * @returns {Promise<Begun>}
   */
  async #find(id) {
    const session = request("GET sessions/{session}", { session: id });
    this.scene?.open(id, session, false);
    return { session: await session, recipe: null };
  }
}

/** @returns {string} A new, unique name of a session. */
function newName() {
  const bytes = globalThis.crypto.getRandomValues(new Uint8Array(8));
  return [...bytes].map((byte) => byte.toString(16).padStart(2, "0")).join("");
}
