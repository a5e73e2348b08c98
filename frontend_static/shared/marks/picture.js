/**
 * A picture of a recording that something is marked in: shown as large as there is room, with an overlay whose unit is
 * the picture's pixel. Pixels count from the middle of the first one.
 */

import { h, svg } from "../dom.js";

/** @import { Properties } from "../elements.js" */

export class Picture {
  #image = h("img", { alt: "", draggable: "false" });
  #missing = h("p", { class: "picture-missing", role: "alert", hidden: true }, "The picture of this frame could not be shown.");
  #overlay;
  #wanted = "";
  width = 1;
  height = 1;

  /**
   * @param {Properties} properties Of the element, which takes the focus and the pointer.
   * @param {Element[]} marks What is drawn over the picture, in its pixels.
   * @param {() => void} resized
   */
  constructor(properties, marks, resized) {
    this.#overlay = svg("svg", { class: "picture-overlay", preserveAspectRatio: "none", "aria-hidden": "true" }, marks);
    this.element = h("div", properties, this.#image, this.#missing, this.#overlay);
    this.element.classList.add("picture");
    this.#image.addEventListener("load", () => this.#came(true));
    this.#image.addEventListener("error", () => this.#came(false));
    new ResizeObserver(resized).observe(this.element);
  }

  get address() {
    return this.#wanted;
  }

  /**
   * Show a picture of this size.
   *
   * @param {string} address
   * @param {number} width
   * @param {number} height
   */
  show(address, width, height) {
    if (address !== this.#wanted) {
      this.element.classList.add("loading");
      this.#image.src = address;
    }
    this.#wanted = address;
    [this.width, this.height] = [width, height];
    [this.#image.width, this.#image.height] = [width, height];
    this.element.style.setProperty("--ratio", String(width / height));
    this.#overlay.setAttribute("viewBox", `0 0 ${width} ${height}`);
  }

  /** @param {boolean} isShown */
  #came(isShown) {
    this.element.classList.remove("loading");
    this.#missing.hidden = isShown;
  }

  /** How many pixels of the picture one of the page is. */
  get scale() {
    return this.width / (this.element.clientWidth || this.width);
  }

  /**
   * Where a pointer is, from the left upper edge of the picture, and never beyond it.
   *
   * @param {PointerEvent} event
   * @returns {[number, number]}
   */
  at(event) {
    const area = this.element.getBoundingClientRect();
    /** @param {number} value @param {number} most */
    const within = (value, most) => Math.min(Math.max(0, value), most);
    return [
      within(((event.clientX - area.left) / area.width) * this.width, this.width),
      within(((event.clientY - area.top) / area.height) * this.height, this.height),
    ];
  }
}

/** @type {Record<string, [right: number, down: number]>} */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/**
 * How far an arrow key goes; null for any other key.
 *
 * @param {KeyboardEvent} event
 */
export function arrow(event) {
  return event.ctrlKey || event.metaKey || event.altKey ? null : (ARROWS[event.key] ?? null);
}
