/**
 * The kinds of plots that an experiment can declare: each says what is drawn of a run over its frames, as the traces of a
 * figure, and how far the axis upwards reaches.
 */

import { sendCommand } from "../../shared/api.js";
import { attempt } from "../../shared/dom.js";
import { written } from "../../shared/figure/axes.js";
import { lineOver } from "../../shared/figure/kinds.js";
import { number, smallestSpan } from "../../shared/format.js";
import { declared as declaredIn, frequencies, hypothesesOf, numberOf, ofRole, samplers, samplesOf, valueOf } from "../readings.js";
import { curve, isGone } from "../store.js";
import { column, enclose, extent, reach, remembered, shades } from "./plots.js";

/** @import { Axis, Band, Nodes, Segments, Trace } from "../../shared/figure/traces.js" */
/** @import { Bands, Plot, SessionPublic } from "../../shared/messages.js" */
/** @import { View } from "../mount.js" */
/** @import { Curve, History, Row, Store } from "../store.js" */

/**
 * What a plot shows now.
 *
 * @typedef {object} Shown
 * @property {Trace[]} traces From the back to the front.
 * @property {Pick<Axis, "low"|"high"|"ticks">} y
 * @property {{parameter: string, at: number, most: number}} [chosen] A parameter that is chosen in it, 1 the first.
 * @property {string} [words] What it shows that its lines do not say.
 */

/**
 * @typedef {object} Kind
 * @property {(store: Store, isRoomy: boolean) => Shown} show `isRoomy` where there is room for names that are written out.
 * @property {string[]} [needs] Names of series; one of them has to be measured. It needs none if they are not given.
 * @property {number} [rows] How many rows it has, one above the other.
 * @property {(view: View, frame: number, y: number) => void} [choose] Take what a person points at.
 */

/** @typedef {(plot: Plot, session: SessionPublic) => Kind} Make */

/** What is hardly probable at all is still seen: as a line, and as a node. */
const [FAINTEST, FAINTEST_NODE] = [0.06, 0.12];
/** Within its row a line leaves this free above and below. */
const FREE = 0.12;
/** Room above all, so that the line of 100 % is seen. */
const HIGHEST = 105;
const [NODE_PX, RING_PX] = [8, 14];
const isLost = () => shades("lost", 0.16, isGone, { word: "lost" });
/** Of the active branch, said where the band is drawn. */
const DOUBTS = /** @type {Record<string, string>} */ ({ overconfident: "too narrow", underconfident: "too wide" });

/** @type {Make} */
function error(plot, { unit }) {
  const [hidden, lost] = [shades("hidden", 0.2, (row) => row.hidden === true, { word: "hidden" }), isLost()];
  return {
    show(store) {
      const { ensemble: { value: ensemble }, history } = store;
      const traces = [hidden(history), lost(history), ...otherSeeds(ensemble, inkOf(store)), ...lines(plot, unit, store, curve.error)];
      const others = (ensemble?.high ?? []).filter((value) => value !== null);
      return { traces, y: { low: 0, high: reach(Math.max(smallestSpan(unit), most(store, [curve.error]), ...others)) } };
    },
  };
}

/**
 * What runs with other seeds do, where that is known: where most of them are, and the one in the middle.
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
function sigma(plot, { unit }) {
  return {
    show(store) {
      const { traces, most: highest } = thresholdsOf(store.known);
      const high = reach(Math.max(smallestSpan(unit), most(store, [curve.sigma]), highest));
      return { traces: [...lines(plot, unit, store, curve.sigma), ...traces], y: { low: 0, high } };
    },
  };
}

/**
 * The thresholds of sigma as lines over the frames in which they are in force, and the largest of them.
 *
 * @param {SessionPublic} session
 */
export function thresholdsOf({ frames, thresholds, unit }) {
  const levels = thresholds.filter(({ of }) => of === "sigma").map(({ steps }) => steps);
  const traces = levels.map((steps) => {
    const x = steps.flatMap(({ frame }, index) => [frame, steps[index + 1]?.frame ?? frames - 1]);
    const y = steps.flatMap(({ value }) => [value ?? NaN, value ?? NaN]);
    return lineOver({ title: "threshold", name: "thresholds", x, y, ink: "ink", dashed: true, width: 1.2, said: "threshold", unit });
  });
  return { traces, most: Math.max(0, ...levels.flat().map(({ value }) => value ?? 0)) };
}

/**
 * How many particles carry the weight, of how many there are.
 *
 * @type {Make}
 */
function sampleSize(plot, session) {
  const roles = /** @type {const} */ (["ess", "particles"]);
  const [ess, particles] = roles.map((role) => (/** @type {Row|undefined} */ row) => numberOf(session, role, row));
  return {
    needs: namesOf(session, "ess"),
    show: (store) => ({ traces: lines(plot, "", store, ess), y: { low: 0, high: reach(Math.max(1, most(store, [ess, particles]))) } }),
  };
}

