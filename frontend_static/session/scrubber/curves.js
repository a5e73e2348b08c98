/**
 * The curves of the scrubber: the figure's lines and areas, each in a row of its own. Longer runs than there are pixels are
 * drawn with the largest value of each pixel, so no peak is lost; the smallest as well would take four times as long.
 */

import * as band from "../../shared/figure/kinds/band.js";
import * as line from "../../shared/figure/kinds/line.js";
import * as figure from "../../shared/figure/canvas.js";
import { curve } from "../history.js";
import { BranchColumns } from "../plots/branch_columns.js";
import { columns } from "../plots/kinds/plot.js";
import { withinRow } from "./rows.js";

/** @import { ThresholdStep } from "../../shared/messages.js" */
/** @import { Store } from "../store.js" */
/** @import { RowName, Sheet } from "./rows.js" */

/** @typedef {{values: number[], ink: string, isActive: boolean}} BranchCurve */

const AREA = 0.16;

/** One curve of all branches. Of a history that has only grown the new frames alone are read. */
export class Curves {
  #columns;
  /** The active branch's is the last, and lies above.
   *
   * @type {BranchCurve[]} */
  all = [];

  /** @param {"error"|"sigma"} name */
  constructor(name) {
    const value = curve[name];
    this.#columns = new BranchColumns((history, from) => columns(history, from, { value }));
  }

  /** @param {Store} store */
  update(store) {
    this.all = this.#columns.update(store).map(({ branch, data, isActive }) => ({ values: data.value, ink: branch.colour, isActive }));
  }

  /** Whether any frame has a value. */
  get isMeasured() {
    const [low, high] = this.#columns.extent;
    return low <= high;
  }

  /**
   * The value at the top of the row.
   *
   * @param {number} smallest The least that it is.
   */
  top(smallest) {
    return Math.max(smallest, this.#columns.most) * 1.05;
  }
}

/**
 * One curve of all branches, that of the active one in a width of its own and, if wanted, with an area below.
 *
 * @param {Sheet} sheet
 * @param {RowName} row
 * @param {Curves} curves
 * @param {{most: number, width: number, hasArea?: boolean}} look `most` is the value at the top of the row.
 */
export function paintCurves(sheet, row, { all }, { most, width, hasArea = false }) {
  const own = withinRow(sheet, row, most);
  for (const { values, ink, isActive } of all) {
    const { x, y } = peaks(values, sheet.axis.width);
    const shape = /** @type {const} */ ({ title: "", name: "", ink });
    if (isActive && hasArea) band.paint(own, { ...shape, kind: "band", x, low: x.map(() => 0), high: y, opacity: AREA });
    line.paint(own, { ...shape, kind: "line", x, y, width: isActive ? width : 1, said: "", unit: "" });
  }
}

/**
 * @param {Sheet} sheet
 * @param {ThresholdStep[]} steps
 * @param {number} most
 */
export function paintThreshold(sheet, steps, most) {
  const own = withinRow(sheet, "sigma", most);
  const path = new Path2D();
  steps.forEach(({ frame, value }, index) => {
    if (value === null) return;
    const at = Math.round(own.y.at(value)) - 0.5;
    path.moveTo(own.x.at(frame), at);
    path.lineTo(own.x.at(steps[index + 1]?.frame ?? sheet.axis.frames - 1), at);
  });
  figure.line(own, path, { ink: "ink", width: 1, dashed: true });
}

/**
 * The largest value of each pixel.
 *
 * @param {readonly number[]} values A frame each; NaN where there is none.
 * @param {number} width px
 */
function peaks(values, width) {
  const bucket = Math.max(1, Math.floor(values.length / width));
  /** @type {{x: number[], y: number[]}} */
  const found = { x: [], y: [] };
  for (let frame = 0; frame < values.length; frame += bucket) {
    let most = -Infinity;
    const end = Math.min(frame + bucket, values.length);
    for (let place = frame; place < end; place += 1) if (values[place] > most) most = values[place];
    found.x.push(frame);
    found.y.push(most === -Infinity ? NaN : most);
  }
  return found;
}
