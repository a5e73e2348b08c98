/**
 * A note that points at one thing of the page. It lies over everything and stands, for the keyboard, right before what it
 * points at, so that the next stop of the tab key is the thing to press.
 */

import { fill, h } from "../../shared/dom.js";
import { coalesce } from "../../shared/timing.js";

/** @import { Child } from "../../shared/elements.js" */

const GAP_PX = 12;
const EDGE_PX = 8;
const TITLE = "callout-title";
const WORDS = "callout-words";

/** @typedef {"above"|"below"|"left"|"right"} Side */

export class Callout {
  #element = h("div", { class: "callout", role: "dialog", popover: "manual", tabindex: -1, "aria-labelledby": TITLE, "aria-describedby": WORDS });
  #target = document.body;
  #place;

  /** @param {AbortSignal} signal Ends it. */
  constructor(signal) {
    this.#place = coalesce(() => this.#settle(), signal);
    addEventListener("resize", this.#place, { signal });
    document.addEventListener("scroll", this.#place, { capture: true, signal });
    const sizes = new ResizeObserver(this.#place);
    sizes.observe(document.documentElement);
    sizes.observe(this.#element);
    signal.addEventListener("abort", () => {
      sizes.disconnect();
      this.#target.classList.remove("pointed-at");
      this.#element.remove();
    });
  }

  /**
   * @param {HTMLElement} target What it points at.
   * @param {string} title
   * @param {Child[]} words
   * @param {Child[]} actions
   * @param {{takesFocus?: boolean}} [options] Whether it is read out at once, with the keyboard going on from it.
   */
  show(target, title, words, actions, { takesFocus = true } = {}) {
    this.#target.classList.remove("pointed-at");
    this.#target = target;
    target.classList.add("pointed-at");
    fill(this.#element, h("h2", { id: TITLE }, title), h("div", { id: WORDS, class: "callout-words" }, words), h("footer", {}, actions));
    if (this.#element.nextElementSibling !== target) target.before(this.#element);
    this.#element.showPopover();
    target.scrollIntoView({ block: "nearest", inline: "nearest" });
    this.#settle();
    if (takesFocus) this.#element.focus({ preventScroll: true });
  }

  /** Put it where there is room for it, beside what it points at. */
  #settle() {
    const { offsetWidth: width, offsetHeight: height } = this.#element;
    const at = this.#target.getBoundingClientRect();
    const room = { above: at.top, below: innerHeight - at.bottom, left: at.left, right: innerWidth - at.right };
    const needs = { above: height, below: height, left: width, right: width };
    const sides = /** @type {const} */ (["above", "left", "below", "right"]);
    const side = sides.find((each) => room[each] >= needs[each] + GAP_PX + EDGE_PX) ?? "above";
    const middle = { x: at.left + at.width / 2, y: at.top + at.height / 2 };
    const isBeside = side === "left" || side === "right";
    const centred = { x: middle.x - width / 2, y: middle.y - height / 2 };
    const corners = {
      above: { ...centred, y: at.top - GAP_PX - height },
      below: { ...centred, y: at.bottom + GAP_PX },
      left: { ...centred, x: at.left - GAP_PX - width },
      right: { ...centred, x: at.right + GAP_PX },
    };
    const left = within(corners[side].x, innerWidth - width);
    const top = within(corners[side].y, innerHeight - height);
    this.#element.dataset.side = side;
    this.#element.style.left = `${left}px`;
    this.#element.style.top = `${top}px`;
    this.#element.style.setProperty("--at", `${isBeside ? within(middle.y - top, height) : within(middle.x - left, width)}px`);
  }
}

/**
 * @param {number} place
 * @param {number} most
 */
function within(place, most) {
  return Math.max(EDGE_PX, Math.min(place, most - EDGE_PX));
}
