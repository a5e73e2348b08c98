/**
 * An editor of any mark that consists of handles and numbers: a handle is dragged by mouse or touch, or moved by keyboard
 * (Tab goes through the handles, arrows move one by 1 px, shift+arrows by 10); a number has a slider, and a radius has a circle whose edge
 can be dragged. Handles are in pixels of the picture and never leave it. */

import { h, html, signal } from "../../vendor/preact.js";
import { elementOf, step } from "../dom.js";
import { parameterValue } from "../format.js";
import { linesOf, markOf, valueAt } from "./mark_json.js";
import { Loupe, Picture, Stage, within } from "./picture.js";

/** @import { MarkNumber } from "../messages.js" */
/** @import { Description, Mark } from "./mark_json.js" */
/** @import { Place } from "./picture.js" */

const REACH_PX = 28;
const EDGE_PX = 10;
/** Room for the longest name. */
const NAME_PX = 180;

export class HandlesEditor {
  /** @type {Description} */
  #description;
  #changed;
  /** Whether there is a mark, set or begun by a person. */
  #isMade = signal(false);
  #places = signal(/** @type {ReadonlyMap<string, Place>} */ (new Map()));
  #numbers = signal(/** @type {ReadonlyMap<string, number>} */ (new Map()));
  /** Handles placed by a model. */
  #placed = signal(/** @type {readonly string[]} */ ([]));
  /** Handles still at their proposed places; their names are shown. */
  #offered = signal(/** @type {readonly string[]} */ ([]));
  /** The handle under the pointer, the one whose place is read out, and the magnified one. */
  #near = signal(/** @type {string|null} */ (null));
  #told = signal(/** @type {string|null} */ (null));
  #magnified = signal(/** @type {string|null} */ (null));
  /** @type {{handle: string, grip: Place}|{radius: MarkNumber}|null} */
  #drag = null;

  picture = new Picture();
  /** @type {HTMLElement} */
  element;

