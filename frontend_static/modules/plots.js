/**
 * The live plots, drawn by BokehJS: error, sigma against gamma, ESS and proposals over one shared axis of frames. Each
 * branch is a line in its colour. Data comes in about ten times a second at the most.
 */

import { loadBokeh } from "./bokeh.js";
import { h, setText } from "./dom.js";
import { number, quantity, smallestSpan, unitOf } from "./format.js";
import { curve } from "./history.js";
import { after, idle, throttle } from "./pace.js";
import { onTheme, tokens } from "./theme.js";
import { thresholds } from "./timeline.js";

const REDRAW_MS = 100;
const PATIENCE_MS = 8000;
const BORDER = 38;
const INKS = ["ink", "muted", "line", "lost", "hidden", "prediction", "observation"];

/**
 * @param {HTMLElement} root
 * @param {import("./store.js").Store} store
 * @param {Promise<void>} picture Resolves when the scene is drawn: it goes first, then come the plots, into the place
 *     that is kept for them.
 */
export async function plots(root, store, picture) {
  const panels = {
    error: panel(root, "error"),
    sigma: panel(root, "sigma | gamma"),
    ess: panel(root, "ESS"),
    proposals: panel(root, key("prediction"), " ", key("observation")),
  };
  const labels = throttle(() => label(panels, store), REDRAW_MS);
  store.on("session position history branches", labels);

  await Promise.race([picture, after(PATIENCE_MS)]);
  if (store.session === null) await new Promise((resolve) => store.on("session", resolve));
  await idle();
  let Bokeh;
  try {
    Bokeh = await loadBokeh();
  } catch {
    root.append(h("p", { class: "hint" }, "The plots could not be loaded; the scrubber below shows the same curves."));
    return;
  }
  Bokeh.set_log_level("error");
  const book = new Book(Bokeh, panels);
  await book.show();
  const draw = throttle(() => {
    if (store.session !== null && !document.hidden) book.draw(store);
  }, REDRAW_MS);
  store.on("session position history branches", draw);
  document.addEventListener("visibilitychange", draw);
  const narrow = matchMedia("(max-width: 999px)");
  narrow.addEventListener("change", () => book.dress(narrow.matches));
  onTheme(() => book.dress(narrow.matches));
  book.dress(narrow.matches);
  draw();
}

function panel(root, ...title) {
  const value = h("output", {});
  const heading = h("span", {}, title);
  const plot = h("div", { class: "plot", role: "img", "aria-label": `${heading.textContent} over frames` });
  root.append(h("section", { class: "panel" }, h("h2", {}, heading, value), plot));
  return { heading, value, plot };
}

/** A word with the colour that it has in the plot. */
function key(name) {
  const swatch = h("span", { class: "key" });
  swatch.style.background = `var(--${name})`;
  return h("span", {}, swatch, name);
}

function label(panels, store) {
  const session = store.session;
  if (session === null) return;
  const row = store.history.at(session.position);
  const unit = unitOf(session);
  const gamma = thresholds(session)
    .map(({ steps }) => steps.filter(({ frame }) => frame <= session.position).at(-1)?.value)
    .filter((value) => typeof value === "number");
  setText(panels.error.heading, `error ${unit}`.trim());
  setText(panels.sigma.heading, `sigma${gamma.length > 0 ? " | gamma" : ""} ${unit}`.trim());
  setText(panels.error.value, quantity(curve.error(row), unit));
  setText(panels.sigma.value, [curve.sigma(row), ...gamma].map((value) => quantity(value, unit)).join(" | "));
  const particles = curve.prediction(row) + curve.observation(row);
  setText(panels.ess.value, particles > 0 ? `${number(curve.ess(row), 0)} of ${particles}` : number(null));
  setText(panels.proposals.value, particles > 0 ? `${curve.prediction(row)} | ${curve.observation(row)}` : number(null));
}

/** The four figures and their data. */
class Book {
  #bokeh;
  #figures = {};
  #ranges = {};
  #x;
  #lines = new Map();
  #gamma;
  #strip;
  #bands;
  #here = [];
  #seen = null;