/**
 * How far off the measurements were, beside what they should not be above.
 *
 * @type {Make}
 */
function innovation(plot, session) {
  const roles = /** @type {const} */ (["nis", "nis_limit"]);
  const [nis, limit] = roles.map((role) => (/** @type {Row|undefined} */ row) => numberOf(session, role, row));
  return {
    needs: namesOf(session, "nis"),
    show(store) {
      const beside = lineOver({ title: "limit", name: "limit", y: column(store.history, limit), ink: "ink", dashed: true, width: 1.2, said: "limit of 95 %" });
      return { traces: [beside, ...lines(plot, "", store, nis)], y: { low: 0, high: reach(Math.max(1, most(store, [nis, limit]))) } };
    },
  };
}

/**
 * One number a frame, which may lie far from 0.
 *
 * @type {Make}
 */
function oneNumber(plot) {
  const { series, unit } = plot;
  const read = reader(series[0]);
  return {
    needs: series,
    show: (store) => ({ traces: lines(plot, unit, store, read), y: enclose(range(store, [read]), smallestSpan(unit, most(store, [read]))) }),
  };
}

/**
 * Where a number lies, within two standard deviations, with 0 in the middle; and the truth.
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
      // The band may be as wide as it likes; the axis follows what is estimated and what is true.
      const end = reach(Math.max(smallestSpan(unit), most(store, [read, truth])));
      const y = { low: -end, high: end, ticks: [-end, 0, end].map((at) => ({ at, text: written(at) })) };
      const words = Object.values(known.doubts).join(" ");
      return { traces: [lost(history), area, trueLine(plot, store, truth), ...lines(plot, unit, store, read)], y, words };
    },
  };
}

/**
 * What lies between the ends of intervals, and the truth.
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
        /** @type {const} */ (["low", "high"]).flatMap((end) => lines(plot, unit, store, each[end], ` ${end} ${place}`)),
      );
      const reads = [truth, ...ends.flatMap(({ low, high }) => [low, high])];
      return { traces: [lost(history), ...areas, trueLine(plot, store, truth), ...edges], y: enclose(range(store, reads), smallestSpan(unit)) };
    },
  };
}

/**
 * A row a component of a vector, each from 0 at its bottom to 1 at its top; of the active branch alone.
 *
 * @type {Make}
 */
function features(plot, session) {
  const { id, row_titles: titles, recognised, series, visible } = plot;
  const names = declaredIn(session, series[0])?.components ?? [];
  const reads = names.map((_, place) => reader(series[0], place));
  const seen = (/** @type {Row} */ row, /** @type {number} */ place) => valueOf(row, visible, place);
  // Where the truth is unknown the tracker's own account has to do; it is not the same, so neither is the colour.
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
      // The first at the top.
      return { traces: [hidden(history), lost(history), ...rows], y: { low: names.length, high: 0, ticks } };
    },
  };
}

/**
 * How often flags were set up to each frame, in percent, beside how often they should be.
 *
 * @type {Make}
 */
function frequency(plot) {
  const { id, series, title } = plot;
  const levels = plot.levels.map((level) => 100 * level);
  const shares = series.map((name) => remembered((history) => frequencies(history, name).map((share) => 100 * share)));
  return {
    needs: series,
    show(store) {
      const { frames } = store.known;
      const expected = levels.map((level) =>
        lineOver({ name: `level ${level}`, x: [0, frames], y: [level, level], ink: "truth", dashed: true, width: 1, said: "expected", unit: "%" }),
      );
      const found = branchesOf(store).flatMap(({ id: branch, ink, width, history }) =>
        series.map((name, place) => lineOver({ name: `${id} ${branch} ${name}`, y: shares[place](history), ink, width, said: title, unit: "%" })),
      );
      return { traces: [...expected, ...found], y: { low: 0, high: HIGHEST, ticks: [0, ...levels].map((at) => ({ at, text: number(at, 0) })) } };
    },
  };
}

/**
 * How many particles came from each sampler; of the active branch alone.
 *
 * @type {Make}
 */
function shareOfSamplers(plot, session) {
  const stack = stackOf(session);
  return {
    needs: namesOf(session, "share"),
    show(store) {
      const { traces, most: high } = stack(store.history);
      return { traces: traces.map((trace) => ({ ...trace, name: `${plot.id} ${trace.name}` })), y: { low: 0, high } };
    },
  };
}

/**
 * The particles of each sampler in bands, one on the other, each frame as wide as it is.
 *
 * @param {SessionPublic} session
 * @returns {(history: History, every?: number) => {traces: Band[], most: number}} Of so many frames one is enough.
 */
