/**
 * The live plots: what the experiment declares, one figure each, over one shared axis of frames. Data comes in about ten
 * times a second at the most. The axis can be looked at more closely, in all plots at once (`zoom.js`).
 */

import { Alignment, FigureView } from "../../shared/figure/figure.js";
import { h, setText } from "../../shared/dom.js";
import { explain } from "../../shared/terms.js";
import { coalesce, throttle } from "../../shared/timing.js";
import { curve } from "../history.js";
import { samplers } from "../series.js";
import { KINDS } from "./kinds/kinds.js";
import { Zoom } from "./zoom.js";

/** @import { History } from "../history.js" */
/** @import { View } from "../mount.js" */
/** @import { Store } from "../store.js" */
/** @import { Plot } from "./kinds/plot.js" */

const REDRAW_MS = 100;
/** In a narrower session the plots are a row of sparklines. */
const WIDE_PX = 1000;
/** From this width on the plots have room for names that are written out. */
const ROOMY_PX = 350;
/** What is drawn of a session, and said beside the plots. */
const DRAWN = /** @type {const} */ (["branch", "branches", "history", "parameters", "position", "playing", "thresholds", "tracker"]);
/** Of the numbers at the axes, in the size of the page's letters. */
const LETTERS = 11 / 16;

/**
 * Where a plot stands.
 *
 * @typedef {object} Panel
 * @property {Plot} plot
 * @property {FigureView} figure
 * @property {HTMLElement} section
 * @property {HTMLElement} title
 * @property {HTMLOutputElement} value The figures of the frame that is shown.
 * @property {HTMLElement} place Of its figure.
 * @property {HTMLElement} missing Says that only the truth is not known.
 */

/**
 * @param {HTMLElement} root
 * @param {View} view
 */
export async function plots(root, view) {
  const { store, signal } = view;
  await declared(store);
  if (signal.aborted) return;
  const shown = view.plots.length > 0 ? store.known.plots.filter(({ id }) => view.plots.includes(id)) : store.known.plots;
  const setting = { isCompact: true, letters: LETTERS, inks: samplers(store.known).map(({ colour }) => colour), alignment: new Alignment() };
  const panels = shown.map((plot) => panel(root, new KINDS[plot.kind](plot, store.known), (place) => new FigureView(place, {}, signal, setting)));
  const label = throttle(() => {
    const histories = store.branches.map(({ id }) => store.historyOf(id));
    for (const each of panels) write(each, store, histories);
  }, REDRAW_MS, signal);
  store.on(DRAWN, label);
  label();
  // The figures of a frame are shown with its picture; what is drawn comes a little later.
  const tell = coalesce(() => {
    for (const { plot, value } of panels) setText(value, plot.reading(store));
  }, signal);
  store.on(DRAWN, tell);
  tell();
  if (!store.isReadOnly) for (const { plot, figure, place } of panels) plot.listen(place, figure, view);
  keepDrawn(root, view, panels);
}

/**
 * Draw what is in sight whenever something of it changes.
 *
 * @param {HTMLElement} root
 * @param {View} view
 * @param {Panel[]} panels
 */
function keepDrawn(root, { store, signal }, panels) {
  /** @type {Set<Panel>} */
  const inSight = new Set();
  const view = root.closest(".session-view, .comparison") ?? root;
  const isLong = panels.some(({ plot }) => plot.rowTitles.length > 0);
  const shape = () => ({ isSparkline: view.clientWidth < WIDE_PX, isRoomy: isLong && root.clientWidth >= ROOMY_PX });
  const draw = throttle(() => {
    if (document.hidden) return;
    const last = lastOf(panels);
    const look = { ...shape(), frames: zoom.within(Math.max(1, store.known.frames - 1)) };
    for (const each of inSight) {
      // The last plot, and the tall ones, which may be in sight without it, say which frames these are.
      const showsFrames = each === last || each.plot.rows > 1;
      each.figure.show({ panels: [each.plot.panel(store, { ...look, showsFrames })] }, { locked: true });
    }
  }, REDRAW_MS, signal);
  const zoom = new Zoom(draw);
  // What scrolls can be scrolled, and looked at more closely, by keys as well.
  for (const [name, value] of Object.entries({ tabindex: "0", role: "group", "aria-label": "Plots" })) root.setAttribute(name, value);
  zoom.listenToKeys(root, () => store.known.position, signal);
  store.on(DRAWN, draw);
  document.addEventListener("visibilitychange", draw, { signal });
  const sizes = new ResizeObserver(draw);
  sizes.observe(view);
  // There may be more plots than there is room for; what is out of sight is drawn when it comes into sight.
  const sight = new IntersectionObserver((changes) => {
    for (const { target, isIntersecting } of changes) {
      const found = panels.find(({ place }) => place === target);
      if (found && isIntersecting) inSight.add(found);
      else if (found) inSight.delete(found);
    }
    draw();
  });
  for (const { plot, figure, place } of panels) {
    sight.observe(place);
    zoom.listen(place, (event) => figure.valuesAt(plot.id, event)?.x ?? null, signal);
  }
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
 * @param {(place: HTMLElement) => FigureView} draw
 * @returns {Panel}
 */
function panel(root, plot, draw) {
  const title = h("span", {});
  const value = h("output", {});
  const place = h("div", { class: "plot", role: "img", "aria-label": plot.declared.description });
  place.title = plot.rowTitles.map(([name, words]) => `${name}  ${words}`).join("\n");
  const missing = h("p", { class: "missing", hidden: true }, "the truth is not known");
  const section = h("section", { class: "panel", data: { plot: plot.id } }, h("h2", {}, title, value), place, missing);
  if (plot.rows > 1) {
    section.classList.add("tall");
    section.style.setProperty("--rows", String(plot.rows));
  }
  root.append(section);
  return { plot, figure: draw(place), section, title, value, place, missing };
}

/**
 * @param {Panel} panel
 * @param {Store} store
 * @param {History[]} histories Of all branches.
 */
function write({ plot, section, title, place, missing }, store, histories) {
  const { history } = store;
  missing.hidden = !plot.declared.needs_truth || history.length === 0 || history.most(curve.error) !== null;
  // What a method does not have is not drawn; where only the truth is missing, that is said.
  section.hidden = history.length > 0 && missing.hidden && !plot.isMeasured(histories);
  if (!store.known.playing) place.setAttribute("aria-label", inWords(plot, store.known.position, plot.reading(store)));
  const words = plot.heading(store);
  const text = words.map((word) => (typeof word === "string" ? word : word.textContent)).join("");
  if (title.textContent === text) return;
  title.replaceChildren(...words);
  explain(title, { own: plot.declared.description, experiment: store.known.recipe.experiment });
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
