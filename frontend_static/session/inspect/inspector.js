/**
 * Looking into the frame that is shown: at the estimate, at a place that is pointed at, or at a particle, which is followed from
 * frame to frame. What is found is the server's; the picture shows it in either view.
 */

import { api, messageOf } from "../../shared/api.js";
import { IconButton } from "../../shared/icons.js";
import { NewestRequest } from "../../shared/newest_request.js";
import { throttle } from "../../shared/timing.js";
import { effect, h, html, signal, useEffect, useRef } from "../../vendor/preact.js";
import { Findings } from "./findings.js";

/** @import { InspectionPublic, Inspect } from "../../shared/messages.js" */
/** @import { Mounted } from "../mount.js" */

/** @typedef {"estimate"|"place"|"particle"} Kind What can be looked at. */
/** @typedef {{place?: [number, number], picks?: boolean, particle?: number, frame?: number}} Subject As the server takes it. */
/** @typedef {[number, number]} Place In the picture, px; its origin is the centre of the first pixel. */

const ASK_MS = 80;
const KINDS = /** @type {const} */ ([
  ["estimate", "Estimate", "Look at what is believed"],
  ["place", "Place", "Point at the picture; a click holds the place"],
  ["particle", "Particle", "Click in the picture: the nearest particle is followed"],
]);
const PAD = "Arrows move the place by a pixel, with Shift by ten; Enter takes the nearest particle";
const FAR = 10;
/** @type {Record<string, Place>} */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

export class Inspector {
  isOpen = signal(false);
  kind = signal(/** @type {Kind} */ ("estimate"));
  /** Whether the likelihood lies over the picture. */
  hasVeil = signal(false);
  /** What was found, or why nothing was. */
  found = signal(/** @type {InspectionPublic|string|null} */ (null));
  #view;
  #request;
  #ask;
  /** @type {Subject} */
  #subject = {};
  #isHeld = false;

