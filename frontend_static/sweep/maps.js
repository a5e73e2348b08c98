/** Small multiples: a heat map per tracker over shared axes and colours, a comparison of two trackers, and the legend; over a single axis
 of numbers also curves. */

import { trackerTitle } from "../session/steering.js";
import { elementOf, tip } from "../shared/dom.js";
import { useFigure } from "../shared/figure/figure.js";
import { count, measureValue, number, parameterValue } from "../shared/format.js";
import { css, diverging, gradient, onTheme, verdict, viridis } from "../shared/theme.js";
import { h, html, signal, useEffect, useLayoutEffect } from "../vendor/preact.js";
import { choose, chosen, comparisonLook, methodLook, seen, short, shortTitle, signed } from "./store.js";

/** @import { Axis, Cell, CellLook } from "../shared/figure/traces.js" */
/** @import { AxisPublic, ComparisonPublic, MapPublic, SweepPublic } from "../shared/messages.js" */
/** @import { Seen } from "./store.js" */

const KEYS = "Arrow keys move from cell to cell, Enter lists its runs.";
const PANEL = "map";
const BETTER = { none: "not significant", untested: "the test is not applicable" };
/** Colours of trackers in curves, one after the other; more trackers have dashed lines. */
const INKS = /** @type {const} */ (["estimate", "prediction", "second", "observation", "lost"]);
/** Number of changes of the colours. */
const themes = signal(0);

/** @param {{now: Seen}} props */
export function Maps({ now }) {
  const { sweep, cells, view, compares, quantity, maps: single } = now;
  useEffect(() => {
    addEventListener("scroll", () => tip.hide(), { passive: true });
    onTheme(() => (themes.value += 1));
  }, []);
  const maps = single.map((map) => {
    const title = longName(sweep, map.tracker);
    const props = { tracker: map.tracker, title, words: pooled(now, map), shown: quantity.words, look: methodLook(now, map), now };
    return h(HeatMap, { key: map.tracker, ...props });
  });
  const against = `${shortOf(sweep, view.first)} against ${shortOf(sweep, view.second)}`;
  const isCurve = cells.y === null && cells.x.values.length > 1 && cells.x.values.every((value) => typeof value === "number");
  return html`
    ${isCurve && h(Curves, { now })}
    ${h(Legend, { now })}
    <div class="maps" data-part="maps" data-count=${maps.length + Number(compares)}>
      ${maps}
      ${compares && h(HeatMap, { key: "", tracker: null, title: against, words: verdicts(now), shown: view.show, look: comparisonLook(now), now })}
    </div>
  `;
}

/**
 * @typedef {object} HeatMapProps
 * @property {string|null} tracker Null for a comparison.
 * @property {string} title
 * @property {string} words Summary of all cells.
 * @property {string} shown The shown quantity, in words.
 * @property {(index: number) => CellLook} look
 * @property {Seen} now
 */

/** @param {HeatMapProps} props */
function HeatMap({ tracker, title, words, shown, look, now: { cells } }) {
  const { room, figure } = useFigure({
    describe: (at) => seen.value && elementOf(describe(seen.value, at, tracker)),
    choose: (at) => choose(at, tracker),
  }, { isCompact: true });
  const cell = chosen.value;
  const [x, y] = [axisOf(cells.x), axisOf(cells.y)];
  const [across, up] = [x.names.length, y.names.length];
  useLayoutEffect(() => {
    const place = room.current;
    if (place === null || figure.current === null) return;
    const trace = { kind: /** @type {const} */ ("heat map"), title: /** @type {const} */ (""), ink: "", name: title, across, up, look, chosen: cell };
    const name = `${title}, ${shown}. ${KEYS}`;
    const panel = {
      id: PANEL, title: "", x, y, traces: [trace], handles: [], words: name, row: 0, share: /** @type {[number, number]} */ ([1, 1]),
      // Read at every drawing: the style sheet sets it together with the room's height.
      get unit_px() {
        return parseFloat(getComputedStyle(place).getPropertyValue("--widest"));
      },
    };
    figure.current.show({ panels: [panel] }, { locked: true });
    const around = figure.current.around(PANEL);
    if (around === null) return;
    place.style.setProperty("--beside", `${around.across}px`);
    place.style.setProperty("--under", `${around.up}px`);
  });
  return html`<figure class="map" data-map=${tracker ?? "comparison"}>
    <figcaption><span title=${title}>${title}</span><output>${words}</output></figcaption>
    <div class="map-plot"><div class="map-room" ref=${room} style=${{ "--across": across, "--up": up }}></div></div>
  </figure>`;
}

