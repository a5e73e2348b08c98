/** The runs of the chosen cell, failures first; each is a link to the run itself, with its other methods beside it. */

import { fill, h } from "../shared/dom.js";
import { count } from "../shared/format.js";
import { runPage, sweeps } from "./api.js";
import { select } from "./choices.js";
import { short } from "./look.js";
import { placeOf } from "./maps.js";

const PAGE = 50;
const ALL = "";

export function runs(root, store) {
  let asked = 0;
  let tracker = ALL;
  invite();

  store.on("chosen", () => {
    tracker = store.chosen.tracker ?? ALL;
    load();
  });
  let axes = "";
  store.on("view", () => {
    const now = `${store.view.x} ${store.view.y}`;
    if (now === axes) return;
    axes = now;
    // Another map has other cells.
    store.chosen = null;
    invite();
  });

  function invite() {
    asked += 1;
    fill(root, h("h2", {}, "Runs"), h("p", { class: "hint" }, "Choose a cell of a map, and its runs are listed here, failures first. A run opens in a new tab, shortly before it lost the target."));
  }

  async function load() {
    asked += 1;
    const mine = asked;
    const slow = setTimeout(() => mine === asked && fill(root, heading(), h("div", { class: "bone shimmer" }), h("div", { class: "bone short shimmer" })), 200);
    try {
      const found = await ask(0);
      if (mine === asked) show(found);
    } catch (error) {
      if (mine === asked) fill(root, heading(), h("p", { class: "wrong", role: "alert" }, error.message), h("button", { type: "button", on: { click: load } }, "Try again"));
    } finally {
      clearTimeout(slow);
    }
  }

  function ask(offset) {
    const { i, j } = store.chosen;
    const { x, y } = store.view;
    return sweeps.rows(store.sweep.id, { x, y, i, j, offset, limit: PAGE, ...(tracker === ALL ? {} : { tracker }) });
  }

  function heading() {
    const { x, y } = store.cells;
    const { i, j } = store.chosen;
    const methods = [[ALL, "All methods"], ...store.sweep.trackers.map(({ id, title }) => [id, title])];
    const choose = (value) => {
      tracker = value;
      load();
    };
    return h("header", { class: "runs-head" }, h("h2", {}, placeOf(x, i), y && [h("br"), placeOf(y, j)]), methods.length > 2 && select("Method", methods, tracker, choose));
  }

  function show({ total, failures, rows }) {
    const list = h("ol", { class: "runs" }, rows.map((row) => item(store, row)));
    const more = h("button", { type: "button", hidden: rows.length >= total }, "Show more");
    more.addEventListener("click", async () => {
      more.disabled = true;
      const next = await ask(list.children.length).catch(() => null);
      more.disabled = false;
      if (next === null) return;
      list.append(...next.rows.map((row) => item(store, row)));
      more.hidden = next.rows.length === 0 || list.children.length >= next.total;
    });
    const words = total === 0 ? (store.sweep.state === "running" ? "Nothing has been computed of this cell yet." : "Nothing was computed of this cell.") : store.sweep.judged ? `${failures} of ${count(total, "run")} failed` : count(total, "run");
    fill(root, heading(), h("p", { class: "hint" }, words), list, more);
  }
}

function item(store, row) {
  const { sweep } = store;
  const verdict = row.problem !== null ? "not possible" : row.success === null ? "" : row.success ? "kept" : "lost";
  const others = sweep.trackers.filter(({ id }) => id !== row.tracker);
  const shown = new Set([store.view.x, store.view.y]);
  const pooled = sweep.axes.filter(({ name }) => !shown.has(name)).map(({ name, title, unit }) => `${title.toLowerCase()} ${row.conditions[name]}${unit ? ` ${unit}` : ""}`);
  const open = row.problem === null;
  const title = [h("span", { class: "run-method" }, store.titleOf(row.tracker)), h("span", {}, `trial ${row.trial}`)];
  return h(
    "li",
    { class: "run", data: { run: row.run, verdict } },
    h(
      "div",
      { class: "run-line" },
      open ? h("a", { class: "run-title", href: runPage(sweep.id, row.run), target: "_blank", rel: "noreferrer" }, title) : h("span", { class: "run-title" }, title),
      h("span", { class: `run-verdict ${verdict}` }, verdict),
    ),
    h("p", { class: "hint" }, row.problem ?? facts(sweep, row)),
    h("p", { class: "hint" }, [...pooled, `seed ${row.seed}`].join(", ")),
    open &&
      others.length > 0 &&
      h("p", { class: "run-others" }, h("span", { class: "hint" }, "Same seed"), others.map(({ id }) => h("a", { class: "chip-link", title: `The same seed with ${store.titleOf(id)}`, href: runPage(sweep.id, row.run, id), target: "_blank", rel: "noreferrer" }, store.shortOf(id)))),
  );
}

function facts(sweep, row) {
  // The unit stays with its number.
  const unit = sweep.unit ? `\u00a0${sweep.unit}` : "";
  const error = row.mean_error === null ? "" : `error ${short(row.mean_error)}${unit}`;
  if (row.lost_frames === null) return error;
  if (row.lost_frames === 0) return `no frame lost, ${error}`;
  return `first lost in frame ${row.first_lost_frame}, ${count(row.lost_frames, "frame")} in all, ${error}`;
}
