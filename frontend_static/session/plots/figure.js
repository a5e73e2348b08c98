/**
 * What all plots have in common: a figure of BokehJS over the shared axis of frames, with a line at the frame that is
 * shown, and its shades.
 */

import { Shades } from "./shades.js";

/** @import { Store } from "../store.js" */
/** @import { BokehApi, Data, Look, Range, Source } from "./bokeh_api.js" */
/** @import { Test } from "./shades.js" */

/** @typedef {Record<string, string>} Ink Colours by token. */
/** @typedef {{desired_num_ticks: number}|{ticks: number[]}} Ticks How many, or where they are. */

const BORDER = 38;
const ROOMY_BORDER = 150;

export class Figure {
  /** How many rows it has, one above the other. */
  rows = 1;
  /** Whether the numbers of the frames stand below it. */
  showsFrames = false;
  /** Whether there is room for names that are written out. */
  isRoomy = false;
  #bokeh;
  #here;
  /** @type {Shades[]} */
  #shades = [];
  /**
   * The colours, once they are known.
   *
   * @type {Ink}
   */
  ink = {};

  /**
   * @param {BokehApi} Bokeh
   * @param {Range} frames The range of frames, shared by all.
   * @param {Ticks} ticks Of the y axis.
   */
  constructor(Bokeh, frames, ticks = { desired_num_ticks: 2 }) {
    this.#bokeh = Bokeh;
    this.range = new Bokeh.Range1d({ start: 0, end: 1 });
    this.model = Bokeh.Plotting.figure({
      sizing_mode: "stretch_both",
      x_range: frames,
      y_range: this.range,
      tools: "",
      toolbar_location: null,
      min_border: 8,
      outline_line_color: null,
      background_fill_color: null,
      border_fill_color: null,
    });
    this.#here = new Bokeh.Span({ location: 0, dimension: "height", line_width: 1 });
    this.model.add_layout(this.#here);
    const [yaxis] = this.model.yaxes;
    for (const axis of [...this.model.xaxes, yaxis]) {
      Object.assign(axis, {
        minor_tick_line_color: null,
        axis_line_color: null,
        major_tick_in: 0,
        major_tick_out: 3,
        major_label_text_font: "system-ui, sans-serif",
        major_label_text_font_size: "0.6875rem",
        major_label_standoff: 3,
      });
    }
    if ("ticks" in ticks) yaxis.ticker = this.model.ygrid.ticker = new Bokeh.FixedTicker(ticks);
    else Object.assign(yaxis.ticker, ticks);
    this.model.xgrid.visible = false;
  }

  /** @param {Data} data */
  source(data) {
    return new this.#bokeh.ColumnDataSource({ data });
  }

  /**
   * A dashed line from end to end at a height.
   *
   * @param {number} location
   */
  level(location) {
    const span = new this.#bokeh.Span({ location, dimension: "width", line_width: 1, line_dash: [4, 3] });
    this.model.add_layout(span);
    return span;
  }

  /**
   * Shade the frames in which something holds; of rows, each apart.
   *
   * @param {string} token
   * @param {number} opacity
   * @param {Test} test
   * @param {number} [rows]
   */
  shade(token, opacity, test, rows = 1) {
    this.#shades.push(new Shades(this, token, opacity, test, rows));
  }

  /**
   * @param {Source} source
   * @param {string} field
   * @param {Look} look
   */
  line(source, field, look) {
    return this.model.line({ field: "frame" }, { field }, { source, line_join: "round", ...look });
  }

  /**
   * From (frame, y0) to (x1, y1) each, as opaque as each says.
   *
   * @param {Source} source
   * @param {Look} look
   */
  segments(source, look) {
    const [x0, y0, x1, y1, alpha] = ["frame", "y0", "x1", "y1", "alpha"].map((field) => ({ field }));
    return this.model.segment(x0, y0, x1, y1, { source, line_alpha: alpha, line_width: 1.8, ...look });
  }

  /**
   * Between two columns. Not varea_step: BokehJS 3.9 paints an empty one for ever.
   *
   * @param {Source} source
   * @param {string} low
   * @param {string} high
   * @param {Look} look
   */
  area(source, low, high, look) {
    return this.model.varea({ field: "frame" }, { field: low }, { field: high }, { source, ...look });
  }

  /**
   * Colours and, in a narrow window, no axes: the plots are sparklines then.
   *
   * @param {Ink} ink
   * @param {boolean} sparkline
   */
  dress(ink, sparkline) {
    const { model } = this;
    this.ink = ink;
    // One width of border for all, so that a frame lies at one place in all of them.
    const border = this.isRoomy ? ROOMY_BORDER : BORDER;
    model.min_border_left = sparkline ? 2 : border;
    model.min_border_right = sparkline ? 2 : 8;
    model.xaxis.visible = !sparkline && this.showsFrames;
    model.yaxis.visible = !sparkline;
    model.ygrid.visible = !sparkline;
    model.ygrid.grid_line_color = ink.line;
    for (const axis of [model.xaxis, model.yaxis]) {
      axis.major_label_text_color = ink.muted;
      axis.major_tick_line_color = ink.line;
    }
    this.#here.line_color = ink.muted;
    for (const shade of this.#shades) shade.renderer.glyph.fill_color = ink[shade.token];
  }

  /** @param {Store} store */
  draw(store) {
    const { position } = store.known;
    if (this.#here.location !== position) this.#here.location = position;
    for (const shade of this.#shades) shade.draw(store);
  }

  /**
   * Limits that reach a value, on both sides of 0 if need be; rounded, so that they change seldom and nothing jumps.
   *
   * @param {number} most
   * @param {{both?: boolean}} [options]
   */
  reach(most, { both = false } = {}) {
    const value = most * 1.05;
    const power = 10 ** Math.floor(Math.log10(value));
    const end = power * ([1, 1.5, 2, 3, 4, 5, 7.5, 10].find((step) => step * power >= value) ?? value / power);
    if (this.range.end === end) return;
    [this.range.start, this.range.end] = [both ? -end : 0, end];
    if (both) this.model.yaxes[0].ticker.ticks = this.model.ygrids[0].ticker.ticks = [-end, 0, end];
  }

  /**
   * Limits around values that may lie far from 0; rounded in the same way.
   *
   * @param {[number, number]} extent The smallest and the largest value.
   * @param {number} smallest How far they are apart at least.
   */
  enclose([low, high], smallest) {
    if (low > high) return;
    const span = Math.max(high - low, smallest);
    const step = 10 ** Math.floor(Math.log10(span / 2));
    const start = Math.floor(low / step) * step;
    const end = Math.max(Math.ceil(high / step) * step, start + smallest);
    if (this.range.start === start && this.range.end === end) return;
    [this.range.start, this.range.end] = [start, end];
  }
}