  /**
   * @param {Description} description
   * @param {string} target Name of the target.
   * @param {() => void} changed Called when a person has changed the mark.
   */
  constructor(description, target, changed) {
    this.#description = description;
    this.#changed = changed;
    this.set(null);
    this.element = elementOf(h(() => this.#view(target), {}));
  }

  get mark() {
    return this.#isMade.value ? markOf(this.#description.kind, [...this.#places.value, ...this.#numbers.value]) : null;
  }

  /** Number of handles still at their proposed places. */
  get left() {
    return this.#offered.value.length;
  }

  /**
   * @param {Mark|null} mark
   * @param {readonly string[]} [placed]
   */
  set(mark, placed = []) {
    const { handles, numbers } = this.#description;
    this.#isMade.value = mark !== null;
    this.#places.value = new Map(handles.flatMap(({ name }) => {
      const place = valueAt(mark, name);
      return isPlace(place) ? [[name, place]] : [];
    }));
    this.#numbers.value = new Map(numbers.map((number) => [number.name, allowed(number, Number(valueAt(mark, number.name) ?? number.default))]));
    this.#placed.value = placed;
    this.#offered.value = [];
  }

  /** Show the handles at their first places, ready to be dragged. */
  offer() {
    const [width, height] = this.picture.size.value;
    this.set(null);
    this.#places.value = new Map(this.#description.handles.map(({ name, at }) => [name, [at[0] * (width - 1), at[1] * (height - 1)]]));
    this.#offered.value = [...this.#places.value.keys()];
  }

  focus() {
    this.#focusOn(this.#description.handles[0]?.name);
  }

  /** @param {string|undefined} name */
  #focusOn(name) {
    const handles = [...(this.picture.current?.querySelectorAll("button") ?? [])];
    handles.find(({ dataset }) => dataset.handle === name)?.focus({ preventScroll: true });
  }

  /** @param {string} target */
  #view(target) {
    const { kind, title, handles, numbers } = this.#description;
    const [told, magnified] = [this.#told.value, this.#places.value.get(this.#magnified.value ?? "")];
    const place = this.#places.value.get(told ?? "");
    const surface = {
      class: this.#near.value === null ? "" : "grip",
      role: "group",
      "aria-label": `${title}, ${target}`,
      onPointerLeave: () => (this.#near.value = null),
    };
    const above = html`
      ${handles.map(({ name, title: words }) => this.#handle(name, words))}
      ${magnified && h(Loupe, { picture: this.picture, place: magnified })}
    `;
    const words = place && `${handles.find(({ name }) => name === told)?.title} at ${place.map((value) => value.toFixed(1)).join(", ")} px`;
    const controls = numbers.map((number) => this.#slider(number));
    return h(Stage, { kind, editor: this, surface, drawn: this.#drawn(), above, words, controls });
  }

  /**
   * @param {string} name
   * @param {string} title
   */
  #handle(name, title) {
    const place = this.#places.value.get(name);
    if (place === undefined) return null;
    const [width, height] = this.picture.size.value;
    const kinds = {
      placed: this.#placed.value.includes(name),
      offered: this.#offered.value.includes(name),
      near: this.#near.value === name,
      "at-right": (width - place[0]) / this.picture.scale.value < NAME_PX,
    };
    const blur = () => (this.#magnified.value = this.#told.value = null);
    const key = (/** @type {KeyboardEvent} */ event) => {
      const way = step(event);
      if (way !== null) this.#put(name, place[0] + way[0], place[1] + way[1]);
    };
    return html`<button
      key=${name} type="button" class=${`point ${Object.entries(kinds).filter(([, is]) => is).map(([kind]) => kind).join(" ")}`} data-handle=${name}
      style=${{ left: `${(100 * (place[0] + 0.5)) / width}%`, top: `${(100 * (place[1] + 0.5)) / height}%` }}
      aria-label=${`${title}, ${Math.round(place[0])} across, ${Math.round(place[1])} down`}
      onFocus=${() => (this.#told.value = name)} onBlur=${blur} onKeyDown=${key}
    ><span class="point-name">${title}</span></button>`;
  }

  /** @param {MarkNumber} number */
  #slider(number) {
    const { name, title, minimum, maximum, step: by } = number;
    const value = this.#numbers.value.get(name) ?? number.default;
    const move = (/** @type {Event & {currentTarget: HTMLInputElement}} */ { currentTarget }) => this.#count(number, currentTarget.valueAsNumber);
    return html`<label class="mark-number">
      <span>${title} <output>${parameterValue(value, number)}</output></span>
      <input type="range" min=${minimum} max=${maximum} step=${by} data-number=${name} value=${value} onInput=${move} />
    </label>`;
  }

  /** The circles and lines. */
  #drawn() {
    const places = this.#places.value;
    const circles = this.#description.numbers.flatMap(({ name, about }) => {
      const [cx, cy] = middle(places.get(about ?? ""));
      const r = this.#numbers.value.get(name);
      return cx === undefined ? [] : ["halo", "line"].map((part) => html`<circle class=${`mark-${part}`} cx=${cx} cy=${cy} r=${r} />`);
    });
    const lines = linesOf(this.#description).flatMap(([from, to]) => {
      const [[x1, y1], [x2, y2]] = [middle(places.get(from)), middle(places.get(to))];
      if (x1 === undefined || x2 === undefined) return [];
      return ["halo", "line"].map((part) => html`<line class=${`mark-${part}`} x1=${x1} y1=${y1} x2=${x2} y2=${y2} />`);
    });
    return [...circles, ...lines];
  }

  /**
   * The handle nearest to a place, if it is within reach.
   *
   * @param {Place} place
   */
  #nearest(place) {
    const away = (/** @type {Place} */ other) => distance(middle(other), place);
    const [nearest] = [...this.#places.value].sort(([, one], [, other]) => away(one) - away(other));
    return nearest && away(nearest[1]) < REACH_PX * this.picture.scale.value ? nearest[0] : null;
  }

  /**
   * The radius whose circle passes near a place.
   *
   * @param {Place} place
   */
  #edge(place) {
    return this.#description.numbers.find(({ name, about }) => {
      const centre = this.#places.value.get(about ?? "");
      return centre && Math.abs(distance(middle(centre), place) - (this.#numbers.value.get(name) ?? 0)) <= EDGE_PX * this.picture.scale.value;
    });
  }

  /** @param {Place} at */
  press(at) {
    const name = this.#nearest(at);
    const place = this.#places.value.get(name ?? "");
    const radius = this.#edge(at);
    if (name !== null && place !== undefined) {
      this.#drag = { handle: name, grip: [at[0] - place[0], at[1] - place[1]] };
      this.#focusOn(name);
      this.#magnified.value = name;
    } else if (radius) this.#drag = { radius };
    return this.#drag !== null;
  }

  /** @param {Place} at */
  move(at) {
    if (this.#drag === null) {
      this.#near.value = this.#nearest(at);
    } else if ("radius" in this.#drag) {
      const { radius } = this.#drag;
      this.#count(radius, distance(middle(this.#places.value.get(radius.about ?? "") ?? at), at));
    } else {
      const { handle, grip } = this.#drag;
      this.#put(handle, at[0] - grip[0], at[1] - grip[1]);
    }
  }

  release() {
    this.#drag = null;
    this.#magnified.value = null;
  }

  /**
   * @param {string} name
   * @param {number} x
   * @param {number} y
   */
  #put(name, x, y) {
    const [width, height] = this.picture.size.value;
    const tenth = (/** @type {number} */ value) => Math.round(value * 10) / 10;
    this.#places.value = new Map([...this.#places.value, [name, [within(tenth(x), width - 1), within(tenth(y), height - 1)]]]);
    this.#placed.value = this.#placed.value.filter((each) => each !== name);
    this.#offered.value = this.#offered.value.filter((each) => each !== name);
    this.#told.value = this.#magnified.value = name;
    this.#touched();
  }

  /**
   * @param {MarkNumber} number
   * @param {number} value
   */
  #count(number, value) {
    this.#numbers.value = new Map([...this.#numbers.value, [number.name, allowed(number, value)]]);
    this.#touched();
  }

  /** A person has changed the mark. */
  #touched() {
    this.#isMade.value = true;
    this.#changed();
  }
}

/**
 * @param {unknown} value
 * @returns {value is Place}
 */
function isPlace(value) {
  return Array.isArray(value) && value.length === 2 && value.every(Number.isFinite);
}

/** The middle of a pixel; undefined without a place.
 *
 * @param {Place|undefined} place
 */
function middle(place) {
  return place ? place.map((value) => value + 0.5) : [];
}

/**
 * @param {readonly number[]} one
 * @param {readonly number[]} other
 */
function distance([x, y], [u, v]) {
  return Math.hypot(x - u, y - v);
}

/** The nearest allowed value of a number.
 *
 * @param {MarkNumber} number
 * @param {number} value
 */
function allowed({ minimum, maximum, step: by }, value) {
  const steps = Math.round((value - minimum) / by);
  return Math.min(Math.max(minimum, Number((minimum + steps * by).toPrecision(12))), maximum);
}
