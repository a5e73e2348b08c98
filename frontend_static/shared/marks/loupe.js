/** A loupe: what is around a point of a picture, magnified, beside the finger that hides it. */

import { h } from "../dom.js";

const SIDE = 96;
const ABOVE = 24;
/** So many pixels of the page one of the picture becomes, at least. */
const LARGE = 4;

export class Loupe {
  element = h("div", { class: "loupe", "aria-hidden": "true", hidden: true });

  constructor() {
    this.element.style.width = this.element.style.height = `${SIDE}px`;
  }

  /**
   * @param {import("./picture.js").Picture} picture
   * @param {[number, number]} place In px of the picture.
   */
  show(picture, [x, y]) {
    const zoom = Math.max(LARGE, 2 / picture.scale);
    const [left, top] = [x + 0.5, y + 0.5];
    const shown = [left / picture.scale, top / picture.scale];
    const fits = shown[1] > SIDE + ABOVE;
    const { style } = this.element;
    style.left = `${Math.min(Math.max(0, shown[0] - SIDE / 2), Math.max(0, picture.width / picture.scale - SIDE))}px`;
    style.top = `${fits ? shown[1] - SIDE - ABOVE : shown[1] + ABOVE}px`;
    style.backgroundImage = `url("${picture.address}")`;
    style.backgroundSize = `${picture.width * zoom}px ${picture.height * zoom}px`;
    style.backgroundPosition = `${SIDE / 2 - left * zoom}px ${SIDE / 2 - top * zoom}px`;
    this.element.hidden = false;
  }

  hide() {
    this.element.hidden = true;
  }
}
