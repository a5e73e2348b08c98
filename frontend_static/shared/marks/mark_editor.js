/**
 * Editors of marks: one for boxes, and one for all kinds that consist of handles and numbers, which also does for kinds
 * that other packages bring along.
 */

import { computed, h, html, signal, useEffect, useSignal } from "../../vendor/preact.js";
import { elementOf } from "../dom.js";
import { HandlesEditor } from "./handles_editor.js";

/** @import { Child } from "../../vendor/preact.js" */
/** @import { Description, Mark } from "./mark_json.js" */

// A picture of a recording that something is marked in: shown as large as there is room, with an overlay whose unit is
// the picture's pixel. Pixels count from the middle of the first one.

/** @typedef {[x: number, y: number]} Place In px of the picture. */

const LOUPE_PX = 96;
const ABOVE_PX = 24;
/** So many pixels of the page one of the picture becomes in the loupe, at least. */
const LARGE = 4;

export class Picture {
  address = signal("");
  /** Width and height. */
  size = signal(/** @type {[number, number]} */ ([1, 1]));
  /** Width in the page, px. */
  room = signal(0);
  /** How many pixels of the picture one of the page is. */
  scale = computed(() => this.size.value[0] / (this.room.value || this.size.value[0]));
  /** @type {HTMLElement|null} What takes the focus and the pointer. */
  current = null;

  /**
   * Show a picture of this size.
   *
   * @param {string} address
   * @param {number} width
   * @param {number} height
   */
  show(address, width, height) {
    this.address.value = address;
    this.size.value = [width, height];
  }

  /**
   * Where a pointer is, from the left upper edge of the picture, and never beyond it.
   *
   * @param {PointerEvent} event
   * @returns {Place}
   */
  at({ clientX, clientY }) {
    const { left, top, width, height } = this.current?.getBoundingClientRect() ?? { left: 0, top: 0, width: 1, height: 1 };
    const [across, down] = this.size.value;
    return [within(((clientX - left) / width) * across, across), within(((clientY - top) / height) * down, down)];
  }
}

/**
 * @param {{picture: Picture, surface: Record<string, unknown>, drawn: Child, above?: Child}} props `surface` is for the
 *     element itself, `drawn` lies in the overlay, `above` over it.
 */
export function PictureView({ picture, surface, drawn, above }) {
  const address = picture.address.value;
  const [width, height] = picture.size.value;
  /** The last address that was loaded, or could not be. */
  const known = useSignal({ address: "", isMissing: false });
  const come = (/** @type {boolean} */ isMissing) => () => (known.value = { address, isMissing });
  const isKnown = known.value.address === address;
  useEffect(() => {
    const { current } = picture;
    if (current) new ResizeObserver(() => (picture.room.value = current.clientWidth)).observe(current);
  }, []);
  return html`<div ref=${picture} ...${surface} class=${`${surface.class} picture ${isKnown ? "" : "loading"}`} style=${{ "--ratio": width / height }}>
    <img alt="" draggable=${false} src=${address || null} width=${width} height=${height} onLoad=${come(false)} onError=${come(true)} />
    <p class="picture-missing" role="alert" hidden=${!isKnown || !known.value.isMissing}>The picture of this frame could not be shown.</p>
    <svg class="picture-overlay" preserveAspectRatio="none" aria-hidden="true" viewBox=${`0 0 ${width} ${height}`}>${drawn}</svg>
    ${above}
  </div>`;
}

/** @param {{picture: Picture, place: Place}} props What is around a point, magnified, beside the finger that hides it. */
export function Loupe({ picture: { address, size, scale }, place }) {
  const zoom = Math.max(LARGE, 2 / scale.value);
  const [width, height] = size.value;
  const [x, y] = place.map((value) => value + 0.5);
  const [left, top] = [x / scale.value, y / scale.value];
  const style = {
    left: within(left - LOUPE_PX / 2, Math.max(0, width / scale.value - LOUPE_PX)),
    top: top > LOUPE_PX + ABOVE_PX ? top - LOUPE_PX - ABOVE_PX : top + ABOVE_PX,
    width: LOUPE_PX,
    height: LOUPE_PX,
    backgroundImage: `url("${address.value}")`,
    backgroundSize: `${width * zoom}px ${height * zoom}px`,
    backgroundPosition: `${LOUPE_PX / 2 - x * zoom}px ${LOUPE_PX / 2 - y * zoom}px`,
  };
  return html`<div class="loupe" aria-hidden="true" style=${style}></div>`;
}