/** Each tracker's values along the only axis, with the intervals of success rates.
 *
 * @param {{now: Seen}} props
 */
function Curves({ now: { sweep, cells, quantity, maps, end } }) {
  const { room, figure } = useFigure({});
  const { title, unit } = cells.x;
  const x = cells.x.values.map(Number);
  const axis = { log: false, names: [], hidden: false };
  useLayoutEffect(() => {
    const traces = maps.flatMap((map, place) => {
      const look = { title: shortOf(sweep, map.tracker), ink: INKS[place % INKS.length], reveals: false };
      const curve = { ...look, kind: /** @type {const} */ ("curve"), x, y: quantity.values(map), dashed: place >= INKS.length, area: null };
      const there = x.flatMap((at, index) => (map.low[index] === null ? [] : [{ at, low: map.low[index], high: Number(map.high[index]) }]));
      const interval = { x: there.map(({ at }) => at), low: there.map(({ low }) => low), high: there.map(({ high }) => high), opacity: 0.15 };
      const band = { ...interval, kind: /** @type {const} */ ("band"), title: /** @type {const} */ (""), ink: look.ink, name: look.title };
      return quantity.name === "success" ? [band, curve] : [curve];
    });
    const across = { ...axis, title, unit, low: Math.min(...x), high: Math.max(...x) };
    const up = { ...axis, title: quantity.title, unit: quantity.unit, low: 0, high: end.most };
    const share = /** @type {[number, number]} */ ([1, 1]);
    const words = `${quantity.title} over ${title}`;
    figure.current?.show({ panels: [{ id: "curves", title: "", x: across, y: up, traces, handles: [], words, row: 0, share }] }, { locked: true });
  });
  return html`<div class="sweep-curves" ref=${room}></div>`;
}

/**
 * A cell for each value, with its name in the middle.
 *
 * @param {AxisPublic|null} axis
 * @returns {Axis}
 */
function axisOf(axis) {
  const { title, unit, values } = axis ?? { title: "", unit: "", values: [""] };
  const names = values.map((value) => (typeof value === "number" ? String(Number(value.toPrecision(4))) : String(value)));
  return { title, unit, names, low: -0.5, high: values.length - 0.5, log: false, hidden: axis === null };
}

/** "h-SPF · Hard switching": a narrow place cuts off the less important part.
 *
 * @param {SweepPublic} sweep
 * @param {string} tracker
 */
function longName(sweep, tracker) {
  const whole = trackerTitle(sweep, tracker);
  const brief = shortTitle(whole);
  return whole === brief ? whole : `${brief} · ${whole.replace(` (${brief})`, "")}`;
}

/**
 * @param {SweepPublic} sweep
 * @param {string} tracker
 */
export function shortOf(sweep, tracker) {
  return shortTitle(trackerTitle(sweep, tracker));
}

/** A summary of all cells of a tracker.
 *
 * @param {Seen} seen
 * @param {MapPublic} map
 */
function pooled({ sweep, quantity: { measure, values } }, map) {
  const sum = (/** @type {(number|null)[]} */ column) => column.reduce((/** @type {number} */ total, value) => total + (value ?? 0), 0);
  const runs = sum(map.runs) - sum(map.problems);
  if (runs === 0) return "";
  // Such as a filter from a file, which has no probability of loss.
  if (measure && values(map).every((value) => value === null)) return `has no number for “${measure.title}”`;
  return sweep.judged ? `${((100 * sum(map.successes)) / runs).toFixed(0)} % of ${count(runs, "run")} succeeded` : count(runs, "run");
}

/** The number of cells in which each of two trackers is better.
 *
 * @param {Seen} seen
 */
function verdicts({ view, comparison, problem }) {
  if (view.show !== "significance" || comparison === null) return problem;
  const of = (/** @type {typeof comparison.verdict[number]} */ code) => comparison.verdict.filter((one) => one === code).length;
  const untested = of("untested") > 0 ? `, ${of("untested")} not applicable` : "";
  return `${count(of("first"), "cell")} to ${of("second")}, ${of("none")} not significant${untested}`;
}

/**
 * The tooltip of a cell: its place, and every tracker in it.
 *
 * @param {Seen} now
 * @param {Cell} cell
 * @param {string|null} here The tracker at the pointer.
 */
