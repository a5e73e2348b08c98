/**
 * The kinds of plots that an experiment can declare: each draws a run over its frames as the traces of a figure, and sets the range of the
 y axis. */

import { written } from "../../shared/figure/axes.js";
import { lineOver, linksOver } from "../../shared/figure/kinds.js";
import { number, smallestSpan } from "../../shared/format.js";
import { declared as declaredIn, frequencies, hypothesesOf, numberOf, ofRole, samplers, samplesOf, valueOf } from "../readings.js";
import { steer } from "../steering.js";
import { curve, isGone } from "../store.js";
import { column, enclose, extent, reach, remembered, shades } from "./plots.js";

/** @import { Axis, Band, Nodes, Panel, Trace } from "../../shared/figure/traces.js" */
/** @import { Bands, Plot, SessionPublic } from "../../shared/messages.js" */
/** @import { View } from "../mount.js" */
/** @import { Role } from "../readings.js" */
/** @import { Curve, History, Row, Store } from "../store.js" */

/** The present content of a plot.
 *
 * @typedef {object} Shown
 * @property {Trace[]} traces From the back to the front.
 * @property {Pick<Axis, "low"|"high"|"ticks">} y
 * @property {Panel["handles"]} [handles] Handles of a parameter that is chosen in the plot, 1 the first.
 * @property {string} [words] Description of content that its lines do not name.
 */

/**
 * @typedef {object} Kind
 * @property {(store: Store, isRoomy: boolean) => Shown} show `isRoomy` if there is room for full names.
 * @property {string[]} [needs] Names of series; one must be measured. None by default.
 * @property {number} [rows] Number of its rows, one above the other.
 * @property {(view: View, frame: number, y: number) => void} [choose] Take the point that a person chose.
 */

/** @typedef {(plot: Plot, session: SessionPublic) => Kind} Make The plot's unit is the unit of drawing. */

/** Least opacity of an improbable line, and of a node, so that they stay visible. */
const [FAINTEST, FAINTEST_NODE] = [0.06, 0.12];
/** Free space above and below a line within its row. */
const FREE = 0.12;
/** Room at the top, so that a line at 100 % is visible. */
const HIGHEST = 105;
const [NODE_PX, RING_PX] = [8, 14];
const isLost = () => shades("lost", 0.16, isGone, { word: "lost" });
/** Remarks on the active branch's band, shown where the band is drawn. */
const DOUBTS = /** @type {Record<string, string>} */ ({ overconfident: "too narrow", underconfident: "too wide", uncalibrated: "not calibrated" });

/** @type {Make} */
function error(plot) {
  const [hidden, lost] = [shades("hidden", 0.2, (row) => row.hidden === true, { word: "hidden" }), isLost()];
  return {
    show(store) {
      const { ensemble: { value: ensemble }, history } = store;
      const traces = [hidden(history), lost(history), ...otherSeeds(ensemble, inkOf(store)), ...lines(plot, store, curve.error)];
      const others = (ensemble?.high ?? []).filter((value) => value !== null);
      return { traces, y: fromZero(store, [curve.error], smallestSpan(plot.unit), ...others) };
    },
  };
}

/** Runs with other seeds, where known: a band that contains most of them, and their median.
 *
 * @param {Bands|null} ensemble
 * @param {string} ink
 * @returns {Trace[]}
 */
function otherSeeds(ensemble, ink) {
  if (ensemble === null) return [];
  const [low, middle, high] = [ensemble.low, ensemble.middle, ensemble.high].map((values) => values.map((value) => value ?? NaN));
  const said = "median of other seeds";
  return [band("error of other seeds", ink, low, high), lineOver({ name: said, y: middle, ink, dashed: true, width: 1, said })];
}

/** @type {Make} */
function sigma(plot) {
  return {
    show(store) {
      const { traces, most: highest } = thresholdsOf(store.known);
      return { traces: [...lines(plot, store, curve.sigma), ...traces], y: fromZero(store, [curve.sigma], smallestSpan(plot.unit), highest) };
    },
  };
}

/** The thresholds of sigma as lines over the frames in which they apply, and the largest of them.
 *
 * @param {SessionPublic} session
 */
