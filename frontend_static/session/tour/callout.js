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

  #watched;

  /**
   * @param {AbortSignal} signal Ends it.
   * @param {() => Element|null} watched What the notes tell to watch, which they leave free.
   */
  constructor(signal, watched = () => null) {
    this.#watched = watched;
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

  /** Put it where there is room for it, beside what it points at, and where it covers least of what is to be watched. */
  #settle() {
    const { offsetWidth: width, offsetHeight: height } = this.#element;
    const at = this.#target.getBoundingClientRect();
    const watched = this.#watched()?.getBoundingClientRect() ?? null;
    const found = places(at, watched, width, height);
    const covers = (/** @type {Placed} */ { left, top }) => {
      const own = { left, top, right: left + width, bottom: top + height };
      return shared(own, at) + (watched ? shared(own, watched) : 0);
    };
    const { side, left, top } = found.reduce((best, each) => (covers(each) < covers(best) ? each : best));
    const isBeside = side === "left" || side === "right";
    const middle = { x: at.left + at.width / 2, y: at.top + at.height / 2 };
    this.#element.dataset.side = side;
    this.#element.style.left = `${left}px`;
    this.#element.style.top = `${top}px`;
    this.#element.style.setProperty("--at", `${isBeside ? within(middle.y - top, height) : within(middle.x - left, width)}px`);
  }
}

/** @typedef {{left: number, top: number, right: number, bottom: number}} Area */
/** @typedef {{side: Side, left: number, top: number}} Placed */

/**
 * Where a note may stand, the better ones first: at each side in its middle, or moved along it off what is watched.
 *
 * @param {DOMRect} at What it points at.
 * @param {DOMRect|null} watched
 * @param {number} width
 * @param {number} height
 * @returns {Placed[]}
 */
function places(at, watched, width, height) {
  const room = { above: at.top, below: innerHeight - at.bottom, left: at.left, right: innerWidth - at.right };
  const needs = { above: height, below: height, left: width, right: width };
  const sides = /** @type {const} */ (["above", "left", "below", "right"]);
  const able = sides.filter((each) => room[each] >= needs[each] + GAP_PX + EDGE_PX);
  const [across, down] = [at.left + at.width / 2 - width / 2, at.top + at.height / 2 - height / 2];
  const lefts = [across, ...(watched ? [watched.right + GAP_PX, watched.left - GAP_PX - width] : [])].map((each) => within(each, innerWidth - width));
  const tops = [down, ...(watched ? [watched.bottom + GAP_PX, watched.top - GAP_PX - height] : [])].map((each) => within(each, innerHeight - height));
  return (able.length > 0 ? able : [sides[0]]).flatMap((side) => /** @type {Placed[]} */ (along(side)));

  /** @param {Side} side */
  function along(side) {
    switch (side) {
      case "above":
        return lefts.map((left) => ({ side, left, top: within(at.top - GAP_PX - height, innerHeight - height) }));
      case "below":
        return lefts.map((left) => ({ side, left, top: at.bottom + GAP_PX }));
      case "left":
        return tops.map((top) => ({ side, left: at.left - GAP_PX - width, top }));
      default:
        return tops.map((top) => ({ side, left: at.right + GAP_PX, top }));
    }
  }
}

/**
 * The area that two have in common, px².
 *
 * @param {Area} one
 * @param {Area} other
 */
function shared(one, other) {
  const across = Math.min(one.right, other.right) - Math.max(one.left, other.left);
  const down = Math.min(one.bottom, other.bottom) - Math.max(one.top, other.top);
  return Math.max(0, across) * Math.max(0, down);
}

/**
 * @param {number} place
 * @param {number} most
 */
function within(place, most) {
  return Math.max(EDGE_PX, Math.min(place, most - EDGE_PX));
}