  /** @param {Mounted} view */
  constructor(view) {
    this.#view = view;
    const { scene, signal: end, store } = view;
    this.#request = new NewestRequest(
      async (/** @type {Inspect} */ wish) => /** @type {InspectionPublic} */ (await api.command(store.known.id, wish)),
      { answer: (found) => this.#take(found), refused: (error) => (this.found.value = messageOf(error)) },
      end,
    );
    this.#ask = throttle(() => this.isOpen.peek() && view.able && this.#request.ask(this.#wish()), ASK_MS, end);
    const follow = effect(() => {
      if (!this.isOpen.value || store.session === null) return;
      // What the numbers of a frame hang on.
      const { branch, parameters, position, tracker } = store.session;
      if ([branch, parameters, position, tracker].length > 0) this.#ask();
    });
    end.addEventListener("abort", follow);
    const at = (/** @type {(place: Place) => void} */ tell) => (/** @type {Event} */ event) => {
      const place = this.isOpen.peek() && event instanceof MouseEvent ? placeOf(event) : null;
      if (place !== null) tell(place);
    };
    scene?.root.addEventListener("pointermove", at((place) => this.#hover(place)), { signal: end });
    scene?.root.addEventListener("click", at((place) => this.#press(place)), { signal: end });
    globalThis.addEventListener("message", ({ origin, source, data }) => {
      if (!this.isOpen.peek() || origin !== location.origin || !scene?.window || source !== scene.window || data?.source !== "pftrack-viser") return;
      const place = placeIn(data.place);
      if (place === null) return;
      if (data.pointed === "hover") this.#hover(place);
      // A particle may be lifted above the place at which it is pointed at.
      else if (data.pointed === "press") this.#press(place, placeIn(data.particle) ?? undefined);
    }, { signal: end });
  }

  /** Begin to look, or stop: then nothing is computed or drawn for it any more. */
  toggle() {
    const isOpen = this.isOpen.peek();
    if (this.#view.store.session === null || (!isOpen && !this.#view.able)) return;
    this.isOpen.value = !isOpen;
    if (!isOpen) this.choose(this.kind.peek());
    else if (this.#view.able) this.#request.ask({ kind: "inspect" });
  }

  /** @param {boolean} shows */
  veil(shows) {
    this.hasVeil.value = shows;
    this.#ask();
  }

  /** @param {Kind} kind */
  choose(kind) {
    this.kind.value = kind;
    this.#isHeld = false;
    const at = this.#at;
    if (kind === "estimate") this.#subject = {};
    else if (kind === "particle") this.#subject = { place: at ?? [0, 0], picks: true };
    else if (at) this.#subject = { place: at };
    this.#ask();
  }

  /**
   * Point by keys, or take the nearest particle.
   *
   * @param {KeyboardEvent} event
   */
  steer(event) {
    const arrow = ARROWS[event.key];
    if (arrow === undefined && event.key !== "Enter") return;
    // They are no steps of the run.
    event.preventDefault();
    if (!this.#at) return;
    if (arrow === undefined) {
      this.#pick(this.#at);
      return;
    }
    const [x, y] = this.#subject.place ?? this.#at;
    const step = event.shiftKey ? FAR : 1;
    if (this.kind.peek() !== "place") this.choose("place");
    this.#isHeld = true;
    this.#point([x + step * arrow[0], y + step * arrow[1]]);
  }

  /** Where it was looked at last. */
  get #at() {
    const found = this.found.peek();
    return typeof found === "object" ? found?.place ?? null : null;
  }

  /** @returns {Inspect} */
  #wish() {
    return { kind: "inspect", likelihood: this.hasVeil.peek(), genealogy: true, pulls: true, ...this.#subject };
  }

  /** @param {Place} at */
  #hover(at) {
    if (this.kind.peek() === "place" && !this.#isHeld) this.#point(at);
  }

  /**
   * @param {Place} at
   * @param {Place} particle Where a particle is that was hit.
   */
  #press(at, particle = at) {
    if (this.kind.peek() === "particle") {
      this.#pick(particle);
      return;
    }
    const isHeld = this.kind.peek() === "place" && this.#isHeld;
    if (this.kind.peek() === "estimate") this.choose("place");
    this.#isHeld = !isHeld;
    this.#point(at);
  }

  /** @param {Place} at */
  #pick(at) {
    if (this.kind.peek() !== "particle") this.choose("particle");
    this.#subject = { place: at, picks: true };
    this.#ask();
  }

  /** @param {Place} at */
  #point(at) {
    this.#subject = { place: at };
    this.#ask();
  }

  /** @param {InspectionPublic} found */
  #take(found) {
    if (!this.isOpen.peek()) return;
    this.found.value = found;
    // From now on it is this one, wherever it goes.
    const isPicked = this.#subject.picks === true || this.#subject.particle !== undefined;
    if (isPicked && found.particle !== null) this.#subject = { particle: found.particle.particle, frame: found.frame };
  }
}

/** @param {{inspector: Inspector}} props */
export function Inspection({ inspector }) {
  const { found: told, hasVeil, isOpen, kind: chosen } = inspector;
  const root = useRef(/** @type {HTMLElement|null} */ (null));
  useEffect(() => root.current?.scrollIntoView({ block: "start" }), [isOpen.value]);
  if (!isOpen.value) return null;
  const found = told.value;
  const isBlind = typeof found === "object" && found?.has_map === false;
  const close = (/** @type {KeyboardEvent} */ event) => event.key === "Escape" && inspector.toggle();
  const veil = (/** @type {{currentTarget: HTMLInputElement}} */ { currentTarget: { checked } }) => inspector.veil(checked);
  const choice = KINDS.map(([kind, text, title]) => {
    const isOff = kind === "place" && isBlind;
    const isChosen = String(kind === chosen.value);
    const choose = () => inspector.choose(kind);
    return html`<button type="button" data-look=${kind} title=${title} aria-pressed=${isChosen} disabled=${isOff} onClick=${choose}>${text}</button>`;
  });
  return html`<div ref=${root} onKeyDown=${close}>
    <header>
      <h2>Look into the frame</h2>
      ${h(IconButton, { name: "close", title: "Stop looking (I)", run: () => inspector.toggle() })}
    </header>
    <label class="inspection-veil">
      <input type="checkbox" checked=${hasVeil.value} disabled=${isBlind} onChange=${veil} />
      <span>Likelihood over the picture</span>
    </label>
    <div class="choice" role="group" aria-label="What to look at">${choice}</div>
    <button type="button" title=${PAD} data-role="pad" onKeyDown=${(/** @type {KeyboardEvent} */ event) => inspector.steer(event)}>Move by keys</button>
    <p class="hint">${chosen.value !== "estimate" && KINDS.find(([kind]) => kind === chosen.value)?.[2]}</p>
    ${typeof found === "string" ? html`<div class="inspection-card" role="status"><p class="note">${found}</p></div>` : found && h(Findings, { found })}
  </div>`;
}

/**
 * Where a pointer is in the flat picture.
 *
 * @param {MouseEvent} event
 * @returns {Place|null}
 */
function placeOf({ target, offsetX, offsetY }) {
  if (!(target instanceof HTMLElement) || !target.classList.contains("flat-canvas")) return null;
  const scale = target.offsetWidth / Number(target.dataset.width);
  return Number.isFinite(scale) && scale > 0 ? [offsetX / scale - 0.5, offsetY / scale - 0.5] : null;
}

/**
 * @param {unknown} said
 * @returns {Place|null}
 */
function placeIn(said) {
  if (!Array.isArray(said)) return null;
  const [x, y] = said.map(Number);
  return Number.isFinite(x) && Number.isFinite(y) ? [x, y] : null;
}
