/** What the maps show: the quantity, the two methods that are compared, and the axes. */

import { fill, h } from "../shared/dom.js";
import { NO_AXIS } from "./store.js";

/** @import { SweepStore } from "./store.js" */
/** @import { View } from "./view.js" */

/**
 * What can be chosen: the value, and the words for it.
 *
 * @template {string} Value
 * @typedef {{value: Value, words: string, hint?: string}} Option
 */

/** @type {Option<View["show"]>[]} */
const SHOWS = [
  { value: "success", words: "Success", hint: "Share of the runs that succeeded" },
  { value: "error", words: "Error", hint: "Mean error of the successful runs" },
  { value: "measure", words: "Measure", hint: "Mean over all runs of a measure as benchmarks define it" },
  { value: "difference", words: "Difference", hint: "One tracker's rate, error or measure minus another's" },
  { value: "significance", words: "Significance", hint: "Where a test tells two trackers apart" },
];
/** @type {Option<View["test"]>[]} */
const TESTS = [
  { value: "chi-square", words: "chi-square" },
  { value: "fisher", words: "Fisher exact" },
];
const LEVELS = [
  { value: "0.05", words: "5 %" },
  { value: "0.01", words: "1 %" },
  { value: "0.001", words: "0.1 %" },
];

/**
 * @param {HTMLElement} root
 * @param {SweepStore} store
 */
export function choices(root, store) {
  store.on(["view"], () => {
    const focused = root.contains(document.activeElement) ? nameOf(document.activeElement) : undefined;
    fill(root, switches(store), axes(store), versus(store));
    // The control that was used goes on to have the keyboard.
    const again = [...root.querySelectorAll("button, select, input")].find((control) => nameOf(control) === focused);
    if (focused && again instanceof HTMLElement) again.focus();
  });
}

/** @param {Element|null} control */
const nameOf = (control) => control?.getAttribute("aria-label") ?? control?.getAttribute("data-value") ?? control?.getAttribute("type");

/** @param {SweepStore} store */
function switches(store) {
  const { judged, has_truth, trackers, measures } = store.known;
  const isSeveral = trackers.length > 1;
  const isOpen = { success: judged, error: has_truth, measure: measures.length > 0, difference: isSeveral, significance: isSeveral };
  const open = SHOWS.filter(({ value }) => isOpen[value]);
  const { view, measure } = store;
  return [segments("Quantity", open, view.show, (show) => store.show({ show })), view.show === "measure" && measure && whichMeasure(store, measure)];
}

/**
 * @param {SweepStore} store
 * @param {import("../shared/messages.js").MeasurePublic} measure
 */
function whichMeasure(store, measure) {
  const options = store.known.measures.map(({ name, title }) => ({ value: name, words: title }));
  const list = select("Which measure", options, measure.name, (of) => store.show({ of }));
  return h("span", { class: "choice", title: measure.description }, list);
}

/** @param {SweepStore} store */
function versus(store) {
  if (!store.compares) return null;
  const { view, known: sweep } = store;
  const methods = sweep.trackers.map(({ id }) => ({ value: id, words: store.shortOf(id) }));
  const holm = h("input", { type: "checkbox", checked: view.correction === "holm" });
  holm.addEventListener("change", () => store.show({ correction: holm.checked ? "holm" : "none" }));
  return h(
    "span",
    { class: "choice versus" },
    select("First tracker", methods, view.first, (first) => store.show({ first })),
    " against ",
    select("Second tracker", methods, view.second, (second) => store.show({ second })),
    comparedBy(store),
    view.show === "significance" && [
      view.measure === "success" && select("Test", TESTS, view.test, (test) => store.show({ test })),
      select("Level", LEVELS, String(view.level), (level) => store.show({ level: Number(level) })),
      h(
        "label",
        { class: "check", title: "Holm's correction: the level holds for the whole map, not for each single cell" },
        holm,
        "Holm",
      ),
    ],
  );
}

/** @param {SweepStore} store */
function comparedBy(store) {
  const { view, known: sweep, measure } = store;
  const options = [
    ...(sweep.judged ? [{ value: "success", words: "success" }] : []),
    ...(sweep.has_truth ? [{ value: "error", words: "error" }] : []),
    ...sweep.measures.map(({ name, title }) => ({ value: name, words: title })),
  ];
  if (options.length < 2) return null;
  const list = select("Compared by", options, view.measure, (by) => store.show({ measure: by }));
  return h("span", { title: measure?.description }, " by ", list);
}

/** @param {SweepStore} store */
function axes(store) {
  const { view, known: sweep } = store;
  if (sweep.axes.length < 2) return null;
  const names = sweep.axes.map(({ name, title }) => ({ value: name, words: title }));
  // Choosing the other's axis swaps the two.
  const across = (/** @type {string} */ x) => store.show(view.y === x ? { x, y: view.x } : { x });
  const up = (/** @type {string} */ y) => store.show(view.x === y ? { x: view.y, y } : { y });
  return h(
    "span",
    { class: "choice end" },
    h("span", { class: "pair" }, "across", select("Axis across", names, view.x, across)),
    h("span", { class: "pair" }, "up", select("Axis up", [...names, { value: NO_AXIS, words: "none" }], view.y, up)),
  );
}

/**
 * A row of buttons of which one is chosen.
 *
 * @template {string} Value
 * @param {string} label
 * @param {Option<Value>[]} options
 * @param {Value} chosen
 * @param {(value: Value) => void} choose
 */
function segments(label, options, chosen, choose) {
  return h(
    "span",
    { class: "segments", role: "group", "aria-label": label },
    options.map(({ value, words, hint }) =>
      h("button", { type: "button", title: hint, "aria-pressed": String(value === chosen), data: { value }, on: { click: () => choose(value) } }, words),
    ),
  );
}

/**
 * @template {string} Value
 * @param {string} label
 * @param {Option<Value>[]} options
 * @param {Value} chosen
 * @param {(value: Value) => void} choose
 */
export function select(label, options, chosen, choose) {
  const list = h("select", { "aria-label": label }, options.map(({ value, words }) => h("option", { value, selected: value === chosen }, words)));
  list.addEventListener("change", () => choose(options[list.selectedIndex].value));
  return list;
}