function thresholdsOf({ frames, thresholds, unit }) {
  const levels = thresholds.filter(({ of }) => of === "sigma").map(({ steps }) => steps);
  const traces = levels.map((steps) => {
    const x = steps.flatMap(({ frame }, index) => [frame, steps[index + 1]?.frame ?? frames - 1]);
    const y = steps.flatMap(({ value }) => [value ?? NaN, value ?? NaN]);
    return lineOver({ title: "threshold", name: "thresholds", x, y, ink: "ink", dashed: true, width: 1.2, said: "threshold", unit });
  });
  return { traces, most: Math.max(0, ...levels.flat().map(({ value }) => value ?? 0)) };
}

/** The effective number of particles, and the number of all.
 *
 * @type {Make}
 */
function sampleSize(plot, session) {
  const [ess, particles] = [readerOf(session, "ess"), readerOf(session, "particles")];
  return {
    needs: namesOf(session, "ess"),
    show: (store) => ({ traces: lines(plot, store, ess), y: fromZero(store, [ess, particles], 1) }),
  };
}

/** The innovations, with their limits.
 *
 * @type {Make}
 */
function innovation(plot, session) {
  const [nis, limit] = [readerOf(session, "nis"), readerOf(session, "nis_limit")];
  return {
    needs: namesOf(session, "nis"),
    show(store) {
      const beside = lineOver({ title: "limit", name: "limit", y: column(store.history, limit), ink: "ink", dashed: true, width: 1.2, said: "limit of 95 %" });
      return { traces: [beside, ...lines(plot, store, nis)], y: fromZero(store, [nis, limit], 1) };
    },
  };
}

/** One number per frame, which may be far from 0.
 *
 * @type {Make}
 */
function oneNumber(plot) {
  const { series, unit } = plot;
  const read = reader(series[0]);
  return {
    needs: series,
    show: (store) => ({ traces: lines(plot, store, read), y: enclose(range(store, [read]), smallestSpan(unit, most(store, [read]))) }),
  };
}

/** An estimated number with its band of two standard deviations, with 0 in the middle; and the truth.
 *
 * @type {Make}
 */
function withinBand(plot) {
  const { id, series, sd, unit } = plot;
  const [read, truth, lost] = [reader(series[0]), reader(plot.truth), isLost()];
  const [low, high] = [-2, 2].map((times) => (/** @type {Row|undefined} */ row) => valueOf(row, series[0]) + times * valueOf(row, sd));
  return {
    needs: series,
    show(store) {
      const { history, known } = store;
      const doubts = Object.keys(known.doubts).map((doubt) => DOUBTS[doubt]);
      const area = { ...band(`${id} band 0`, inkOf(store), column(history, low), column(history, high)), title: doubts.join(", ") };
      // The band may be wide; the axis follows the estimate and the truth.
      const end = reach(Math.max(smallestSpan(unit), most(store, [read, truth])));
      const y = { low: -end, high: end, ticks: [-end, 0, end].map((at) => ({ at, text: written(at) })) };
      const words = Object.values(known.doubts).join(" ");
      return { traces: [lost(history), area, trueLine(plot, store, truth), ...lines(plot, store, read)], y, words };
    },
  };
}

/** Intervals, and the truth.
 *
 * @type {Make}
 */
function interval(plot) {
  const { id, series, unit } = plot;
  const [truth, lost] = [reader(plot.truth), isLost()];
  const ends = series.map((name) => /** @type {const} */ ({ low: reader(name, 0), high: reader(name, 1) }));
  return {
    needs: series,
    show(store) {
      const { history } = store;
      const areas = ends.map(({ low, high }, place) => band(`${id} band ${place}`, inkOf(store), column(history, low), column(history, high)));
      const edges = ends.flatMap((each, place) =>
        /** @type {const} */ (["low", "high"]).flatMap((end) => lines(plot, store, each[end], ` ${end} ${place}`)),
      );
      const reads = [truth, ...ends.flatMap(({ low, high }) => [low, high])];
      return { traces: [lost(history), ...areas, trueLine(plot, store, truth), ...edges], y: enclose(range(store, reads), smallestSpan(unit)) };
    },
  };
}

/** A row per component of a vector, each from 0 at its bottom to 1 at its top; only for the active branch.
 *
 * @type {Make}
 */
