/**
 * The memory of a run as a picture: error, sigma against its thresholds, ESS, proposals, events, how probable a loss is, bands
 * and marks, in rows over one axis of frames. What is in a row are traces, as in any figure (`shared/figure`).
 */

import { plainAxis, scales } from "../../shared/figure/axes.js";
import { KINDS as PAINTERS, lineOver } from "../../shared/figure/kinds.js";
import { points, within } from "../../shared/figure/paint.js";
import { smallestSpan } from "../../shared/format.js";
import { band, branchesOf, most, range, reader, stackOf, thresholdsOf } from "../plots/kinds.js";
import { column, shades } from "../plots/plots.js";
import { numberOf, ofRole } from "../readings.js";
import { marks } from "../steering.js";
import { curve, isGone } from "../store.js";

/** @import { Scale } from "../../shared/figure/axes.js" */
/** @import { Sheet } from "../../shared/figure/paint.js" */
/** @import { Segments, Spans, Trace } from "../../shared/figure/traces.js" */
/** @import { Mark } from "../steering.js" */
/** @import { Curve, History, Store } from "../store.js" */

/** @typedef {"flags"|"error"|"sigma"|"ess"|"proposal"|"events"|"loss"|"bands"|"changes"} RowName */
/** @typedef {Partial<Record<RowName, [label: string, top: number, height: number]>>} Rows From top to bottom; px. */
/** @typedef {{pen: CanvasRenderingContext2D, ink: Record<string, string>}} Paper The pen is scaled to px of the scrubber, the colours are by token. */
/** @typedef {{traces: Trace[], most?: number}} Content Of a row, with the value at its top. */

/** What each row is called, how high it is, and how much is free below it, px: from one name to the next is a line of letters. */
const ROWS = /** @type {const} */ ({
  flags: ["", 12, 0],
  error: ["error", 34, 4],
  sigma: ["sigma", 24, 4],
  ess: ["ESS", 6, 5],
  proposal: ["proposal", 8, 5],
  events: ["events", 14, 4],
  loss: ["P(lost)", 8, 5],
  bands: ["hidden, lost", 10, 2],
  changes: ["changes", 16, 2],
});
/** What is left out first where not all of them have room: the plots say it, too. */
const DISPENSABLE = /** @type {const} */ (["proposal", "ess", "sigma", "loss"]);
/** The rows that show series, and the role of these. */
const ROLES = /** @type {const} */ ({ ess: "ess", proposal: "share", events: "event", loss: "loss_probability" });
/** What the first curve gives to the others before, px. */
const GIVEN = 20;
/** Between the values of a row and its edges, px. */
const INSET = 1;
const GUTTER = 104;
const MARGIN = 10;
const AREA = 0.16;

export class Memory {
  #store;
  #hidden = shades("hidden", 0.2, (row) => row.hidden === true);
  /** A lane each.
   *
   * @type {((history: History) => Spans)[]} */
  #lost = [];
  #loss;
  #weight;
  /** @type {ReturnType<typeof stackOf>|null} */
  #stack = null;
  /** @type {Rows} */
  rows = {};
  /** @type {Mark[]} */
  marks = [];
  /** Where frames lie along x. */
  axis = axisOf(600, 2);

  /** @param {Store} store */
  constructor(store) {
    const role = (/** @type {"ess"|"particles"|"loss_probability"} */ name) => /** @type {Curve} */ ((row) => numberOf(store.known, name, row));
    const [ess, particles] = [role("ess"), role("particles")];
    this.#store = store;
    this.#loss = role("loss_probability");
    /** @type {Curve} Which share of the particles carries the weight. */
    this.#weight = (row) => Number(ess(row) ?? NaN) / (particles(row) || NaN);
  }

