/** The key of a panel: what it shows, each with a small piece of it, painted by the same code. It stands above the axes. */

import { h } from "../dom.js";
import { gradient, viridis } from "../colours.js";
import { kindOf } from "./kinds/kinds.js";
import { most } from "./kinds/heat_map.js";
import { Scale } from "./scale.js";
import { written } from "./ticks.js";

/** @import { Axis, Trace } from "./traces.js" */

/** Of a piece, in units of the size of the letters. */
const [WIDE, HIGH] = [2, 1];
const INSET = 0.12;
/** @type {Axis} */
const UNIT = { title: "", unit: "", low: 0, high: 1, log: false, names: [], hidden: true };

export class Legend {
  element = h("ul", { class: "figure-key" });
  #shown = "";

  /**
   * @param {readonly Trace[]} traces
   * @param {Record<string, string>} ink
   * @param {number} em px
   * @returns {boolean} Whether it is another one than before.
   */
  show(traces, ink, em) {
    const entries = traces.filter(({ title }) => title !== "");
    const told = [...new Map(entries.map((trace) => [`${look(trace)} ${trace.title}`, trace])).values()];
    const now = JSON.stringify([told.map((trace) => [look(trace), trace.title, extent(trace)]), ink, em, devicePixelRatio]);
    if (now === this.#shown) return false;
    this.#shown = now;
    this.element.replaceChildren(...told.map((trace) => h("li", {}, piece(trace, ink, em), trace.title, amount(extent(trace)))));
    return true;
  }
}

/** @param {string} text */
function amount(text) {
  return text && h("span", { class: "figure-extent" }, text);
}

/** @param {Trace} trace */
function look(trace) {
  const { kind, ink } = trace;
  const more = { dashed: "dashed" in trace && trace.dashed, stacked: "stacked" in trace && trace.stacked, area: "area" in trace && trace.area !== null };
  return JSON.stringify([kind, ink, more, "along" in trace && trace.along]);
}

/** @param {Trace} trace */
function extent(trace) {
  return trace.kind === "heat map" && "values" in trace ? `0 to ${written(Number(most(trace).toPrecision(2)))}` : "";
}

/**
 * @param {Trace} trace
 * @param {Record<string, string>} ink
 * @param {number} em
 */
function piece(trace, ink, em) {
  if (trace.kind === "heat map") {
    const bar = h("span", { class: "figure-bar", "aria-hidden": "true" });
    bar.style.background = gradient(viridis);
    return bar;
  }
  const [width, height] = [WIDE * em, HIGH * em];
  const canvas = h("canvas", { width: Math.round(width * devicePixelRatio), height: Math.round(height * devicePixelRatio), "aria-hidden": "true" });
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  pen.scale(devicePixelRatio, devicePixelRatio);
  const box = { left: INSET * em, top: INSET * em, width: width - 2 * INSET * em, height: height - 2 * INSET * em };
  const x = new Scale(UNIT, box.left, box.left + box.width);
  const y = new Scale(UNIT, box.top + box.height, box.top);
  const isBars = trace.kind === "bars" && !trace.stacked;
  const across = isBars ? new Scale({ ...UNIT, low: -0.5, high: 1.5 }, box.left, box.left + box.width) : x;
  const sheet = { pen, box, x: across, y, axes: { x: UNIT, y: UNIT }, ink, unit: em / 13, cased: false };
  kindOf(trace).paint(sheet, kindOf(trace).sample(trace), { index: 0, count: 1 });
  return canvas;
}