function features(plot, session) {
  const { id, row_titles: titles, recognised, series, visible } = plot;
  const names = declaredIn(session, series[0])?.components ?? [];
  const reads = names.map((_, place) => reader(series[0], place));
  const seen = (/** @type {Row} */ row, /** @type {number} */ place) => valueOf(row, visible, place);
  // Without truth the tracker's own report is shown instead; it is not the same, so it has another colour.
  const missed = (/** @type {Row} */ row, /** @type {number} */ place) => Number.isNaN(seen(row, place)) && valueOf(row, recognised, place) === 0;
  const options = (/** @type {string} */ word) => ({ word, rows: names.length });
  const [hidden, lost] = [
    shades("hidden", 0.2, (row, place) => seen(row, place) === 0, options("hidden")),
    shades("lost", 0.16, missed, options("unrecognised")),
  ];
  return {
    needs: series,
    rows: names.length,
    show(store, isRoomy) {
      const { history } = store;
      const rows = names.map((name, place) => {
        const values = column(history, reads[place]);
        const y = values.map((each) => place + 1 - FREE - (1 - 2 * FREE) * each);
        return lineOver({ name: `${id} ${name}`, y, values, ink: inkOf(store), width: 1.5, said: titles[place] ?? name });
      });
      const ticks = names.map((name, place) => ({ at: place + 0.5, text: (isRoomy && titles[place]) || name }));
      // The first is at the top.
      return { traces: [hidden(history), lost(history), ...rows], y: { low: names.length, high: 0, ticks } };
    },
  };
}

/** The share of set flags up to each frame, in percent, with its expected value.
 *
 * @type {Make}
 */
function frequency(plot) {
  const { id, series, title, unit } = plot;
  const levels = plot.levels.map((level) => 100 * level);
  const shares = series.map((name) => remembered((history) => frequencies(history, name).map((share) => 100 * share)));
  return {
    needs: series,
    show(store) {
      const { frames } = store.known;
      const expected = levels.map((level) =>
        lineOver({ name: `level ${level}`, x: [0, frames], y: [level, level], ink: "truth", dashed: true, width: 1, said: "expected", unit }),
      );
      const found = branchesOf(store).flatMap(({ id: branch, ink, width, history }) =>
        series.map((name, place) => lineOver({ name: `${id} ${branch} ${name}`, y: shares[place](history), ink, width, said: title, unit })),
      );
      return { traces: [...expected, ...found], y: { low: 0, high: HIGHEST, ticks: [0, ...levels].map((at) => ({ at, text: number(at, 0) })) } };
    },
  };
}

/** The particles of each sampler in stacked bands; only for the active branch.
 *
 * @type {Make}
 */
function shareOfSamplers({ id }, session) {
  return {
    needs: namesOf(session, "share"),
    show({ history }) {
      // Each band covers the whole width of its frame.
      const x = Array.from({ length: 2 * history.length }, (_, end) => Math.ceil(end / 2) - 0.5);
      let low = x.map(() => 0);
      const traces = samplers(session).map(({ colour, name }, place) => {
        const below = low;
        low = below.map((sum, end) => sum + (samplesOf(session, history.at(Math.floor(end / 2)))?.[place] ?? 0));
        return { ...band(`${id} ${name}`, colour, below, low, x), title: name, opacity: 1 };
      });
      return { traces, y: { low: 0, high: Math.max(1, extent([low])[1]) } };
    },
  };
}

/** One component of K hypotheses, each a line from frame to frame whose opacity grows with its probability; only for the active branch. A
 * hypothesis that begins in a frame begins in the middle before it.
 *
 * @type {Make}
 */
function hypotheses(plot) {
  const { id, component, series: [name], unit } = plot;
  const [truth, lost] = [reader(plot.truth), isLost()];
  const linked = remembered((history) =>
    everyHypothesis(history, name).map(({ frame, place, values: { [component]: y1 }, weight }) => {
      const before = knownOf(history.at(frame - 1), name).values[place]?.[component] ?? NaN;
      const from = Number.isNaN(before) ? { x0: frame - 0.5, y0: y1 } : { x0: frame - 1, y0: before };
      return { ...from, x1: frame, y1, opacity: FAINTEST + (1 - FAINTEST) * weight };
    }),
  );
  return {
    needs: plot.series,
    show(store) {
      const { history } = store;
      const links = linked(history);
      const y = enclose(extent([...links.map(({ y0, y1 }) => [y0, y1]), column(history, truth)]), smallestSpan(unit));
      return { traces: [lost(history), linksOver({ name: id, ink: inkOf(store), links }), trueLine(plot, store, truth)], y };
    },
  };
}

