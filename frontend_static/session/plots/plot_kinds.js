/** The kinds of plots that an experiment can declare, each a figure of what a session's store holds. */

import { Figure, Lines } from "./figure.js";
import { smallestSpan, unitOf } from "../../shared/format.js";
import { curve, isGone, shares, valueOf } from "../history.js";

const DASHES = [4, 3];
/** Within its row a feature's line leaves this free above and below. */
const FREE = 0.12;

/** One line a branch: the first of the values, functions of a row. The axis reaches to all of them. */
class Curve extends Figure {
  constructor(Bokeh, frames, plot, values) {
    super(Bokeh, frames);
    const [first] = Object.keys(values);
    this.lines = new Lines(
      this,
      (history, from) => columns(history, from, values),
      (source, branch) => ({ all: [this.line(source, first, { name: `${plot.id} ${branch.id}` })] }),
    );
  }

  draw(store) {
    super.draw(store);
    this.lines.draw(store);
  }
}

class ErrorPlot extends Curve {
  constructor(Bokeh, frames, plot) {
    super(Bokeh, frames, plot, { error: curve.error });
    this.shade("hidden", 0.2, (row) => row?.hidden === true);
    this.shade("lost", 0.16, isGone);
  }

  draw(store) {
    super.draw(store);
    this.reach(Math.max(smallestSpan(unitOf(store.session)), this.lines.most));
  }
}

class SigmaPlot extends Curve {
  #gamma;

  constructor(Bokeh, frames, plot) {
    super(Bokeh, frames, plot, { sigma: curve.sigma });
    this.#gamma = this.line(this.source({ frame: [], value: [] }), "value", { line_dash: "dashed", line_width: 1.2 });
  }

  dress(ink, sparkline) {
    super.dress(ink, sparkline);
    this.#gamma.glyph.line_color = ink.ink;
  }

  draw(store) {
    super.draw(store);
    const { session } = store;
    const source = this.#gamma.data_source;
    const data = staircase(session.thresholds, session.frames - 1);
    if (JSON.stringify(data) !== JSON.stringify(source.data)) source.data = data;
    const levels = data.value.filter(Number.isFinite);
    this.reach(Math.max(smallestSpan(unitOf(session)), this.lines.most, ...levels));
  }
}

class SampleSizePlot extends Curve {
  constructor(Bokeh, frames, plot) {
    super(Bokeh, frames, plot, { ess: curve.ess, particles: curve.particles });
  }

  draw(store) {
    super.draw(store);
    this.reach(Math.max(1, this.lines.most));
  }
}

class ProposalsPlot extends Figure {
  #lines;

  constructor(Bokeh, frames) {
    super(Bokeh, frames);
    const make = (source) => ({
      active: [
        this.area(source, { value: 0 }, { field: "prediction" }, { fill_color: this.ink.prediction }),
        this.area(source, { field: "prediction" }, { field: "particles" }, { fill_color: this.ink.observation }),
      ],
    });
    this.#lines = new Lines(this, stairs, make);
  }

  draw(store) {
    super.draw(store);
    this.#lines.draw(store);
    this.range.end = Math.max(1, this.#lines.most);
  }
}

class BandPlot extends Figure {
  #lines;

  constructor(Bokeh, frames, plot) {
    super(Bokeh, frames, { ticks: [0] });
    const [name] = plot.series;
    const value = (row) => valueOf(row, name);
    const sd = (row) => valueOf(row, plot.sd);
    const values = {
      value,
      truth: (row) => valueOf(row, plot.truth),
      low: (row) => value(row) - 2 * sd(row),
      high: (row) => value(row) + 2 * sd(row),
    };
    const make = (source, branch) => ({
      active: [
        this.area(source, { field: "low" }, { field: "high" }, { fill_alpha: 0.22, tags: ["branch"] }),
        this.line(source, "truth", { line_color: this.ink.truth, line_dash: DASHES, line_width: 1.2, tags: ["truth"] }),
      ],
      all: [this.line(source, "value", { name: `${plot.id} ${branch.id}` })],
    });
    // The band may be as wide as it likes; the axis follows what is estimated and what is true.
    this.#lines = new Lines(this, (history, from) => columns(history, from, values), make, ["value", "truth"]);
    this.shade("lost", 0.16, isGone);
  }

