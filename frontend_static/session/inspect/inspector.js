/**
 * Looking into the frame that is shown: at the estimate, at a place that is pointed at, or at a particle, which is followed from
 * frame to frame. What is found is the server's; the picture shows it in either view.
 */

import { api, messageOf } from "../../shared/api.js";
import { fill, h, setText } from "../../shared/dom.js";
import { icon, iconButton } from "../../shared/icons.js";
import { NewestRequest } from "../../shared/newest_request.js";
import { throttle } from "../../shared/timing.js";
import { card, colourBar } from "./card.js";
import { Courses } from "./courses.js";
import { GenealogyFigure } from "./genealogy.js";
import { pointing } from "./pointing.js";

/** @import { InspectionPublic, Inspect } from "../../shared/messages.js" */
/** @import { Mounted } from "../mount.js" */

/** @typedef {"estimate"|"place"|"particle"} Kind What can be looked at. */
/** @typedef {{place?: [number, number], picks?: boolean, particle?: number, frame?: number}} Subject As the server takes it. */

const ASK_MS = 80;
/** What the numbers of a frame hang on. */
const MOVES = /** @type {const} */ (["branch", "parameters", "position", "tracker"]);
const KINDS = /** @type {const} */ ([
  ["estimate", "Estimate", "Look at what is believed"],
  ["place", "Place", "Point at the picture; a click holds the place"],
  ["particle", "Particle", "Click in the picture: the nearest particle is followed"],
]);
const PAD = "Arrows move the place by a pixel, with Shift by ten; Enter takes the nearest particle";

/** @param {() => void} look */
export function lookButton(look) {
  const title = "Look into the frame: likelihood, particles, ancestors (I)";
  return h("button", { type: "button", class: "icon-only", title, "aria-label": title, data: { tool: "inspect" }, on: { click: look } }, icon("inspect"));
}

