/** What the maps show: the quantity, the two methods that are compared, and the axes. */

import { fill, h } from "../shared/dom.js";
import { NO_AXIS } from "./store.js";

const SHOWS = [
  ["success", "Success", "Share of the runs that succeeded"],
  ["error", "Error", "Mean error of the successful runs"],
  ["difference", "Difference", "One method's rate or error less another's"],
  ["significance", "Significance", "Where a test tells two methods apart"],
];
const LEVELS = [
  ["0.05", "5 %"],
  ["0.01", "1 %"],
  ["0.001", "0.1 %"],
];

export function choices(root, store) {
  store.on("view", () => fill(root, switches(store), axes(store), versus(store)));
}

function switches(store) {
  const { judged, trackers } = store.sweep;
  /** @param {string[]} choice */
  const open = ([name]) => (name !== "success" || judged) && (trackers.length > 1 || !["difference", "significance"].includes(name));
  return segments("Quantity", SHOWS.filter(open), store.view.show, (show) => store.show({ show }));
}

function versus(store) {
  if (!store.compares) return null;
  const { view, sweep } = store;
  const methods = sweep.trackers.map(({ id }) => [id, store.shortOf(id)]);
  const holm = h("input", { type: "checkbox", checked: view.correction === "holm", on: { change: () => store.show({ correction: holm.checked ? "holm" : "none" }) } });
  return h(
    "span",
    { class: "choice versus" },
    select("First method", methods, view.first, (first) => store.show({ first })),
    " against ",
    select("Second method", methods, view.second, (second) => store.show({ second })),
    sweep.judged && select("Of what", [["success", "by success"], ["error", "by error"]], view.measure, (measure) => store.show({ measure })),
    view.show === "significance" && [
      view.measure === "success" &&
        select("Test", [["chi-square", "chi-square"], ["fisher", "Fisher exact"]], view.test, (test) => store.show({ test })),
      select("Level", LEVELS, String(view.level), (level) => store.show({ level: Number(level) })),
      h(
        "label",
        { class: "check", title: "Holm's correction: the level holds for the whole map, not for each cell by itself" },
        holm,
        "Holm",
      ),
    ],
  );
}

function axes(store) {
  const { view, sweep } = store;
  if (sweep.axes.length < 2) return null;
  const names = sweep.axes.map(({ name, title }) => [name, title]);
  const change = (which, name) => {
    const other = which === "x" ? "y" : "x";
    // Choosing the other's axis swaps the two.
    store.show(view[other] === name ? { [which]: name, [other]: view[which] } : { [which]: name });
  };
  return h(
    "span",
    { class: "choice end" },
    "across ",
    select("Axis across", names, view.x, (name) => change("x", name)),
    " up ",
    select("Axis up", [...names, [NO_AXIS, "none"]], view.y, (name) => change("y", name)),
  );
}

function segments(label, options, chosen, choose) {
  return h(
    "span",
    { class: "segments", role: "group", "aria-label": label },
    options.map(([value, words, hint]) =>
      h("button", { type: "button", title: hint, "aria-pressed": String(value === chosen), data: { value }, on: { click: () => choose(value) } }, words),
    ),
  );
}

export function select(label, options, chosen, choose) {
  const list = h(
    "select",
    { "aria-label": label, on: { change: () => choose(list.value) } },
    options.map(([value, words]) => h("option", { value, selected: value === chosen }, words)),
  );
  return list;
}