export function stackOf(session) {
  const sources = samplers(session).map((each, place) => ({ ...each, read: (/** @type {Row|undefined} */ row) => samplesOf(session, row)?.[place] ?? 0 }));
  return (history, every = 1) => {
    const x = Array.from({ length: 2 * Math.ceil(history.length / every) }, (_, end) => every * Math.ceil(end / 2) - 0.5);
    let low = x.map(() => 0);
    const traces = sources.map(({ colour, name, read }) => {
      const [below, counts] = [low, column(history, read)];
      low = below.map((sum, end) => sum + counts[every * Math.floor(end / 2)]);
      return { ...band(name, colour, below, low, x), title: name, opacity: 1 };
    });
    return { traces, most: Math.max(1, extent([low])[1]) };
  };
}

/**
 * One component of K hypotheses, each a line from frame to frame that is the more opaque the more probable it is; of the
 * active branch alone. A hypothesis that begins in a frame begins in the middle before it.
 *
 * @type {Make}
 */
function hypotheses(plot) {
  const { id, component, series: [name], unit } = plot;
  const [truth, lost] = [reader(plot.truth), isLost()];
  const segments = remembered((history) => {
    const found = everyHypothesis(history, name).map(({ frame, place, values, weight }) => {
      const before = knownOf(history.at(frame - 1), name).values[place]?.[component] ?? NaN;
      const y1 = values[component];
      return Number.isNaN(before) ? { x0: frame - 0.5, y0: y1, x1: frame, y1, weight } : { x0: frame - 1, y0: before, x1: frame, y1, weight };
    });
    return { ...ways(found), opacity: found.map(({ weight }) => FAINTEST + (1 - FAINTEST) * weight) };
  });
  return {
    needs: plot.series,
    show(store) {
      const { history } = store;
      const own = segments(history);
      /** @type {Segments} */
      const drawn = { kind: "segments", title: "", name: id, ink: inkOf(store), ...own };
      const y = enclose(extent([own.y0, own.y1, column(history, truth)]), smallestSpan(unit));
      return { traces: [lost(history), drawn, trueLine(plot, store, truth)], y };
    },
  };
}

/**
 * Hypotheses with their parents: a row for each place among those of a frame, the more opaque the more probable, and the
 * way back from the most probable one of the newest frame; of the active branch alone. One that is pointed at is shown in its
 * frame.
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
      const { edges, nodes, way } = found(history);
      const [all, ink, { weights }] = [Math.max(1, ...nodes.y), inkOf(store), knownOf(history.at(known.position), name)];
      const at = Math.min(shown === "" ? 1 : Number(known.parameters[shown]), weights.length);
      const here = at === 0 ? { x: [], y: [], opacity: [] } : { x: [known.position], y: [at], opacity: [1] };
      /** @type {Segments} */
      const links = { kind: "segments", title: "", name: `${id} edges`, ink, ...edges };
      /** @type {Nodes[]} */
      const discs = [
        { kind: "nodes", title: "", name: id, ink, ring: false, size_px: NODE_PX, ...nodes },
        { kind: "nodes", title: "", name: `${id} shown`, ink: "ink", ring: true, size_px: RING_PX, ...here },
      ];
      const back = lineOver({ title: "way back", name: `${id} way`, ...way, ink: "muted", width: 7, opacity: 0.45 });
      // The first at the top.
      const y = { low: all + 0.6, high: 0.4, ticks: Array.from({ length: all }, (_, place) => ({ at: place + 1, text: String(place + 1) })) };
      const words = at === 0 ? "" : `${at} of ${weights.length} is shown, with ${number(100 * weights[at - 1], 0)} %.`;
      return { traces: [back, links, ...discs], y, words, ...(shown && at > 0 && { chosen: { parameter: shown, at, most: weights.length } }) };
    },
    async choose({ able, steering, store }, frame, y) {
      const places = count(store.history, frame);
      if (!able || places === 0) return;
      await steering.seek(frame);
      const values = { [shown]: Math.min(Math.max(1, Math.round(y)), places) };
      if (shown !== "") await attempt(() => sendCommand(store.known.id, { kind: "change", values }));
    },
  };
}

/**
 * The nodes of a tree, its edges from the parent of each hypothesis to itself, and the way back.
 *
 * @param {History} history
 * @param {string} name Of the series.
 */
export function treeOf(history, name) {
  const all = everyHypothesis(history, name).map((each) => ({ ...each, alpha: FAINTEST_NODE + (1 - FAINTEST_NODE) * each.weight }));
  const born = all.filter(({ parent }) => parent >= 0);
  const edges = ways(born.map(({ frame, place, parent }) => ({ x0: frame - 1, y0: parent + 1, x1: frame, y1: place + 1 })));
  return {
    nodes: { x: all.map(({ frame }) => frame), y: all.map(({ place }) => place + 1), opacity: all.map(({ alpha }) => alpha) },
    edges: { ...edges, opacity: born.map(({ alpha }) => alpha) },
    way: wayBack(history, name),
  };
}