/** Hypotheses with their parents: a row for each index within a frame, with opacity by probability, and the path back from the most
 * probable one of the newest frame; only for the active branch. Choosing one shows it in its frame.
 *
 * @type {Make}
 */
function tree(plot) {
  const { id, series: [name], shown } = plot;
  const found = remembered((history) => treeOf(history, name));
  const count = (/** @type {History} */ history, /** @type {number} */ frame) => knownOf(history.at(frame), name).weights.length;
  return {
    needs: plot.series,
    rows: 4,
    show(store) {
      const { history, known } = store;
      const { links, nodes, way } = found(history);
      const [all, ink, { weights }] = [Math.max(1, ...nodes.y), inkOf(store), knownOf(history.at(known.position), name)];
      const at = Math.min(shown === "" ? 1 : Number(known.parameters[shown]), weights.length);
      const here = at === 0 ? { x: [], y: [], opacity: [] } : { x: [known.position], y: [at], opacity: [1] };
      /** @type {Nodes[]} */
      const discs = [
        { kind: "nodes", title: "", name: id, ink, ring: false, size_px: NODE_PX, ...nodes },
        { kind: "nodes", title: "", name: `${id} shown`, ink: "ink", ring: true, size_px: RING_PX, ...here },
      ];
      const back = lineOver({ title: "way back", name: `${id} way`, ...way, ink: "muted", width: 7, opacity: 0.45 });
      // The first is at the top.
      const y = { low: all + 0.6, high: 0.4, ticks: Array.from({ length: all }, (_, place) => ({ at: place + 1, text: String(place + 1) })) };
      const words = at === 0 ? "" : `${at} of ${weights.length} is shown, with ${number(100 * weights[at - 1], 0)} %.`;
      const handles = shown && at > 0 ? [{ parameter: shown, at, along: /** @type {const} */ ("y") }] : [];
      return { traces: [back, linksOver({ name: `${id} edges`, ink, links }), ...discs], y, words, handles };
    },
    async choose({ steering, store }, frame, y) {
      const places = count(store.history, frame);
      if (!store.isSteerable || places === 0) return;
      await steering.seek(frame);
      const values = { [shown]: Math.min(Math.max(1, Math.round(y)), places) };
      if (shown !== "") await steer(store, { kind: "change", values });
    },
  };
}

/** The nodes of a tree, its edges from each hypothesis's parent, and the path back.
 *
 * @param {History} history
 * @param {string} name Name of the series.
 */
export function treeOf(history, name) {
  const all = everyHypothesis(history, name).map((each) => ({ ...each, opacity: FAINTEST_NODE + (1 - FAINTEST_NODE) * each.weight }));
  const born = all.filter(({ parent }) => parent >= 0);
  return {
    nodes: { x: all.map(({ frame }) => frame), y: all.map(({ place }) => place + 1), opacity: all.map(({ opacity }) => opacity) },
    links: born.map(({ frame, place, parent, opacity }) => ({ x0: frame - 1, y0: parent + 1, x1: frame, y1: place + 1, opacity })),
    way: wayBack(history, name),
  };
}

/**
 * The most probable hypothesis of the newest frame, and before it its parents, as far back as they go.
 *
 * @param {History} history
 * @param {string} name Name of the series.
 */
function wayBack(history, name) {
  /** @type {{x: number[], y: number[]}} */
  const way = { x: [], y: [] };
  let frame = history.length - 1;
  const { weights } = knownOf(history.at(frame), name);
  let place = weights.indexOf(Math.max(...weights));
  while (frame >= 0 && place >= 0) {
    way.x.push(frame);
    way.y.push(place + 1);
    place = knownOf(history.at(frame), name).parents[place] ?? -1;
    frame -= 1;
  }
  return way;
}

/**
 * All hypotheses of all frames.
 *
 * @param {History} history
 * @param {string} name Name of the series.
 */
function everyHypothesis(history, name) {
  return Array.from({ length: history.length }, (_, frame) => {
    const { values, weights, parents } = knownOf(history.at(frame), name);
    return weights.map((weight, place) => ({ frame, place, weight, values: values[place], parent: parents[place] ?? -1 }));
  }).flat();
}

