/** Editors of marks: one for boxes, and one for all kinds of handles and numbers, including those of other packages. */

import { h, html, signal } from "../../vendor/preact.js";
import { elementOf, step } from "../dom.js";
import { HandlesEditor } from "./handles_editor.js";
import { Picture, Stage, within } from "./picture.js";

/** @import { Description, Mark } from "./mark_json.js" */
/** @import { Place } from "./picture.js" */

// Drawing a box on a picture: by mouse or touch (drag to draw, drag inside to move, drag a corner to resize) and by
// keyboard (arrows move, the keys at the places of W, A, S and D resize, by 1 px or with shift by 10). The box is in pixels
// of the picture and never leaves it.

/** @typedef {[left: number, top: number, width: number, height: number]} Box In px. */

/** Changes of width and height by keys, named by their place on the keyboard. Alt with arrows belongs to the browser.
 *
 * @type {Record<string, Place>}
 */
const SIZES = { KeyW: [0, -1], KeyA: [-1, 0], KeyS: [0, 1], KeyD: [1, 0] };
const SMALLEST = 4;
/** Reach of a corner for a pointer and for a finger, px of the page. */
const REACH_PX = 10;
const FINGER_PX = 24;
const CORNER_PX = 8;
/** @type {Place[]} */
const CORNERS = [[0, 0], [1, 0], [0, 1], [1, 1]];

/** Names of these keys on the local keyboard, once the browser has reported them. */
const keys = signal("W, A, S, D of an English keyboard");
navigator.keyboard?.getLayoutMap().then((layout) => {
  keys.value = Object.keys(SIZES).map((code) => (layout.get(code) ?? code.slice(-1)).toUpperCase()).join(", ");
}, () => {});

class BoxEditor {
  #box = signal(/** @type {Box|null} */ (null));
  /** The dragged part: a corner, with the opposite one fixed, or the box, held at a place within it.
   *
   * @type {{from: Place}|{grip: Place}|null}
   */
  #drag = null;
  #kind;
  #changed;

  picture = new Picture();
  /** A box has no proposed parts. */
  left = 0;

  /** @type {HTMLElement} */
  element;

