/** Words beside what is pointed at. */

import { fill, h } from "./dom.js";

/** @import { Child } from "./elements.js" */

/** @typedef {{x: number, y: number, below: number}} Place In the window, px: the middle of an upper edge, and the lower edge. */

const AWAY_PX = 10;
const MARGIN_PX = 8;

export class Tooltip {
  element = h("div", { class: "tooltip", role: "status", hidden: true });

  hide() {
    this.element.hidden = true;
  }

  /**
   * @param {Child} content
   * @param {Place} place
   */
  show(content, place) {
    fill(this.element, content);
    this.element.hidden = false;
    const { width, height } = this.element.getBoundingClientRect();
    const left = Math.min(Math.max(place.x - width / 2, MARGIN_PX), innerWidth - width - MARGIN_PX);
    const above = place.y - height - AWAY_PX;
    Object.assign(this.element.style, { left: `${left}px`, top: `${above >= MARGIN_PX ? above : place.below + AWAY_PX}px` });
  }
}