/** The hypotheses of a frame, with NaN for unknown values; empty if the frame has none.
 *
 * @param {Row|undefined} row
 * @param {string} name
 */
function knownOf(row, name) {
  const { values = [], weights = [], parents = [] } = hypothesesOf(row, name) ?? {};
  return { values: values.map((each) => each.map((number_) => number_ ?? NaN)), weights: weights.map((weight) => weight ?? 0), parents };
}

/** The branches; the active one is last, so that its line is on top, and wider.
 *
 * @param {Store} store
 */
function branchesOf(store) {
  const [active, ...others] = store.branches;
  return (active ? [...others, active] : []).map(({ id, colour }) => {
    const isActive = id === store.known.branch;
    return { id, ink: colour, history: store.historyOf(id), isActive, width: isActive ? 1.8 : 1.2 };
  });
}

/**
 * The colour of the active branch.
 *
 * @param {Store} store
 */
function inkOf({ known }) {
  return known.branches.find(({ id }) => id === known.branch)?.colour ?? "ink";
}

/** A line per branch.
 *
 * @param {Plot} plot
 * @param {Store} store
 * @param {Curve} read
 * @param {string} [name] Suffix of each line's name.
 */
function lines({ id, title, unit }, store, read, name = "") {
  return branchesOf(store).map(({ id: branch, ink, width, history }) =>
    lineOver({ name: `${id} ${branch}${name}`, y: column(history, read), ink, width, said: title, unit }),
  );
}

/** The truth, dashed.
 *
 * @param {Plot} plot
 * @param {Store} store
 * @param {Curve} truth
 */
function trueLine({ id, unit }, { history }, truth) {
  return lineOver({ name: `${id} truth`, y: column(history, truth), ink: "truth", dashed: true, width: 1.2, said: "truth", unit });
}

/**
 * @param {string} name
 * @param {string} ink
 * @param {readonly number[]} low
 * @param {readonly number[]} high
 * @param {readonly number[]} [x] The frames; all by default.
 * @returns {Band}
 */
function band(name, ink, low, high, x = [...low.keys()]) {
  return { kind: "band", title: "", name, ink, opacity: 0.22, x, low, high };
}

/** @type {Map<string, Curve>} */
const readers = new Map();

/** The reader of a series: the same function each time, so that its column is cached.
 *
 * @param {string} name
 * @param {number|null} [place] Index in a vector.
 * @returns {Curve}
 */
export function reader(name, place = null) {
  const found = readers.get(`${name} ${place}`) ?? ((row) => valueOf(row, name, place));
  readers.set(`${name} ${place}`, found);
  return found;
}

/** The reader of a role's number.
 *
 * @param {SessionPublic} session
 * @param {Role} role
 * @returns {Curve}
 */
function readerOf(session, role) {
  return (row) => numberOf(session, role, row);
}

/** The smallest and largest value over all branches; inverted if there are none.
 *
 * @param {Store} store
 * @param {Curve[]} reads
 */
export function range(store, reads) {
  return extent(branchesOf(store).flatMap(({ history }) => reads.map((read) => column(history, read))));
}

/** The largest absolute value; 0 if there is none.
 *
 * @param {Store} store
 * @param {Curve[]} reads
 */
function most(store, reads) {
  return Math.max(0, ...range(store, reads).filter(Number.isFinite).map(Math.abs));
}

/** A range from 0 to beyond the values of all branches.
 *
 * @param {Store} store
 * @param {Curve[]} reads
 * @param {...number} least Values that the range must include.
 */
function fromZero(store, reads, ...least) {
  return { low: 0, high: reach(Math.max(...least, most(store, reads))) };
}

/**
 * @param {SessionPublic} session
 * @param {Role} role
 */
function namesOf(session, role) {
  return ofRole(session, role).map(({ name }) => name);
}

/** @type {Record<Plot["kind"], Make>} */
export const KINDS = {
  ...{ error, sigma, "sample size": sampleSize, samplers: shareOfSamplers, innovation, value: oneNumber },
  ...{ band: withinBand, interval, features, frequency, hypotheses, tree },
};

/** Kinds that draw a line for each branch, and so for each of several runs. */
export const OVERLAID = /** @type {readonly string[]} */ (["error", "sigma", "sample size", "innovation", "value", "band", "frequency"]);
