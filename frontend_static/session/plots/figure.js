/**
 * What all plots have in common: a figure of BokehJS over the shared axis of frames, with a line at the frame that is
 * shown; the lines of branches in it, and its shades.
 */

const BORDER = 38;

export class Figure {
  /** How many rows it has, one above the other. */
  rows = 1;
  /** Whether the numbers of the frames stand below it. */
  showsFrames = false;
  #bokeh;
  #here;
  #shades = [];

  /**
   * @param {object} Bokeh
   * @param {object} frames The range of frames, shared by all.
   * @param {object} more Properties of the y axis' ticker.
   */
  constructor(Bokeh, frames, more = { desired_num_ticks: 2 }) {
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
        major_label_text_font_size: "11px",
        major_label_standoff: 3,
      });
    }
    if (more.ticks) yaxis.ticker = this.model.ygrid.ticker = new Bokeh.FixedTicker(more);
    else Object.assign(yaxis.ticker, more);
    this.model.xgrid.visible = false;
  }

  source(data) {
    return new this.#bokeh.ColumnDataSource({ data });
  }

  /** A dashed line from end to end at a height. */
  level(location) {
    const span = new this.#bokeh.Span({ location, dimension: "width", line_width: 1, line_dash: [4, 3] });
    this.model.add_layout(span);
    return span;
  }

  /** Shade the frames in which something holds; of rows, each apart. */
  shade(token, opacity, test, rows = 1) {
    this.#shades.push(new Shades(this, token, opacity, test, rows));
  }

  line(source, field, more) {
    return this.model.line({ field: "frame" }, { field }, { source, line_join: "round", ...more });
  }

  /** From (frame, y0) to (x1, y1) each, as opaque as each says. */
  segments(source, more) {
    const [x0, y0, x1, y1, alpha] = ["frame", "y0", "x1", "y1", "alpha"].map((field) => ({ field }));
    return this.model.segment(x0, y0, x1, y1, { source, line_alpha: alpha, line_width: 1.8, ...more });
  }

  /** Not varea_step: BokehJS 3.9 paints an empty one for ever. */
  area(source, low, high, more) {
    return this.model.varea({ field: "frame" }, low, high, { source, ...more });
  }

  /** Colours and, in a narrow window, no axes: the plots are sparklines then. */
  dress(ink, sparkline) {
    const { model } = this;
    this.ink = ink;
    // One width of border for all, so that a frame lies at one place in all of them.
    model.min_border_left = sparkline ? 2 : BORDER;
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

  draw(store) {
    const { position } = store.session;
    if (this.#here.location !== position) this.#here.location = position;
    for (const shade of this.#shades) shade.draw(store);
  }

  /** Limits that reach a value, on both sides of 0 if need be; rounded, so that they change seldom and nothing jumps. */
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
   * @param {number[]} extent The smallest and the largest value.
   * @param {number} smallest
   */
  enclose([low, high], smallest) {
    if (low > high) return;
    const span = Math.max(high - low, smallest);
    const step = 10 ** Math.floor(Math.log10(span / 2));
    const [start, end] = [Math.floor(low / step) * step, Math.ceil(high / step) * step];
    if (this.range.start === start && this.range.end === end) return;
    [this.range.start, this.range.end] = [start, Math.max(end, start + step)];
  }
}

/** The lines of the branches in a figure. Of a history that has only grown the new frames alone are handed over. */
export class Lines {
  #figure;
  #columns;
  #make;
  #limits;
  #drawn = new Map();

  /**
   * @param {Figure} figure
   * @param {(history: object, from: number) => object} columns The data of the frames from one on.
   * @param {(source: object, branch: object) => {all?: object[], active?: object[]}} make Draws the glyphs of a branch:
   *     those that are seen of all branches, and those of the active one alone. The lines of all, and glyphs tagged
   *     "branch", have the branch's colour.
   * @param {string[]|null} limits The columns that `most` is the largest of; all if not given.
   */
  constructor(figure, columns, make, limits = null) {
    this.#figure = figure;
    this.#columns = columns;
    this.#make = make;
    this.#limits = limits;
  }

  draw(store) {
    const shown = new Map(store.branches.map((branch) => [branch.id, branch]));
    for (const branch of shown.values()) this.#branch(branch, store.historyOf(branch.id), branch.id === store.session.branch);
    for (const [id, line] of this.#drawn) {
      if (!shown.has(id)) for (const glyph of [...line.all, ...line.active]) glyph.visible = false;
    }
  }

  /** The largest of what is drawn, the sign apart; 0 where there is nothing. */
  get most() {
    return Math.max(0, ...this.extent.filter(Number.isFinite).map(Math.abs));
  }

  /** The smallest and the largest of what is drawn; the wrong way round where there is nothing. */
  get extent() {
    const drawn = [...this.#drawn.values()];
    return [Math.min(...drawn.map(({ low }) => low)), Math.max(...drawn.map(({ high }) => high))];
  }

  /** What is drawn of the active branch alone. */
  get ofActive() {
    return [...this.#drawn.values()].flatMap((line) => line.active);
  }

  #branch(branch, history, active) {
    if (!this.#drawn.has(branch.id)) {
      const source = this.#figure.source(this.#columns(history, history.length));
      this.#drawn.set(branch.id, { source, all: [], active: [], ...this.#make(source, branch), edition: -1, length: 0, low: Infinity, high: -Infinity });
    }
    const line = this.#drawn.get(branch.id);
    // BokehJS takes every assignment for a change, and draws again.
    if (line.isActive !== active) {
      line.isActive = active;
      for (const one of line.active) one.visible = active;
      for (const one of line.all) {
        one.glyph.line_width = active ? 1.8 : 1.2;
        // The active branch lies above the others, which share its past.
        one.level = active ? "guide" : "glyph";
      }
    }
    if (line.colour !== branch.colour) {
      line.colour = branch.colour;
      for (const one of line.all) one.glyph.line_color = branch.colour;
      for (const one of line.active) if (one.tags.includes("branch")) tint(one.glyph, branch.colour);
    }
    if (!active && line.all.length === 0) return;
    this.#feed(line, history);
  }

  #feed(line, history) {
    const whole = line.edition !== history.edition || history.length < line.length;
    if (!whole && history.length === line.length) return;
    const data = this.#columns(history, whole ? 0 : line.length);
    const [low, high] = extent(data, this.#limits);
    [line.low, line.high] = whole ? [low, high] : [Math.min(line.low, low), Math.max(line.high, high)];
    if (whole) line.source.data = data;
    else line.source.stream(data);
    [line.edition, line.length] = [history.edition, history.length];
  }
}

/** Shades of the intervals in which something held, of the active branch. */
class Shades {
  #source;
  #test;
  /** @type {string|null} */
  #seen = null;

  /**
   * @param {Figure} figure
   * @param {string} token Name of its colour.
   * @param {number} opacity
   * @param {(row: object, place: number) => boolean} test Of a frame and, where there are rows, one of them.
   * @param {number} rows How many rows are shaded apart.
   */
  constructor(figure, token, opacity, test, rows = 1) {
    this.#source = figure.source({ left: [], right: [], top: [], bottom: [] });
    this.#test = test;
    this.token = token;
    this.rows = rows;
    const [left, right, top, bottom] = ["left", "right", "top", "bottom"].map((field) => ({ field }));
    const more = { source: this.#source, fill_alpha: opacity, line_color: null, level: "underlay" };
    this.renderer = rows > 1 ? figure.model.quad({ left, right, top, bottom, ...more }) : figure.model.vstrip(left, right, more);
  }

  draw({ session, history }) {
    const seen = `${session.branch} ${history.edition} ${history.length}`;
    if (seen === this.#seen) return;
    this.#seen = seen;
    /** @type {Record<"left"|"right"|"top"|"bottom", number[]>} */
    const data = { left: [], right: [], top: [], bottom: [] };
    for (let place = 0; place < this.rows; place += 1) {
      for (const [first, last] of history.spans((row) => this.#test(row, place))) {
        data.left.push(first - 0.5);
        data.right.push(last + 0.5);
        data.top.push(place);
        data.bottom.push(place + 1);
      }
    }
    // Most frames begin and end nothing, but for the interval that is under way.
    if (JSON.stringify(data) !== JSON.stringify(this.#source.data)) this.#source.data = data;
  }
}

/** The smallest and the largest number of some columns; of all but the frames if none are named. */
function extent({ frame, ...data }, limits) {
  let [low, high] = [Infinity, -Infinity];
  for (const name of limits ?? Object.keys(data)) {
    for (const value of data[name]) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return [low, high];
}

/** Give an area or a line its colour. */
function tint(glyph, colour) {
  if ("fill_color" in glyph) glyph.fill_color = colour;
  else glyph.line_color = colour;
}