  dress(ink, sparkline) {
    super.dress(ink, sparkline);
    for (const one of this.#lines.ofActive) if (one.tags.includes("truth")) one.glyph.line_color = ink.truth;
  }

  draw(store) {
    super.draw(store);
    this.#lines.draw(store);
    this.reach(Math.max(smallestSpan(unitOf(store.session)), this.#lines.most), { both: true });
  }
}

class SharePlot extends Figure {
  #lines;
  #levels;

  constructor(Bokeh, frames, plot) {
    const levels = plot.levels.map((level) => 100 * level);
    super(Bokeh, frames, { ticks: [0, ...levels] });
    this.range.end = 105;
    this.#levels = levels.map((level) => this.level(level));
    const percent = (history, from) => {
      const data = { frame: [] };
      for (const name of plot.series) data[name] = shares(history, name).slice(from).map((share) => 100 * share);
      for (let frame = from; frame < history.length; frame += 1) data.frame.push(frame);
      return data;
    };
    const make = (source, branch) => ({
      all: plot.series.map((name) => this.line(source, name, { name: `${plot.id} ${branch.id} ${name}` })),
    });
    this.#lines = new Lines(this, percent, make);
  }

  dress(ink, sparkline) {
    super.dress(ink, sparkline);
    for (const level of this.#levels) level.line_color = ink.truth;
  }

  draw(store) {
    super.draw(store);
    this.#lines.draw(store);
  }
}

/** A row a feature, each from 0 at its bottom to 1 at its top; of the active branch alone. */
class FeaturesPlot extends Figure {
  #height;
  #lines;
  #rows;
  #seen = {};

  constructor(Bokeh, frames, plot, { features }) {
    super(Bokeh, frames, { ticks: features.map((_, place) => place + 0.5) });
    const [yaxis] = this.model.yaxes;
    yaxis.major_label_overrides = new Map(features.map((name, place) => [place + 0.5, name]));
    yaxis.major_tick_out = 0;
    this.model.ygrid.ticker = new Bokeh.FixedTicker({ ticks: features.map((_, place) => place) });
    this.rows = features.length;
    [this.range.start, this.range.end] = [features.length, 0];
    this.#height = (row, place) => place + 1 - FREE - (1 - 2 * FREE) * valueOf(row, plot.series[0], place);
    // One glyph for all rows: eleven take BokehJS three times as long.
    const source = this.source({ xs: [], ys: [] });
    this.#lines = this.model.multi_line({ field: "xs" }, { field: "ys" }, { source, line_width: 1.5, line_join: "round", name: plot.id });
    const seen = (row, place) => valueOf(row, plot.visible, place);
    this.shade("hidden", 0.2, (row, place) => seen(row, place) === 0, features.length);
    // Where the truth is unknown the tracker's own account has to do; it is not the same, so neither is the colour.
    const missed = (row, place) => Number.isNaN(seen(row, place)) && valueOf(row, plot.recognised, place) === 0;
    this.shade("lost", 0.16, missed, features.length);
  }

  draw(store) {
    super.draw(store);
    const { history, activeBranch: branch } = store;
    const { id, edition, length } = this.#seen;
    if (id !== branch.id) this.#lines.glyph.line_color = branch.colour;
    const grown = id === branch.id && edition === history.edition && length <= history.length;
    if (grown && length === history.length) return;
    if (!grown) this.#rows = Array.from({ length: this.rows }, () => []);
    for (let frame = grown ? length : 0; frame < history.length; frame += 1) {
      this.#rows.forEach((row, place) => row.push(this.#height(history.at(frame), place)));
    }
    this.#seen = { id: branch.id, edition: history.edition, length: history.length };
    const frames = [...this.#rows[0].keys()];
    this.#lines.data_source.data = { xs: this.#rows.map(() => frames), ys: this.#rows.map((row) => row.slice()) };
  }
}

/** The figure of each kind. */
export const KINDS = {
  error: ErrorPlot,
  sigma: SigmaPlot,
  "sample size": SampleSizePlot,
  proposals: ProposalsPlot,
  band: BandPlot,
  features: FeaturesPlot,
  share: SharePlot,
};

/** The data of the frames from one on, a column for each function of a row. */
function columns(history, from, values) {
  const data = { frame: [] };
  for (let frame = from; frame < history.length; frame += 1) data.frame.push(frame);
  for (const [name, value] of Object.entries(values)) data[name] = data.frame.map((frame) => value(history.at(frame)) ?? NaN);
  return data;
}

/** How many particles came from where, each frame as wide as it is. */
function stairs(history, from) {
  const data = { frame: [], prediction: [], particles: [] };
  for (let frame = from; frame < history.length; frame += 1) {
    const row = history.at(frame);
    const [prediction, particles] = [curve.prediction(row), curve.particles(row)];
    data.frame.push(frame - 0.5, frame + 0.5);
    data.prediction.push(prediction, prediction);
    data.particles.push(particles, particles);
  }
  return data;
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