/**
 * @param {number} value
 * @param {number} most
 */
export function within(value, most) {
  return Math.min(Math.max(0, value), most);
}

/** @type {Record<string, [right: number, down: number]>} */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
/** A step with shift, px. */
const FAR = 10;

/**
 * How far a key goes: a pixel, or with shift ten; null for any other key.
 *
 * @param {KeyboardEvent} event
 * @param {Record<string, [right: number, down: number]>} [ways] Where keys go, by their place on the keyboard or their name; else the arrows.
 * @returns {[right: number, down: number]|null}
 */
export function step(event, ways = ARROWS) {
  const way = event.ctrlKey || event.metaKey || event.altKey ? undefined : (ways[event.code] ?? ways[event.key]);
  if (way === undefined) return null;
  event.preventDefault();
  event.stopPropagation();
  const far = event.shiftKey ? FAR : 1;
  return [far * way[0], far * way[1]];
}

// Drawing a box on a picture: by mouse or touch (drag to draw, drag inside to move, drag a corner to resize) and by
// keyboard (arrows move, the keys at the places of W, A, S and D resize, by 1 px or with shift by 10). The box is in pixels
// of the picture and never leaves it.

/** @typedef {[left: number, top: number, width: number, height: number]} Box In px. */

/**
 * What keys do to width and height, by their place on the keyboard. Alt and arrows are the browser's own, back and forth
 * between pages.
 *
 * @type {Record<string, Place>}
 */
const SIZES = { KeyW: [0, -1], KeyA: [-1, 0], KeyS: [0, 1], KeyD: [1, 0] };
const SMALLEST = 4;
/** How near to a corner a pointer takes it, and how near a finger, px of the page. */
const REACH_PX = 10;
const FINGER_PX = 24;
const CORNER_PX = 8;
/** @type {Place[]} */
const CORNERS = [[0, 0], [1, 0], [0, 1], [1, 1]];

/** What these keys are called on the local keyboard, once the browser has told. */
const keys = signal("W, A, S, D of an English keyboard");
navigator.keyboard?.getLayoutMap().then((layout) => {
  keys.value = Object.keys(SIZES).map((code) => (layout.get(code) ?? code.slice(-1)).toUpperCase()).join(", ");
}, () => {});

class BoxEditor {
  #box = signal(/** @type {Box|null} */ (null));
  /**
   * What is dragged: a new corner, the opposite one standing where it is, or the box, taken at a place within it.
   *
   * @type {{from: Place}|{grip: Place}|null}
   */
  #drag = null;
  #picture = new Picture();
  #kind;
  #changed;

  /** @type {HTMLElement} */
  element;

  /**
   * @param {Description} description
   * @param {string} target What is marked.
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

  /** A box is drawn at once. */
  get left() {
    return 0;
  }

  /** @param {Mark|null} mark */
  set(mark) {
    this.#box.value = mark && [Number(mark.x), Number(mark.y), Number(mark.width), Number(mark.height)];
  }

  /** Begin without a box. */
  offer() {
    this.set(null);
  }

  /**
   * @param {string} address
   * @param {number} width
   * @param {number} height
   */
  show(address, width, height) {
    this.#picture.show(address, width, height);
  }

