/**
 * The live plots, drawn by BokehJS: what the experiment declares, one panel each, over one shared axis of frames. Data
 * comes in about ten times a second at the most.
 */

import { h, setText } from "../../shared/dom.js";
import { onTheme, tokens } from "../../shared/theme.js";
import { idle, throttle } from "../../shared/timing.js";
import { curve } from "../history.js";
import { samplers } from "../series.js";
import { loadBokeh } from "./bokeh.js";
import { KINDS } from "./kinds/kinds.js";

/** @import { History } from "../history.js" */
/** @import { View } from "../mount.js" */
/** @import { Store } from "../store.js" */
/** @import { BokehApi, Range } from "./bokeh_api.js" */
/** @import { Plot } from "./kinds/plot.js" */

const REDRAW_MS = 100;
/** In a narrower session the plots are a row of sparklines. */
const WIDE_PX = 1000;
/** From this width on the plots have room for names that are written out. */
const ROOMY_PX = 350;
const INKS = ["ink", "muted", "line", "lost", "hidden", "truth"];

/**
 * Where a plot stands.
 *
 * @typedef {object} Panel
 * @property {Plot} plot
 * @property {HTMLElement} section
 * @property {HTMLElement} title
 * @property {HTMLOutputElement} value The figures of the frame that is shown.
 * @property {HTMLElement} place Of its figure.
 * @property {HTMLElement} missing Says that only the truth is not known.
 */

/**
 * The scene's script goes first; then come the plots, into the place that is kept for them.
 *
 * @param {HTMLElement} root
 * @param {View} view
 */
export async function plots(root, view) {
  const { store, scene, signal } = view;
  await declared(store);
  const shown = view.plots.length > 0 ? store.known.plots.filter(({ id }) => view.plots.includes(id)) : store.known.plots;
  const panels = shown.map((plot) => panel(root, new KINDS[plot.kind](plot, store.known)));
  const label = throttle(() => {
    const histories = store.branches.map(({ id }) => store.historyOf(id));
    for (const each of panels) write(each, store, histories);
  }, REDRAW_MS, signal);
  store.on(["session", "position", "history", "branches"], label);
  label();

  // Its script has run by then; while it waits for its data and its shaders, the browser has time for the plots.
  await scene?.loaded;
  await idle();
  let Bokeh;
  try {
    Bokeh = await loadBokeh();
  } catch {
    root.append(h("p", { class: "hint" }, "The plots could not be loaded; the scrubber below shows the same curves."));
    return;
  }
  if (signal.aborted) return;
  const axis = new Bokeh.Range1d({ start: 0, end: 1 });
  for (const { plot, place } of panels) {
    plot.build(Bokeh, axis);
    if (!store.isReadOnly) plot.listen(place, view);
  }
  await show(Bokeh, panels, signal);
  if (!signal.aborted) keepDrawn(root, view, axis, panels);
}

/**
 * Draw what is in sight whenever something of it changes.
 *
 * @param {HTMLElement} root
 * @param {View} view
 * @param {Range} axis
 * @param {Panel[]} panels
 */
function keepDrawn(root, { store, signal }, axis, panels) {
  /** @type {Set<Plot>} */
  const inSight = new Set();
  const draw = throttle(() => {
    if (document.hidden) return;
    axis.end = Math.max(1, store.known.frames - 1);
    for (const plot of inSight) plot.draw(store);
  }, REDRAW_MS, signal);
  const view = root.closest(".session-view, .comparison") ?? root;
  const isLong = panels.some(({ plot }) => plot.rowTitles.length > 0);
  const shape = () => ({ isNarrow: view.clientWidth < WIDE_PX, isRoomy: isLong && root.clientWidth >= ROOMY_PX });
  let { isNarrow, isRoomy } = shape();
  let last = lastOf(panels);
  const dress = () => {
    const ink = tokens(...INKS, ...samplers(store.known).map(({ colour }) => colour));
    last = lastOf(panels);
    for (const each of panels) {
      // The last plot, and the tall ones, which may be in sight without it, say which frames these are.
      each.plot.figure.showsFrames = each === last || each.plot.rows > 1;
      each.plot.figure.isRoomy = isRoomy;
      each.plot.dress(ink, isNarrow);
    }
  };
  store.on(["session", "position", "history", "branches"], draw);
  document.addEventListener("visibilitychange", draw, { signal });
  onTheme(dress, signal);
  dress();
  const sizes = new ResizeObserver(() => {
    const now = shape();
    if (now.isNarrow === isNarrow && now.isRoomy === isRoomy) return;
    ({ isNarrow, isRoomy } = now);
    dress();
  });
  sizes.observe(view);
  // There may be more plots than there is room for; what is out of sight is drawn when it comes into sight.
  const sight = new IntersectionObserver((changes) => {
    for (const { target, isIntersecting } of changes) {
      const found = panels.find(({ place }) => place === target);
      if (found && isIntersecting) inSight.add(found.plot);
      else if (found) inSight.delete(found.plot);
    }
    if (lastOf(panels) !== last) dress();
    draw();
  });
  for (const { place } of panels) sight.observe(place);
  signal.addEventListener("abort", () => {
    sizes.disconnect();
    sight.disconnect();
  });
}