  /**
   * @param {Description} description
   * @param {string} target Name of the target.
   * @param {() => void} changed Called when a person has changed the box.
   */
  constructor({ kind, title }, target, changed) {
    this.#kind = kind;
    this.#changed = changed;
    this.element = elementOf(h(() => this.#view(`${title}, ${target}`), {}));
  }

  get mark() {
    if (this.#box.value === null) return null;
    const [x, y, width, height] = this.#box.value;
    return { kind: this.#kind, x, y, width, height };
  }

  /** @param {Mark|null} mark */
  set(mark) {
    this.#box.value = mark && [Number(mark.x), Number(mark.y), Number(mark.width), Number(mark.height)];
  }

  /** Begin without a box. */
  offer() {
    this.set(null);
  }

  /** @param {PointerEvent} event */
  centre(event) {
    if (this.#box.value === null) return false;
    const [, , width, height] = this.#box.value;
    const [x, y] = this.picture.at(event);
    this.#put(x - width / 2, y - height / 2, width, height);
    return true;
  }

  focus() {
    this.picture.current?.focus({ preventScroll: true });
  }

  /** @param {string} name */
  #view(name) {
    const box = this.#box.value;
    const surface = {
      class: "box",
      tabindex: 0,
      role: "application",
      "aria-label": `${name}. Arrow keys move it, the keys ${keys.value} resize it, with shift by 10 px`,
      onKeyDown: (/** @type {KeyboardEvent} */ event) => this.#key(event),
    };
    const help = html`<span class="by-keyboard">By keyboard, arrows make and move the box, and ${keys} resize it; shift goes by 10 px.</span>`;
    const words = box ? `${box[2]} × ${box[3]} px at ${box[0]}, ${box[1]}` : help;
    return h(Stage, { kind: this.#kind, editor: this, surface, words, drawn: box && boxDrawing(box, CORNER_PX * this.picture.scale.value) });
  }

  /**
   * @param {Place} place
   * @param {PointerEvent} event
   */
  press([x, y], event) {
    this.focus();
    const corner = this.#corner(x, y, event.pointerType === "touch");
    const [left, top, width, height] = this.#box.value ?? [0, 0, 0, 0];
    const isInside = x > left && y > top && x < left + width && y < top + height;
    if (corner) this.#drag = { from: corner };
    else this.#drag = isInside ? { grip: [x - left, y - top] } : { from: [x, y] };
    return true;
  }

  release() {
    this.#drag = null;
  }

  /**
   * The corner opposite to the one under the pointer.
   * A finger covers it, and need not be as close; but a small box can still be moved by its middle.
   *
   * @param {number} x
   * @param {number} y
   * @param {boolean} isFinger
   * @returns {Place|null}
   */
  #corner(x, y, isFinger) {
    if (!this.#box.value) return null;
    const [left, top, width, height] = this.#box.value;
    const { value: scale } = this.picture.scale;
    const near = REACH_PX * scale;
    const reach = isFinger ? Math.max(near, Math.min(FINGER_PX * scale, Math.min(width, height) / 3)) : near;
    const hit = CORNERS.find(([i, j]) => Math.hypot(left + i * width - x, top + j * height - y) <= reach);
    return hit ? [left + (1 - hit[0]) * width, top + (1 - hit[1]) * height] : null;
  }

  /** @param {Place} place */
  move([x, y]) {
    if (this.#drag === null) return;
    if ("grip" in this.#drag) {
      const [, , width, height] = this.#box.value ?? [0, 0, 0, 0];
      this.#put(x - this.#drag.grip[0], y - this.#drag.grip[1], width, height);
      return;
    }
    const [fromX, fromY] = this.#drag.from;
    const [width, height] = [Math.abs(x - fromX), Math.abs(y - fromY)];
    if (width < 2 && height < 2) return;
    this.#put(Math.min(x, fromX), Math.min(y, fromY), width, height);
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const box = this.#box.value;
    const size = box && step(event, SIZES);
    const way = size ?? step(event);
    if (way === null) return;
    if (box === null) {
      const [across, down] = this.picture.size.value;
      const side = Math.round(Math.min(across, down) / 6);
      this.#put((across - side) / 2, (down - side) / 2, side, side);
    } else {
      const [x, y, width, height] = box;
      if (size) this.#put(x, y, width + size[0], height + size[1]);
      else this.#put(x + way[0], y + way[1], width, height);
    }
  }

  /**
   * @param {number} x
   * @param {number} y
   * @param {number} width
   * @param {number} height
   */
  #put(x, y, width, height) {
    const [across, down] = this.picture.size.value;
    const w = Math.min(Math.max(SMALLEST, Math.round(width)), across);
    const t = Math.min(Math.max(SMALLEST, Math.round(height)), down);
    this.#box.value = [within(Math.round(x), across - w), within(Math.round(y), down - t), w, t];
    this.#changed();
  }
}

/**
 * @param {Box} box
 * @param {number} side Side of a corner's square.
 */
function boxDrawing([x, y, width, height], side) {
  const corner = (/** @type {Place} */ [i, j]) =>
    html`<rect class="mark-corner" x=${x + i * width - side / 2} y=${y + j * height - side / 2} width=${side} height=${side} />`;
  return html`
    <rect class="mark-halo" x=${x} y=${y} width=${width} height=${height} />
    <rect class="mark-line" x=${x} y=${y} width=${width} height=${height} />
    ${CORNERS.map(corner)}
  `;
}

/** The interface of every editor. A component that reads `mark` or `left` follows them as signals.
 *
 * @typedef {object} MarkEditor
 * @property {HTMLElement} element Element for the page.
 * @property {Mark|null} mark Mark in the server's form; null while there is none.
 * @property {number} left Number of its parts still at their proposed places.
 * @property {Picture} picture Picture on which the mark is made.
 * @property {(mark: Mark|null, placed?: string[]) => void} set Show a mark, or none; the handles that were
 *     `placed` rather than found are hollow until a person moves them.
 * @property {() => void} offer Let a person begin a mark.
 * @property {() => void} focus
 * @property {(event: PointerEvent) => boolean} [centre] Move the mark to a pointer, without changing its size; false if there is none.
 */

/** @type {Record<string, new (description: Description, target: string, changed: () => void) => MarkEditor>} */
const OWN = { box: BoxEditor };

/**
 * @param {Description} description The kind of mark, as an experiment declares it.
 * @param {string} target Name of the target, one word.
 * @param {() => void} [changed] Called when a person has changed the mark.
 * @returns {MarkEditor}
 */
export function markEditor(description, target, changed = () => {}) {
  const Editor = OWN[description.kind] ?? HandlesEditor;
  return new Editor(description, target, changed);
}

/** An experiment's description of a kind of mark.
 *
 * @param {import("../messages.js").ExperimentPublic} experiment
 * @param {string|null|undefined} kind
 */
export function descriptionOf(experiment, kind) {
  return experiment.marks.find((mark) => mark.kind === kind);
}