  /** @param {PointerEvent} event */
  centre(event) {
    if (this.#box.value === null) return false;
    const [, , width, height] = this.#box.value;
    const [x, y] = this.#picture.at(event);
    this.#put(x - width / 2, y - height / 2, width, height);
    return true;
  }

  focus() {
    this.#picture.current?.focus({ preventScroll: true });
  }

  /** @param {string} name */
  #view(name) {
    const box = this.#box.value;
    const surface = {
      class: "mark-surface box",
      tabindex: 0,
      role: "application",
      "aria-label": `${name}. Arrow keys move it, the keys ${keys.value} resize it, with shift by 10 px`,
      onPointerDown: (/** @type {PointerEvent} */ event) => this.#press(event),
      onPointerMove: (/** @type {PointerEvent} */ event) => this.#move(event),
      onPointerUp: () => (this.#drag = null),
      onPointerCancel: () => (this.#drag = null),
      onKeyDown: (/** @type {KeyboardEvent} */ event) => this.#key(event),
    };
    const help = html`<span class="by-keyboard">By keyboard, arrows make and move the box, and ${keys} resize it; shift goes by 10 px.</span>`;
    return html`<div class="target-stage" data-mark=${this.#kind}>
      ${h(PictureView, { picture: this.#picture, surface, drawn: box && boxDrawing(box, CORNER_PX * this.#picture.scale.value) })}
      <output class="picture-words" aria-live="polite">${box ? `${box[2]} × ${box[3]} px at ${box[0]}, ${box[1]}` : help}</output>
    </div>`;
  }

  /** @param {PointerEvent} event */
  #press(event) {
    if (event.button !== 0) return;
    event.preventDefault();
    this.#picture.current?.setPointerCapture(event.pointerId);
    this.focus();
    const [x, y] = this.#picture.at(event);
    const corner = this.#corner(x, y, event.pointerType === "touch");
    const [left, top, width, height] = this.#box.value ?? [0, 0, 0, 0];
    const isInside = x > left && y > top && x < left + width && y < top + height;
    if (corner) this.#drag = { from: corner };
    else this.#drag = isInside ? { grip: [x - left, y - top] } : { from: [x, y] };
  }

  /**
   * The corner opposite to the one under the pointer.
   *
   * A finger covers it, and need not be as near; but a small box can still be moved by its middle.
   *
   * @param {number} x
   * @param {number} y
   * @param {boolean} isFinger
   * @returns {Place|null}
   */
  #corner(x, y, isFinger) {
    if (!this.#box.value) return null;
    const [left, top, width, height] = this.#box.value;
    const { value: scale } = this.#picture.scale;
    const near = REACH_PX * scale;
    const reach = isFinger ? Math.max(near, Math.min(FINGER_PX * scale, Math.min(width, height) / 3)) : near;
    const hit = CORNERS.find(([i, j]) => Math.hypot(left + i * width - x, top + j * height - y) <= reach);
    return hit ? [left + (1 - hit[0]) * width, top + (1 - hit[1]) * height] : null;
  }

  /** @param {PointerEvent} event */
  #move(event) {
    if (this.#drag === null) return;
    const [x, y] = this.#picture.at(event);
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
      const [across, down] = this.#picture.size.value;
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
    const [across, down] = this.#picture.size.value;
    const w = Math.min(Math.max(SMALLEST, Math.round(width)), across);
    const t = Math.min(Math.max(SMALLEST, Math.round(height)), down);
    this.#box.value = [within(Math.round(x), across - w), within(Math.round(y), down - t), w, t];
    this.#changed();
  }
}

/**
 * @param {Box} box
 * @param {number} side Of a corner.
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

/**
 * What every editor can do.
 *
 * @typedef {object} MarkEditor
 * @property {HTMLElement} element What is put into the page.
 * @property {Mark|null} mark As the server takes it; null while there is none.
 * @property {number} left How many of its parts still stand where they were offered.
 * @property {(address: string, width: number, height: number) => void} show Show a picture of this size.
 * @property {(mark: Mark|null, placed?: string[]) => void} set Show a mark, or none; the handles that were
 *     `placed` rather than found are hollow until somebody moves them.
 * @property {() => void} offer Begin to have one made.
 * @property {() => void} focus
 * @property {(event: PointerEvent) => boolean} [centre] Put the mark, as large as it is, around a pointer; false if there is none.
 */

/** @type {Record<string, new (description: Description, target: string, changed: () => void) => MarkEditor>} */
const OWN = { box: BoxEditor };

/**
 * @param {Description} description The kind of mark, as an experiment declares it.
 * @param {string} target What is marked, one word.
 * @param {() => void} changed Called when a person has changed the mark.
 * @returns {MarkEditor}
 */
export function markEditor(description, target, changed) {
  const Editor = OWN[description.kind] ?? HandlesEditor;
  return new Editor(description, target, changed);
}

/**
 * What an experiment says of a kind of mark that it takes.
 *
 * @param {import("../messages.js").ExperimentPublic} experiment
 * @param {string|null|undefined} kind
 */
export function descriptionOf(experiment, kind) {
  return experiment.marks.find((mark) => mark.kind === kind);
}