export class Inspector {
  #root;
  #view;
  #request;
  /** @type {Subject} */
  #subject = {};
  /** @type {Kind} */
  #kind = "estimate";
  #isHeld = false;
  /** @type {InspectionPublic|null} */
  #found = null;
  #likelihood = h("input", { type: "checkbox", on: { change: () => this.#ask() } });
  #scale = h("div", { class: "inspection-scale" });
  #buttons = KINDS.map(([kind, text, title]) =>
    h("button", { type: "button", title, "aria-pressed": "false", data: { look: kind }, on: { click: () => this.#choose(kind) } }, text),
  );
  #pad = h("button", { type: "button", title: PAD, data: { role: "pad" } }, "Move by keys");
  #hint = h("p", { class: "hint" });
  #card = h("div", { class: "inspection-card", role: "status", "aria-live": "off" });
  #genealogy;
  #courses;
  #ask;

  /**
   * @param {HTMLElement} root Where it stands; hidden until somebody looks.
   * @param {Mounted} view
   */
  constructor(root, view) {
    this.#root = root;
    this.#view = view;
    const { signal, store } = view;
    const place = h("section", { class: "inspection-genealogy", hidden: true });
    this.#genealogy = new GenealogyFigure(place, signal);
    const course = h("section", { class: "inspection-course", hidden: true });
    this.#courses = new Courses(course, signal);
    this.#request = new NewestRequest(
      async (/** @type {Inspect} */ wish) => /** @type {InspectionPublic} */ (await api.command(store.known.id, wish)),
      { answer: (found) => this.#show(found), refused: (error) => this.#refuse(error) },
      signal,
    );
    this.#ask = throttle(() => this.isOpen && view.able && this.#request.ask(this.#wish()), ASK_MS, signal);
    const close = iconButton("close", "Stop looking (I)", () => this.toggle());
    const veil = h("label", { class: "inspection-veil" }, this.#likelihood, h("span", {}, "Likelihood over the picture"));
    const choice = h("div", { class: "inspection-choice", role: "group", "aria-label": "What to look at" }, this.#buttons);
    fill(root, h("header", {}, h("h2", {}, "Look into the frame"), close), veil, this.#scale, choice, this.#pad, this.#hint, this.#card, course, place);
    store.on(MOVES, this.#ask);
    pointing(view.scene, this.#pad, {
      hover: (at) => this.isOpen && this.#kind === "place" && !this.#isHeld && this.#point(at),
      press: (at, particle) => this.isOpen && this.#press(at, particle),
      move: (across, down) => this.#move(across, down),
      take: () => this.#found?.place && this.#pick(this.#found.place),
    }, signal);
    root.addEventListener("keydown", (event) => event.key === "Escape" && this.toggle());
  }

  get isOpen() {
    return !this.#root.hidden;
  }

  /** Begin to look, or stop: then nothing is computed or drawn for it any more. */
  toggle() {
    const { store } = this.#view;
    if (store.session === null || (!this.isOpen && !this.#view.able)) return;
    this.#root.hidden = this.isOpen;
    this.#root.parentElement?.toggleAttribute("data-inspecting", this.isOpen);
    if (this.isOpen) {
      this.#choose(this.#kind);
      this.#root.scrollIntoView({ block: "start" });
    } else if (this.#view.able) this.#request.ask({ kind: "inspect" });
  }

  /** @returns {Inspect} */
  #wish() {
    return { kind: "inspect", likelihood: this.#likelihood.checked, genealogy: true, pulls: true, ...this.#subject };
  }

  /** @param {Kind} kind */
  #choose(kind) {
    this.#kind = kind;
    this.#isHeld = false;
    const at = this.#found?.place;
    if (kind === "estimate") this.#subject = {};
    else if (kind === "particle") this.#subject = { place: at ?? [0, 0], picks: true };
    else if (kind === "place" && at) this.#subject = { place: at };
    for (const button of this.#buttons) button.setAttribute("aria-pressed", String(button.dataset.look === kind));
    setText(this.#hint, kind === "estimate" ? "" : KINDS[kind === "place" ? 1 : 2][2]);
    this.#ask();
  }

  /** @param {[number, number]} at */
  #point(at) {
    this.#subject = { place: at };
    this.#ask();
  }

  /**
   * @param {[number, number]} at
   * @param {[number, number]} particle Where a particle is that was hit.
   */
  #press(at, particle = at) {
    if (this.#kind === "particle") {
      this.#pick(particle);
      return;
    }
    const held = this.#kind === "place" && this.#isHeld;
    if (this.#kind === "estimate") this.#choose("place");
    this.#isHeld = !held;
    this.#point(at);
  }

  /** @param {[number, number]} at */
  #pick(at) {
    if (this.#kind !== "particle") this.#choose("particle");
    this.#subject = { place: at, picks: true };
    this.#ask();
  }

  /**
   * @param {number} across px
   * @param {number} down px
   */
  #move(across, down) {
    if (!this.#found?.place) return;
    const [x, y] = this.#subject.place ?? this.#found.place;
    if (this.#kind !== "place") this.#choose("place");
    this.#isHeld = true;
    this.#point([x + across, y + down]);
  }

  /** @param {InspectionPublic} found */
  #show(found) {
    if (!this.isOpen) return;
    this.#found = found;
    // From now on it is this one, wherever it goes.
    const isPicked = this.#subject.picks === true || this.#subject.particle !== undefined;
    if (isPicked && found.particle !== null) this.#subject = { particle: found.particle.particle, frame: found.frame };
    this.#likelihood.disabled = !found.has_map;
    fill(this.#scale, found.scale && colourBar(found.scale));
    fill(this.#card, card(found));
    this.#genealogy.show(found);
    this.#courses.show(found);
    for (const button of this.#buttons) button.disabled = button.dataset.look === "place" && !found.has_map;
  }

  /** @param {unknown} error */
  #refuse(error) {
    fill(this.#card, h("p", { class: "note" }, messageOf(error)));
  }
}