/**
 * The lowest panel that has something to draw.
 *
 * @param {Panel[]} panels
 */
function lastOf(panels) {
  return panels.filter(({ section }) => !section.hidden).at(-1);
}

/**
 * Resolves when it is known what there is to plot.
 *
 * @param {Store} store
 * @returns {Promise<void>}
 */
function declared(store) {
  return new Promise((resolve) => {
    const look = () => store.session !== null && store.session.plots.length > 0 && resolve();
    store.on(["session"], look);
    look();
  });
}

/**
 * @param {HTMLElement} root
 * @param {Plot} plot
 * @returns {Panel}
 */
function panel(root, plot) {
  const title = h("span", {});
  const value = h("output", {});
  const place = h("div", { class: "plot", role: "img", "aria-label": plot.declared.description });
  place.title = plot.rowTitles.map(([name, words]) => `${name}  ${words}`).join("\n");
  const missing = h("p", { class: "missing", hidden: true }, "the truth is not known");
  const section = h("section", { class: "panel", data: { plot: plot.id } }, h("h2", { title: plot.declared.description }, title, value), place, missing);
  if (plot.rows > 1) {
    section.classList.add("tall");
    section.style.setProperty("--rows", String(plot.rows));
  }
  root.append(section);
  return { plot, section, title, value, place, missing };
}

/**
 * @param {Panel} panel
 * @param {Store} store
 * @param {History[]} histories Of all branches.
 */
function write({ plot, section, title, value, place, missing }, store, histories) {
  const { history } = store;
  missing.hidden = !plot.declared.needs_truth || history.length === 0 || history.most(curve.error) !== null;
  // What a method does not have is not drawn; where only the truth is missing, that is said.
  section.hidden = history.length > 0 && missing.hidden && !plot.isMeasured(histories);
  const reading = plot.reading(store);
  setText(value, reading);
  if (!store.known.playing) place.setAttribute("aria-label", inWords(plot, store.known.position, reading));
  const words = plot.heading(store);
  const text = words.map((word) => (typeof word === "string" ? word : word.textContent)).join("");
  if (title.textContent !== text) title.replaceChildren(...words);
}

/**
 * What a plot shows, and its figures in the frame that is shown.
 *
 * @param {Plot} plot
 * @param {number} frame
 * @param {string} reading
 */
function inWords({ declared: { description, title, unit } }, frame, reading) {
  return reading === "" ? description : `${description} In frame ${frame} ${`${title} ${reading} ${unit}`.trim()}.`;
}

/**
 * Draw all figures as one document, since they share their axis of frames; each in its own panel.
 *
 * @param {BokehApi} Bokeh
 * @param {Panel[]} panels
 * @param {AbortSignal} signal
 */
async function show(Bokeh, panels, signal) {
  const book = new Bokeh.Document();
  // They tell of a connection to a Bokeh server, which there is not, and would stay in the page.
  book.config.notifications = null;
  for (const { plot } of panels) book.add_root(plot.figure.model);
  const views = await Bokeh.embed.add_document_standalone(book, document.body, panels.map(({ place }) => place));
  const close = () => {
    for (const view of [...views]) view.remove();
    views.clear();
    book.clear();
    const known = Bokeh.documents.indexOf(book);
    if (known >= 0) Bokeh.documents.splice(known, 1);
  };
  if (signal.aborted) close();
  else signal.addEventListener("abort", close);
}