function describe(now, { i, j }, here) {
  const { sweep, cells: { x, y, maps }, comparison } = now;
  const index = j * x.values.length + i;
  const lines = maps.map((map) => {
    const runs = map.runs[index];
    return html`<tr class=${map.tracker === here && "here"}>
      <th>${shortOf(sweep, map.tracker)}</th><td>${outcome(now, map, index)}</td><td>${runs > 0 && count(runs, "run")}</td>
    </tr>`;
  });
  return html`<div>
    <p>${placeOf(x, i)}${y && [html`<br />`, placeOf(y, j)]}</p>
    <table>${lines}</table>
    ${comparison && difference(sweep, comparison, index)}
  </div>`;
}

/**
 * "Occluder width 55 px"
 *
 * @param {AxisPublic} axis
 * @param {number} index
 */
export function placeOf(axis, index) {
  return `${axis.title} ${parameterValue(axis.values[index], axis)}`.trim();
}

/**
 * @param {Seen} seen
 * @param {MapPublic} map
 * @param {number} index
 */
function outcome({ sweep, quantity: { measure, values } }, map, index) {
  if (map.runs[index] === 0) return sweep.state === "running" ? "to come" : "not tested";
  if (map.problems[index] === map.runs[index]) return "not possible";
  if (measure) return html`<strong>${measureValue(values(map)[index] ?? null, measure)}</strong>`;
  const [rate, error] = [map.rate[index], map.error[index]];
  return [
    rate !== null && html`<strong>${number(rate, 2)}</strong> (${number(map.low[index], 2)} – ${number(map.high[index], 2)})`,
    error !== null && html`<span class="tip-error">error ${short(error)} ${sweep.unit}</span>`,
  ];
}

/**
 * @param {SweepPublic} sweep
 * @param {ComparisonPublic} comparison
 * @param {number} index
 */
function difference(sweep, comparison, index) {
  const value = comparison.difference[index];
  const code = comparison.verdict[index];
  const p = comparison.p_value[index];
  const words = code === "first" || code === "second" ? `${shortOf(sweep, comparison[code])} is better` : BETTER[code];
  const [paired, low, high] = [comparison.paired[index], comparison.paired_low[index], comparison.paired_high[index]];
  const interval = low === null || high === null ? "" : ` (${short(low)} to ${short(high)})`;
  return html`<p>
    ${value !== null && `Difference ${signed(value)}, `}${words}${p !== null && ` (p ${p < 0.0001 ? "< 0.0001" : `= ${p.toFixed(4)}`})`}
    ${paired !== null && html`<br />On the same scenes ${signed(paired)}${interval}, ${count(comparison.pairs[index], "pair")}`}
  </p>`;
}

/** @param {{now: Seen}} props */
function Legend({ now }) {
  const { sweep, quantity, end: { most, words } } = now;
  const unit = quantity.unit && ` ${quantity.unit}`;
  const [none, all] = [`0${unit}`, quantity.isShare ? "1" : `${short(most)}${unit}${words}`];
  const [worse, better] = quantity.isBetterHigh ? [none, all] : [all, none];
  // The colours of differences and verdicts follow the theme.
  return html`<div class="sweep-legend" data-theme=${themes.value}>
    ${scale(quantity.title, gradient(viridis), worse, better)}
    ${now.compares && compared(now, unit)}
    ${sweep.state === "running" && html`<span class="legend-key"><span class="swatch pending"></span>to come</span>`}
    <span class="legend-key"><span class="swatch hatched"></span>not tested</span>
  </div>`;
}

/**
 * @param {Seen} seen
 * @param {string} unit
 */
function compared({ sweep, view, differenceEnd: { most, words } }, unit) {
  const [first, second] = [shortOf(sweep, view.first), shortOf(sweep, view.second)];
  if (view.show === "difference") {
    return scale("Difference", gradient((share) => diverging(-share), -1), `${first} better by ${short(most)}${unit}${words}`, `${second} better`);
  }
  const meanings = { first: `${first} better`, second: `${second} better`, none: "not significant", untested: "not applicable" };
  return /** @type {(keyof typeof meanings)[]} */ (Object.keys(meanings)).map(
    (code) => html`<span class="legend-key"><span class="swatch" style=${{ background: css(verdict(code)) }}></span>${meanings[code]}</span>`,
  );
}

/**
 * @param {string} name
 * @param {string} background
 * @param {string} low
 * @param {string} high
 */
function scale(name, background, low, high) {
  const bar = html`<span class="legend-bar" role="img" aria-label=${`Colours from ${low} to ${high}`} style=${{ background }}></span>`;
  return html`<span class="legend-key"><strong>${name}</strong>${low}${bar}${high}</span>`;
}