  /**
   * Find where the rows stand that there is something for.
   *
   * @param {number} width px
   * @param {number} height px
   */
  arrange(width, height) {
    const { known } = this.#store;
    this.axis = axisOf(width, known.frames);
    this.rows = rowsWithout(this.#missing(), height);
    this.marks = marks(known);
  }

  /**
   * The rows that no frame has anything for: a method without particles has no ESS, a recording without truth no error.
   * Until a frame is computed nothing is known of the curves, and they keep their room.
   *
   * @returns {RowName[]}
   */
  #missing() {
    const { known, history } = this.#store;
    // In the first frame no tracker can have lost its target yet: what is told from the next one on has its room.
    const isThere = (/** @type {"ess"|"share"|"event"|"loss_probability"} */ role) =>
      ofRole(known, role).some(({ name }) => (role === "loss_probability" && history.length <= 1) || history.measures(name));
    const series = /** @type {(keyof typeof ROLES)[]} */ (Object.keys(ROLES)).filter((name) => !isThere(ROLES[name]));
    if (history.length === 0) return series;
    const curves = /** @type {const} */ (["error", "sigma"]).filter((name) => !Number.isFinite(range(this.#store, [curve[name]])[0]));
    return [...series, ...curves, ...(this.#gone === "" ? /** @type {const} */ (["bands"]) : [])];
  }

  /** What is known of a target that is not seen: whether it is hidden, whether it is lost, or both; in words. */
  get #gone() {
    const { history } = this.#store;
    const isKnown = history.some(({ hidden }) => typeof hidden === "boolean") && "hidden";
    return [isKnown, history.some((row) => Boolean(row.lost_by)) && "lost"].filter(Boolean).join(", ");
  }

  /**
   * What each row is called.
   *
   * @returns {{label: string, middle: number}[]} From top to bottom; px from the top.
   */
  get labels() {
    const { known } = this.#store;
    /** @type {Partial<Record<RowName, string>>} */
    const own = {
      sigma: thresholdsOf(known).traces.length > 0 ? "sigma | limit" : "sigma",
      proposal: ofRole(known, "share")[0]?.title ?? "",
      bands: this.#gone,
    };
    const listed = /** @type {[RowName, [string, number, number]][]} */ (Object.entries(this.rows));
    return listed.map(([name, [label, top, height]]) => ({ label: own[name] ?? label, middle: top + height / 2 })).filter(({ label }) => label !== "");
  }

  /**
   * Paint all but the playhead.
   *
   * @param {Paper} paper
   */
  paint(paper) {
    const { pen, ink } = paper;
    pen.clearRect(0, 0, pen.canvas.width, pen.canvas.height);
    const { changes, flags, ...others } = this.rows;
    const content = this.#content();
    for (const [name, [, top, height]] of /** @type {[keyof typeof others, [string, number, number]][]} */ (Object.entries(others))) {
      pen.fillStyle = ink.well;
      pen.fillRect(this.axis.left, top, this.axis.width, height);
      const { traces, most: highest = 1 } = content[name]();
      const sheet = this.#sheet(paper, name, highest);
      within(sheet, 0, () => traces.forEach((trace) => PAINTERS[trace.kind].paint(sheet, trace, traces)));
    }
    if (changes) this.#changes(this.#sheet(paper, "changes", 1));
    if (flags) this.#flags(paper);
  }

  /**
   * What is in the rows, from the back to the front. Only the active branch has more than curves.
   *
   * @returns {Record<Exclude<RowName, "flags"|"changes">, () => Content>}
   */
  #content() {
    const store = this.#store;
    const { known, history } = store;
    const [smallest, hidden] = [smallestSpan(known.unit), this.#hidden(history)];
    return {
      error: () => ({ traces: [hidden, ...this.#curves(curve.error, 1.6, AREA)], most: 1.05 * Math.max(smallest, most(store, [curve.error])) }),
      sigma: () => {
        const limits = thresholdsOf(known);
        const highest = Math.max(1.05 * Math.max(smallest, most(store, [curve.sigma])), 1.25 * limits.most);
        return { traces: [hidden, ...this.#curves(curve.sigma, 1.4), ...limits.traces], most: highest };
      },
      // By height and by how opaque it is, so that it is not told by colour alone.
      ess: () => {
        const { x, y } = peaks(column(history, this.#weight), this.axis.width);
        const [half, middle] = [(x[1] ?? 1) / 2, y.map((share) => (Number.isNaN(share) ? NaN : 0.5))];
        const places = { x0: x.map((at) => at - half), y0: middle, x1: x.map((at) => at + half), y1: middle };
        return { traces: [segments("ramp", this.rows.ess?.[2] ?? 0, places, y.map((share) => 0.08 + 0.92 * share))] };
      },
      loss: () => {
        const { x, y } = peaks(column(history, this.#loss), this.axis.width);
        return { traces: [segments("lost", this.#px(x[1] ?? 1), { x0: x, y0: y.map(() => 0), x1: x, y1: y }, y.map((share) => 0.4 + 0.6 * share))] };
      },
      proposal: () => (this.#stack ??= stackOf(known))(history, bucketOf(history.length, this.axis.width)),
      events: () => {
        const all = ofRole(known, "event");
        const traces = all.map(({ name, colours }, place) => {
          const frames = column(history, reader(name)).flatMap((value, frame) => (value > 0 ? [frame] : []));
          const [top, bottom] = [0, 1].map((down) => frames.map(() => all.length - place - down));
          return segments(colours[0] ?? "ink", Math.max(2, Math.min(5, this.#px(1))), { x0: frames, y0: top, x1: frames, y1: bottom }, frames.map(() => 1));
        });
        return { traces, most: all.length };
      },
      bands: () => {
        const losses = store.losses.length > 0 ? store.losses : [{ history, colour: "lost" }];
        // A loss leaves something to be seen of what is behind it, and of the lane beside.
        const apart = losses.length === 1 ? 0.2 : 0.1;
        const traces = losses.map(({ history: own, colour }, place) => {
          const { intervals, ...trace } = (this.#lost[place] ??= shades("lost", 1, isGone))(own);
          const lane = losses.length - place;
          return { ...trace, ink: colour, intervals: intervals.map(({ first, last }) => ({ first, last, low: lane - 1 + apart, high: lane - apart })) };
        });
        return { traces: [{ ...hidden, opacity: 0.55 }, ...traces], most: losses.length };
      },
    };
  }

  /**
   * One curve of all branches, that of the active one in a width of its own and, if wanted, with an area below.
   *
   * @param {Curve} read
   * @param {number} width
   * @param {number} [opacity] Of the area.
   * @returns {Trace[]}
   */
  #curves(read, width, opacity = 0) {
    return branchesOf(this.#store).flatMap(({ ink, isActive, history }) => {
      const { x, y } = peaks(column(history, read), this.axis.width);
      const own = lineOver({ ink, x, y, width: isActive ? width : 1 });
      return isActive && opacity > 0 ? [{ ...band("", ink, y.map(() => 0), y, x), opacity }, own] : [own];
    });
  }

  /**
   * A row as what traces are painted on: frames to the right, values from 0 on upwards.
   *
   * @param {Paper} paper
   * @param {RowName} name
   * @param {number} highest The value at the top.
   * @returns {Sheet}
   */
  #sheet({ pen, ink }, name, highest) {
    const [, top = 0, height = 0] = this.rows[name] ?? [];
    const inset = name === "error" || name === "sigma" ? INSET : 0;
    const box = { left: this.axis.left, top, width: this.axis.width, height };
    const axes = { x: plainAxis({ low: 0, high: this.axis.frames - 1 }), y: plainAxis({ low: 0, high: highest }) };
    const { y } = scales(axes, { ...box, top: top + inset, height: height - 2 * inset });
    return { pen, box, x: this.axis.scale, y, axes, ink, unit: 1, cased: false };
  }

  /**
   * How wide so many frames are.
   *
   * @param {number} frames
   */
  #px(frames) {
    return (frames * this.axis.width) / (this.axis.frames - 1);
  }

  /**
   * A diamond for each change, and what it was, where there is room.
   *
   * @param {Sheet} sheet
   */
  #changes(sheet) {
    const { pen, ink, box } = sheet;
    const [x, middle] = [Float64Array.from(this.marks, ({ frame }) => this.axis.x(frame)), box.top + box.height / 2];
    points(sheet, x, x.map(() => middle), { ink: "ink", shape: "diamond", radius: 4 });
    pen.textAlign = "left";
    pen.textBaseline = "middle";
    pen.fillStyle = ink.ink;
    let free = 0;
    this.marks.forEach(({ lines }, index) => {
      const text = lines.length > 1 ? `${lines[0]}, …` : lines[0];
      const room = (index + 1 < x.length ? x[index + 1] - 8 : box.left + box.width) - x[index] - 9;
      if (x[index] <= free || !text || pen.measureText(text).width > room) return;
      pen.fillText(text, x[index] + 9, middle + 0.5);
      free = x[index] + 9 + pen.measureText(text).width;
    });
  }

  /** @param {Paper} paper */
  #flags({ pen, ink }) {
    const { bookmarks, branch } = this.#store.known;
    pen.fillStyle = ink.accent;
    pen.beginPath();
    for (const { frame } of bookmarks.filter((mark) => !mark.branch || mark.branch === branch)) {
      const x = Math.round(this.axis.x(frame)) + 0.5;
      pen.moveTo(x - 4, 0);
      for (const [right, down] of [[4, 0], [4, 11], [0, 7.5], [-4, 11]]) pen.lineTo(x + right, down);
      pen.closePath();
    }
    pen.fill();
  }

  /**
   * Paint where the run stands: a line through all rows with a grip on top.
   *
   * @param {Paper} paper
   * @param {number} position
   * @param {number} computed
   */
  playhead({ pen, ink }, position, computed) {
    const x = Math.round(this.axis.x(position)) + 0.5;
    const bottom = (this.rows.changes?.[1] ?? 0) - 2;
    pen.strokeStyle = pen.fillStyle = ink.ink;
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.moveTo(x, 6);
    pen.lineTo(x, bottom);
    pen.stroke();
    pen.strokeStyle = ink.surface;
    pen.beginPath();
    pen.arc(x, 6, 5, 0, 2 * Math.PI);
    pen.fill();
    pen.stroke();
    pen.fillStyle = ink.muted;
    if (computed > position) pen.fillRect(this.axis.x(computed) - 0.5, 12, 1, bottom - 12);
  }
}

/**
 * Where frames lie along x.
 *
 * @param {number} width Of the whole scrubber, px.
 * @param {number} count Of the frames.
 */
export function axisOf(width, count) {
  const [frames, room] = [Math.max(2, count), Math.max(1, width - GUTTER - MARGIN)];
  const unit = plainAxis({ low: 0, high: frames - 1 });
  /** @type {Scale} */
  const scale = scales({ x: unit, y: unit }, { left: GUTTER, top: 0, width: room, height: 1 }).x;
  return {
    left: GUTTER,
    width: room,
    frames,
    scale,
    x: (/** @type {number} */ frame) => scale.at(frame),
    frame: (/** @type {number} */ x) => Math.min(Math.max(0, Math.round(scale.value(x))), frames - 1),
  };
}

/**
 * Where the rows stand that there is something for. The room of the others is for the first curve, or for the row of marks.
 *
 * @param {readonly RowName[]} missing Rows that nothing is known for.
 * @param {number} height Of all rows.
 * @returns {Rows}
 */
export function rowsWithout(missing, height) {
  const least = (/** @type {RowName[]} */ rows) => rows.reduce((sum, name) => sum + ROWS[name][1] + ROWS[name][2], 0);
  let names = /** @type {RowName[]} */ (Object.keys(ROWS)).filter((name) => !missing.includes(name));
  for (const name of DISPENSABLE) if (least(names) - GIVEN > height) names = names.filter((other) => other !== name);
  const spare = height - least(names);
  const widened = names.find((name) => name === "error" || name === "sigma");
  /** @type {Rows} */
  const rows = {};
  let top = 0;
  for (const name of names) {
    const [label, own, free] = ROWS[name];
    const tall = own + (name === widened ? spare : 0);
    rows[name] = [label, top, tall];
    top += tall + free;
  }
  return rows;
}

/**
 * The largest value of each pixel, so that no peak is lost in a run longer than there are pixels; the smallest as well would
 * take four times as long.
 *
 * @param {readonly number[]} values A frame each; NaN where there is none.
 * @param {number} width px
 */
function peaks(values, width) {
  const bucket = bucketOf(values.length, width);
  /** @type {{x: number[], y: number[]}} */
  const found = { x: [], y: [] };
  for (let frame = 0; frame < values.length; frame += bucket) {
    let largest = -Infinity;
    const end = Math.min(frame + bucket, values.length);
    for (let place = frame; place < end; place += 1) if (values[place] > largest) largest = values[place];
    found.x.push(frame);
    found.y.push(largest === -Infinity ? NaN : largest);
  }
  return found;
}

/**
 * How many frames are drawn as one.
 *
 * @param {number} frames
 * @param {number} width px
 */
function bucketOf(frames, width) {
  return Math.max(1, Math.floor(frames / width));
}

/**
 * @param {string} ink
 * @param {number} width
 * @param {Pick<Segments, "x0"|"y0"|"x1"|"y1">} ends
 * @param {number[]} opacity
 * @returns {Segments}
 */
function segments(ink, width, ends, opacity) {
  return { kind: "segments", title: "", name: "", ink, width, opacity, ...ends };
}
