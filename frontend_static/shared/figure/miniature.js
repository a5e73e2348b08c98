/**
 * Lines on a canvas with nothing around them, where there is no room for a panel, or where ten of them must not wait for the
 * forty files that a panel is made of. What stands around a panel is said in words.
 */

import { h } from "../dom.js";
import { watchCanvasSize } from "../canvas_size.js";
import { onTheme, tokens } from "../theme.js";
import * as line from "./kinds/line.js";
import { Scale } from "./scale.js";

/** @import { Axis, Line } from "./traces.js" */

/** Between the lines and the edges, px. */
const INSET = 2;

/**
 * @param {{x: Axis, y: Axis, traces: readonly Line[]}} panel
 * @param {string} words For who cannot see it.
 * @param {AbortSignal} signal Nothing is painted after it.
 */
export function miniature({ x, y, traces }, words, signal) {
  const canvas = h("canvas", {});
  const place = h("div", { class: "figure-miniature", role: "img", "aria-label": words }, canvas);
  const paint = () => {
    const { clientWidth: width, clientHeight: height } = place;
    const pen = canvas.getContext("2d");
    if (pen === null || width === 0 || height === 0) return;
    pen.setTransform(canvas.width / width, 0, 0, canvas.height / height, 0, 0);
    pen.clearRect(0, 0, width, height);
    const box = { left: INSET, top: INSET, width: width - 2 * INSET, height: height - 2 * INSET };
    const scales = { x: new Scale(x, box.left, box.left + box.width), y: new Scale(y, box.top + box.height, box.top) };
    const sheet = { pen, box, ...scales, axes: { x, y }, ink: tokens(...traces.map(({ ink }) => ink)), unit: 1, cased: false };
    for (const trace of traces) line.paint(sheet, trace);
  };
  watchCanvasSize(place, (room) => {
    Object.assign(canvas, room);
    paint();
  }, signal);
  onTheme(paint, signal);
  return place;
}
