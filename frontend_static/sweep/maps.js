/** Small multiples: a heat map a method over shared axes and colours; and one method against another. */

import { fill, h, setText } from "../shared/dom.js";
import { count, number } from "../shared/format.js";
import { coalesce } from "../shared/timing.js";
import { comparisonLook, methodLook, short } from "./look.js";
import { HeatMap } from "./map.js";

export function maps(root, store) {
  const figures = new Map();
  const tip = tooltip();
  document.body.append(tip.element);
  let shown = "";

  /** What is to be drawn: a method each, or two methods and their difference. */
  function wanted() {
    const quantity = store.view.show === "error" || (store.compares && store.view.measure === "error") ? "error" : "success";
    const { first, second, show } = store.view;
    if (!store.compares) return store.sweep.trackers.map(({ id }) => ({ id, tracker: id, quantity }));
    return [{ id: first, tracker: first, quantity }, { id: second, tracker: second, quantity }, { id: `${show} of ${first} and ${second}`, show }];
  }

  const draw = coalesce(() => {
    if (store.cells === null) return;
    const list = wanted();
    const key = list.map(({ id }) => id).join(" ");
    if (key !== shown) {
      shown = key;
      for (const { id } of list) if (!figures.has(id)) figures.set(id, figure(id));
      fill(root, list.map(({ id }) => figures.get(id).element));
      root.dataset.count = String(list.length);
    }
    const { x, y } = store.cells;
    for (const { id, tracker, quantity } of list) {
      const { map, heading, value } = figures.get(id);
      const title = tracker ? named(store, tracker) : `${store.shortOf(store.view.first)} against ${store.shortOf(store.view.second)}`;
      setText(heading, title);
      heading.title = title;
      setText(value, tracker ? pooled(store, tracker) : verdicts(store));
      const cells = tracker && store.cells.maps.find((one) => one.tracker === tracker);
      const look = tracker ? methodLook(store, cells, quantity) : comparisonLook(store);
      map.show(`${title}, ${tracker ? quantity : store.view.show}`, { x, y }, look);
      map.mark(store.chosen);
    }
  });

  function figure(id) {
    const heading = h("span", {});
    const value = h("output", {});
    const map = new HeatMap({
      point: (cell, place) => (cell === null ? tip.hide() : tip.show(describe(store, cell, id), place)),
      choose: ({ i, j }) => {
        tip.hide();
        store.choose({ i, j, tracker: store.cells.maps.some(({ tracker }) => tracker === id) ? id : null });
      },
    });
    return { map, heading, value, element: h("figure", { class: "map", data: { map: id } }, h("figcaption", {}, heading, value), map.element) };
  }

  store.on("sweep cells view comparison chosen", draw);
  addEventListener("scroll", tip.hide, { passive: true });
}

/** "h-SPF · Hard switching": what is cut off in a narrow place is the less important part. */
function named(store, tracker) {
  const [whole, brief] = [store.titleOf(tracker), store.shortOf(tracker)];
  return whole === brief ? whole : `${brief} · ${whole.replace(` (${brief})`, "")}`;
}

/** All cells of a method together. */
function pooled(store, tracker) {
  const map = store.cells.maps.find((one) => one.tracker === tracker);
  const sum = (column) => column.reduce((total, value) => total + (value ?? 0), 0);
  const runs = sum(map.runs) - sum(map.problems);
  if (runs === 0) return "";
  return store.sweep.judged ? `${((100 * sum(map.successes)) / runs).toFixed(0)} % of ${count(runs, "run")} succeeded` : count(runs, "run");
}

/** How many cells each of two methods has for itself. */
function verdicts(store) {
  if (store.view.show !== "significance" || store.comparison === null) return "";
  const of = (code) => store.comparison.verdict.filter((one) => one === code).length;
  return `${count(of("first"), "cell")} to ${of("second")}, ${of("none")} not significant`;
}

/** What is said of a cell: where it is, and every method in it. */
function describe(store, { i, j }, id) {
  const { cells, sweep, comparison } = store;
  const index = j * cells.x.values.length + i;
  const unit = sweep.unit ? ` ${sweep.unit}` : "";
  const rows = cells.maps.map((map) => {
    const runs = map.runs[index];
    const words = [];
    if (runs === 0) words.push(sweep.state === "running" ? "to come" : "not tested");
    else if (map.problems[index] === runs) words.push("not possible");
    else {
      if (map.rate[index] !== null) words.push(h("strong", {}, number(map.rate[index], 2)), ` (${number(map.low[index], 2)} – ${number(map.high[index], 2)})`);
      if (map.error[index] !== null) words.push(h("span", { class: "tip-error" }, `error ${short(map.error[index])}${unit}`));
    }
    return h("tr", { class: map.tracker === id ? "here" : null }, h("th", {}, store.shortOf(map.tracker)), h("td", {}, words), h("td", {}, runs > 0 ? count(runs, "run") : ""));
  });
  return [
    h("p", {}, [cells.x, cells.y].filter(Boolean).map((axis, place) => [place > 0 && h("br"), placeOf(axis, [i, j][place])])),
    h("table", {}, rows),
    comparison && h("p", {}, ...against(store, comparison, index)),
  ];
}

function against(store, comparison, index) {
  const value = comparison.difference[index];
  const p = comparison.p_value[index];
  const words = { first: `${store.shortOf(comparison.first)} is better`, second: `${store.shortOf(comparison.second)} is better`, none: "not significant", untested: "the test is not applicable" };
  return [
    value === null ? "" : `Difference ${value > 0 ? "+" : ""}${short(value)}, `,
    words[comparison.verdict[index]],
    p === null ? "" : ` (p ${p < 0.0001 ? "< 0.0001" : `= ${p.toFixed(4)}`})`,
  ];
}

/** "Occluder width 55 px" */
export function placeOf(axis, index) {
  const value = axis.values[index];
  return `${axis.title} ${typeof value === "number" ? exact(value) : value}${axis.unit ? ` ${axis.unit}` : ""}`.trim();
}

function exact(value) {
  return String(Number(value.toPrecision(6)));
}

function tooltip() {
  const element = h("div", { class: "map-tip", role: "status", hidden: true });
  return {
    element,
    hide: () => (element.hidden = true),
    show: (content, place) => {
      fill(element, content);
      element.hidden = false;
      const { width, height } = element.getBoundingClientRect();
      const left = Math.min(Math.max(place.x - width / 2, 8), innerWidth - width - 8);
      const top = place.y - height - 10 >= 8 ? place.y - height - 10 : place.below + 10;
      Object.assign(element.style, { left: `${left}px`, top: `${top}px` });
    },
  };
}