/**
 * The most probable hypothesis of the newest frame, and before it its parents, as far back as they go.
 *
 * @param {History} history
 * @param {string} name Of the series.
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
 * @param {string} name Of the series.
 */
function everyHypothesis(history, name) {
  return Array.from({ length: history.length }, (_, frame) => {
    const { values, weights, parents } = knownOf(history.at(frame), name);
    return weights.map((weight, place) => ({ frame, place, weight, values: values[place], parent: parents[place] ?? -1 }));
  }).flat();
}

/**
 * The hypotheses of a frame, with NaN for what is not known of one; none where the frame has none.
 *
 * @param {Row|undefined} row
 * @param {string} name
 */
function knownOf(row, name) {
  const { values = [], weights = [], parents = [] } = hypothesesOf(row, name) ?? {};
  return { values: values.map((each) => each.map((number_) => number_ ?? NaN)), weights: weights.map((weight) => weight ?? 0), parents };
}

/**
 * In columns.
 *
 * @param {{x0: number, y0: number, x1: number, y1: number}[]} found
 */
function ways(found) {
  return { x0: found.map(({ x0 }) => x0), y0: found.map(({ y0 }) => y0), x1: found.map(({ x1 }) => x1), y1: found.map(({ y1 }) => y1) };
}

/**
 * The branches, the active one last, so that its line lies above, and is wider.
 *
 * @param {Store} store
 */
export function branchesOf(store) {
  const all = store.branches.map(({ id, colour }) => ({ id, ink: colour, history: store.historyOf(id), isActive: id === store.known.branch }));
  return all.sort((one, other) => Number(one.isActive) - Number(other.isActive)).map((branch) => ({ ...branch, width: branch.isActive ? 1.8 : 1.2 }));
}

/**
 * The colour of the active branch.
 *
 * @param {Store} store
 */
function inkOf({ known }) {
  return known.branches.find(({ id }) => id === known.branch)?.colour ?? "ink";
}

/**
 * A line a branch.
 *
 * @param {Plot} plot
 * @param {string} unit
 * @param {Store} store
 * @param {Curve} read
 * @param {string} [name] What follows the branch in the name of each.
 */
function lines({ id, title }, unit, store, read, name = "") {
  return branchesOf(store).map(({ id: branch, ink, width, history }) =>
    lineOver({ name: `${id} ${branch}${name}`, y: column(history, read), ink, width, said: title, unit }),
  );
}

/**
 * What is true, dashed.
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
 * @param {readonly number[]} [x] The frames, if not all.
 * @returns {Band}
 */
export function band(name, ink, low, high, x = [...low.keys()]) {
  return { kind: "band", title: "", name, ink, opacity: 0.22, x, low, high };
}

/** @type {Map<string, Curve>} */
const readers = new Map();

/**
 * What reads a series: the same function each time, so that its column is kept.
 *
 * @param {string} name
 * @param {number|null} [place] Of several numbers.
 * @returns {Curve}
 */
export function reader(name, place = null) {
  const found = readers.get(`${name} ${place}`) ?? ((row) => valueOf(row, name, place));
  readers.set(`${name} ${place}`, found);
  return found;
}

/**
 * The smallest and the largest of what any branch has; the wrong way round where there is nothing.
 *
 * @param {Store} store
 * @param {Curve[]} reads
 */
export function range(store, reads) {
  return extent(branchesOf(store).flatMap(({ history }) => reads.map((read) => column(history, read))));
}

/**
 * The largest, the sign apart; 0 where there is nothing.
 *
 * @param {Store} store
 * @param {Curve[]} reads
 */
export function most(store, reads) {
  return Math.max(0, ...range(store, reads).filter(Number.isFinite).map(Math.abs));
}

/**
 * @param {SessionPublic} session
 * @param {Parameters<typeof ofRole>[1]} role
 */
function namesOf(session, role) {
  return ofRole(session, role).map(({ name }) => name);
}

/** @type {Record<Plot["kind"], Make>} */
export const KINDS = {
  ...{ error, sigma, "sample size": sampleSize, samplers: shareOfSamplers, innovation, value: oneNumber },
  ...{ band: withinBand, interval, features, frequency, hypotheses, tree },
};

/** Those that draw a line for each branch, and so for each of several runs. */
export const OVERLAID = /** @type {readonly string[]} */ (["error", "sigma", "sample size", "innovation", "value", "band", "frequency"]);