  constructor(Bokeh, panels) {
    this.#bokeh = Bokeh;
    this.#panels = panels;
    this.#x = new Bokeh.Range1d({ start: 0, end: 1 });
    for (const name of Object.keys(panels)) this.#figures[name] = this.#figure(name);
    this.#bands = { hidden: this.#source({ x0: [], x1: [] }), lost: this.#source({ x0: [], x1: [] }) };
    this.#gamma = this.#source({ frame: [], value: [] });
    this.#strip = this.#source({ frame: [], prediction: [], total: [] });
    const { error, sigma, proposals } = this.#figures;
    const strip = (source, alpha) => error.vstrip({ field: "x0" }, { field: "x1" }, { source, fill_alpha: alpha, line_color: null });
    this.#glyphs.hidden = strip(this.#bands.hidden, 0.2);
    this.#glyphs.lost = strip(this.#bands.lost, 0.16);
    this.#glyphs.gamma = sigma.line({ field: "frame" }, { field: "value" }, { source: this.#gamma, line_dash: "dashed", line_width: 1.2 });
    // Not varea_step: BokehJS 3.9 paints an empty one for ever.
    const layer = (y1, y2) => proposals.varea({ field: "frame" }, y1, y2, { source: this.#strip });
    this.#glyphs.prediction = layer({ value: 0 }, { field: "prediction" });
    this.#glyphs.observation = layer({ field: "prediction" }, { field: "total" });
  }

  #panels;
  #glyphs = {};

  #source(data) {
    return new this.#bokeh.ColumnDataSource({ data });
  }

  #figure(name) {
    const { Plotting, Range1d, Span } = this.#bokeh;
    this.#ranges[name] = new Range1d({ start: 0, end: 1 });
    const figure = Plotting.figure({
      sizing_mode: "stretch_both",
      x_range: this.#x,
      y_range: this.#ranges[name],
      tools: "",
      toolbar_location: null,
      min_border: 8,
      outline_line_color: null,
      background_fill_color: null,
      border_fill_color: null,
    });
    const here = new Span({ location: 0, dimension: "height", line_width: 1 });
    figure.add_layout(here);
    this.#here.push(here);
    for (const axis of [...figure.xaxes, ...figure.yaxes]) {
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
    for (const axis of figure.yaxes) axis.ticker.desired_num_ticks = name === "proposals" ? 2 : 3;
    figure.xgrid.visible = false;
    return figure;
  }

  async show() {
    // One document, since the figures share their axis of frames; each figure in its own panel.
    const book = new this.#bokeh.Document();
    for (const figure of Object.values(this.#figures)) book.add_root(figure);
    const places = Object.keys(this.#figures).map((name) => this.#panels[name].plot);
    await this.#bokeh.embed.add_document_standalone(book, document.body, places);
  }

  /** Colours and, in a narrow window, no axes: the plots are sparklines then. */
  dress(sparkline) {
    const ink = tokens(...INKS);
    for (const [name, figure] of Object.entries(this.#figures)) {
      // One width of border for all, so that a frame lies at one place in all of them.
      figure.min_border_left = sparkline ? 2 : BORDER;
      figure.min_border_right = sparkline ? 2 : 8;
      figure.xaxis.visible = !sparkline && name === "proposals";
      figure.yaxis.visible = !sparkline;
      figure.ygrid.visible = !sparkline;
      figure.ygrid.grid_line_color = ink.line;
      for (const axis of [figure.xaxis, figure.yaxis]) {
        axis.major_label_text_color = ink.muted;
        axis.major_tick_line_color = ink.line;
      }
    }
    for (const span of this.#here) span.line_color = ink.muted;
    for (const name of ["hidden", "lost", "prediction", "observation"]) this.#glyphs[name].glyph.fill_color = ink[name];
    this.#glyphs.gamma.glyph.line_color = ink.ink;
  }

  draw(store) {
    const { session } = store;
    this.#x.end = Math.max(1, session.frames - 1);
    for (const span of this.#here) span.location = session.position;
    for (const branch of store.branches) this.#branch(branch, store.historyOf(branch.id), branch.id === session.branch);
    for (const [id, line] of this.#lines) {
      if (!store.branches.some((branch) => branch.id === id)) for (const one of line.glyphs) one.visible = false;
    }
    this.#active(store.history, session);
    const all = store.branches.map((branch) => store.historyOf(branch.id));
    const most = (value) => Math.max(0, ...all.map((history) => history.most(value) ?? 0));
    const smallest = smallestSpan(unitOf(session));
    this.#grow("error", Math.max(smallest, most(curve.error)));
    this.#grow("sigma", Math.max(smallest, most(curve.sigma), ...this.#gamma.data.value.filter(Number.isFinite)));
    this.#grow("ess", Math.max(most(curve.ess), this.#ranges.proposals.end));
  }

  /** The lines of one branch. */
  #branch(branch, history, active) {
    if (!this.#lines.has(branch.id)) {
      const source = this.#source(columns(history, 0));
      const draw = (figure, field) =>
        figure.line({ field: "frame" }, { field }, { source, line_color: branch.colour, line_join: "round", name: `${field} ${branch.id}` });
      const glyphs = [draw(this.#figures.error, "error"), draw(this.#figures.sigma, "sigma"), draw(this.#figures.ess, "ess")];
      this.#lines.set(branch.id, { source, glyphs, edition: history.edition, length: history.length });
    }
    const line = this.#lines.get(branch.id);
    for (const one of line.glyphs) {
      const [width, level] = active ? [1.8, "guide"] : [1.2, "glyph"];
      if (one.glyph.line_width !== width) one.glyph.line_width = width;
      // The active branch lies above the others, which share its past.
      if (one.level !== level) one.level = level;
    }
    if (line.edition !== history.edition || history.length < line.length) line.source.data = columns(history, 0);
    else if (history.length > line.length) line.source.stream(columns(history, line.length));
    line.edition = history.edition;
    line.length = history.length;
  }

  /** What is drawn of the active branch alone. */
  #active(history, session) {
    const seen = `${session.branch} ${history.edition} ${history.length} ${JSON.stringify(session.timeline)} ${JSON.stringify(session.parameters)}`;
    if (seen === this.#seen) return;
    this.#seen = seen;
    this.#bands.hidden.data = strips(history, (row) => row?.hidden === true);
    this.#bands.lost.data = strips(history, (row) => row?.lost === true);
    this.#gamma.data = staircase(thresholds(session), session.frames - 1);
    const frame = [];
    const prediction = [];
    const total = [];
    for (let index = 0; index < history.length; index += 1) {
      const row = history.at(index);
      const [first, both] = [curve.prediction(row), curve.prediction(row) + curve.observation(row)];
      frame.push(index - 0.5, index + 0.5);
      prediction.push(first, first);
      total.push(both, both);
    }
    this.#strip.data = { frame, prediction, total };
    this.#ranges.proposals.end = total.reduce((most, value) => Math.max(most, value), 1);
  }

  /** Round limits that change seldom, so that the picture stands still. */
  #grow(name, most) {
    const value = most * 1.05;
    const power = 10 ** Math.floor(Math.log10(value));
    const end = power * [1, 1.5, 2, 3, 4, 5, 7.5, 10].find((step) => step * power >= value);
    if (this.#ranges[name].end !== end) this.#ranges[name].end = end;
  }
}

function columns(history, from) {
  const data = { frame: [], error: [], sigma: [], ess: [] };
  for (let frame = from; frame < history.length; frame += 1) {
    const row = history.at(frame);
    data.frame.push(frame);
    data.error.push(curve.error(row) ?? NaN);
    data.sigma.push(curve.sigma(row) ?? NaN);
    data.ess.push(curve.ess(row) ?? NaN);
  }
  return data;
}

function strips(history, test) {
  const spans = history.spans(test);
  return { x0: spans.map(([first]) => first - 0.5), x1: spans.map(([, last]) => last + 0.5) };
}

function staircase(gammas, last) {
  const data = { frame: [], value: [] };
  for (const { steps } of gammas) {
    steps.forEach(({ frame, value }, index) => {
      data.frame.push(frame, steps[index + 1]?.frame ?? last);
      data.value.push(value ?? NaN, value ?? NaN);
    });
    data.frame.push(last);
    data.value.push(NaN);
  }
  return data;
}
