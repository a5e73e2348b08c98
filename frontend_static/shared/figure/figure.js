/** The figure of all pages: panels in rows, for a lesson's figure or a run's data. Curves, points and pictures are painted on a canvas,
 which takes 20,000 points in a few milliseconds; text and controls are elements of the page, which can be read, focused and enlarged. */

import { html, useLayoutEffect, useRef } from "../../vendor/preact.js";
import { build, fill, tip } from "../dom.js";
import { onTheme, tokens, watchCanvasSize } from "../theme.js";
import { LOOKS } from "./paint.js";
import { PanelView } from "./panel.js";

/** @import { Child } from "../elements.js" */
/** @import { Style } from "./axes.js" */
/** @import { Mark } from "./handle.js" */
/** @import { Cell, Figure, Panel } from "./traces.js" */

/** @typedef {{title: string, unit: string, minimum: number|null, maximum: number|null, step: number|null}} Declared */

/** Callbacks for a person's actions in the figure.
 *
 * @typedef {object} Listener
 * @property {(parameter: string, value: number) => void} [turn] A handle was moved.
 * @property {(value: number) => void} [place] The requested mark was placed there.
 * @property {(cell: Cell) => Child} [describe] Returns the tooltip of a cell.
 * @property {(cell: Cell) => void} [choose] A cell was chosen.
 * @property {(parameter: string) => Declared|undefined} [declared] Returns the declaration of a handle's parameter; missing parts come from
 its axis. */

/** The look of a figure in its page.
 *
 * @typedef {object} Setting
 * @property {number} [letters] Size of the letters, relative to the page's.
 * @property {boolean} [isCompact] Whether it fits into any room, however small.
 * @property {string[]} [inks] Further colours of its traces, by token.
 */

/** A figure below the first width, or with panels below the second, stacks them; in units of the size of the letters. */
const [NARROW, NARROW_PANEL] = [34, 19];
const SMALLER = 13 / 16;
const FURNITURE = /** @type {const} */ (["ink", "muted", "line", "edge", "surface", "accent"]);

export class FigureView {
  #shared;
  #look;
  #isCompact;
  #root = build("div", { class: "figure-view" });
  /** An element whose width is the page's font size, so that a change of it is observed. */
  #letter = build("span", { class: "figure-letter", "aria-hidden": "true" });
  /** @type {Map<string, PanelView>} */
  #views = new Map();
  /** @type {Figure|null} */
  #figure = null;
  /** @type {Style|null} */
  #style = null;
  #made = "";
  #asked = 0;
  #locked = false;
  /** @type {{panel: string, along: "x"|"y"}|null} */
  #ask = null;
  /** @type {Mark|null} */
  #mark = null;

  /**
   * @param {HTMLElement} place Element that sets the figure's size.
   * @param {Listener} on
   * @param {AbortSignal} signal Its abort removes the figure.
   * @param {Setting} [setting]
   */
  constructor(place, on, signal, { letters = SMALLER, inks = [], isCompact = false } = {}) {
    this.#look = { inks };
    this.#isCompact = isCompact;
    this.#root.classList.toggle("compact", isCompact);
    this.#root.style.fontSize = `max(${letters}rem, var(--least))`;
    this.#shared = { on, signal };
    fill(place, this.#root, this.#letter);
    watchCanvasSize(place, () => this.#draw(), signal);
    watchCanvasSize(this.#letter, () => this.#dress(), signal);
    onTheme(() => this.#dress(), signal);
    signal.addEventListener("abort", () => {
      tip.hide();
      this.#root.remove();
      this.#letter.remove();
    });
  }

  /** Show a figure in place of the previous one.
   *
   * @param {Figure} figure
   * @param {{locked: boolean}} options Whether its handles are locked.
   */
  show(figure, { locked }) {
    if (this.#shared.signal.aborted) return;
    this.#asked += 1;
    this.#figure = figure;
    this.#locked = locked;
    // For tests, and for the browser's console.
    Object.assign(this.#root, { figure });
    this.#draw();
  }

  /** The panel at a place of the page, and the values there; null if there is none.
   *
   * @param {{clientX: number, clientY: number}} place
   */
  valuesAt(place) {
    return [...this.#views.values()].map((view) => view.valuesAt(place)).find((found) => found !== null) ?? null;
  }

  /** The margins around a panel's box, px; null if it has not been drawn.
   *
   * @param {string} panel
   */
  around(panel) {
    return this.#views.get(panel)?.around ?? null;
  }

  /** Ask a person to place a mark in a panel.
   *
   * @param {{panel: string, along: "x"|"y"}|null} ask Null ends it.
   */
  ask(ask) {
    this.#ask = ask;
    this.#draw();
  }

  /** Show the placed and the exact value together.
   *
   * @param {Mark|null} mark
   */
  mark(mark) {
    this.#mark = mark;
    this.#draw();
  }

  #dress() {
    this.#style = null;
    this.#draw();
  }

  #draw() {
    const figure = this.#figure;
    if (figure === null || !this.#root.clientWidth) return;
    const style = (this.#style ??= styleOf(this.#root, this.#look));
    const beside = Math.max(...rowsOf(figure.panels).map(({ length }) => length));
    const isNarrow = !this.#isCompact && this.#root.clientWidth < Math.max(NARROW, NARROW_PANEL * beside) * style.em;
    this.#make(figure, isNarrow);
    for (const panel of figure.panels) this.#view(panel).take(panel, style);
    const prepared = columnsOf(figure, isNarrow).map(({ panel, column, sharesX }) => {
      const view = this.#view(panel);
      return { view, column, margins: view.measure(style, sharesX) };
    });
    for (const { view, column, margins } of prepared) {
      const above = prepared.filter((each) => each.column === column);
      const [left, right] = /** @type {const} */ (["left", "right"]).map((side) => Math.max(...above.map((each) => each.margins[side])));
      const { id } = view.panel;
      const ask = this.#ask?.panel === id ? this.#ask : null;
      const mark = this.#mark?.panel === id ? this.#mark : null;
      view.draw({ left, right, bottom: margins.bottom }, style, { locked: this.#locked, ask, mark });
    }
    this.#root.dataset.shown = String(this.#asked);
  }

  /**
   * Make the panels of the figure, or keep them if these are the same.
   *
   * @param {Figure} figure
   * @param {boolean} isNarrow
   */
  #make({ panels }, isNarrow) {
    this.#root.classList.toggle("narrow", isNarrow);
    const made = JSON.stringify(panels.map(({ id, row, share }) => [id, row, share]));
    if (made === this.#made) return;
    this.#made = made;
    tip.hide();
    this.#views = new Map(panels.map((panel) => [panel.id, new PanelView(panel, this.#shared)]));
    const heights = rowsOf(panels).map((row) => Math.max(...row.map(({ share }) => share[0])));
    const rows = rowsOf(panels).map((row, number) => {
      const element = build("div", { class: "figure-row" }, row.map((panel) => this.#view(panel).element));
      element.style.setProperty("--share", String(heights[number]));
      element.style.setProperty("--tall", String(heights[number] / Math.max(...heights)));
      for (const panel of row) this.#view(panel).element.style.setProperty("--share", String(panel.share[1]));
      return element;
    });
    fill(this.#root, rows);
  }

  /** @param {Panel} panel */
  #view({ id }) {
    return /** @type {PanelView} */ (this.#views.get(id));
  }
}

/** @param {readonly Panel[]} panels */
function rowsOf(panels) {
  const numbers = [...new Set(panels.map(({ row }) => row))].sort((one, other) => one - other);
  return numbers.map((number) => panels.filter(({ row }) => row === number));
}

/** The panels of each column: they have the same margins, and a shared axis is numbered once.
 *
 * @param {Figure} figure
 * @param {boolean} isNarrow
 */
function columnsOf({ panels }, isNarrow) {
  const rows = rowsOf(panels);
  return rows.flatMap((row, number) =>
    row.map((panel, place) => {
      const next = rows[number + 1];
      const below = next?.length === row.length && !(isNarrow && row.length > 1) ? next[place] : undefined;
      const sharesX = JSON.stringify(panel.x) === JSON.stringify(below?.x);
      return { panel, column: isNarrow ? "all" : `${place} of ${row.map(({ share }) => share[1]).join(" ")}`, sharesX };
    }),
  );
}

/** The present colours and letters.
 *
 * @param {HTMLElement} element
 * @param {{inks: string[]}} look
 * @returns {Style}
 */
function styleOf(element, { inks }) {
  const { fontSize, fontFamily } = getComputedStyle(element);
  const em = parseFloat(fontSize);
  const pen = new OffscreenCanvas(1, 1).getContext("2d");
  if (pen !== null) pen.font = `${em}px ${fontFamily}`;
  const wide = (/** @type {string} */ text) => pen?.measureText(text).width ?? 0;
  return { ink: tokens(...FURNITURE, ...Object.keys(LOOKS), ...inks), em, wide };
}

/** A hook for components: the figure's place, and the figure once it exists.
 *
 * @param {Listener} on
 * @param {Setting} [setting]
 */
export function useFigure(on, setting) {
  const room = useRef(/** @type {HTMLElement|null} */ (null));
  const figure = useRef(/** @type {FigureView|null} */ (null));
  useLayoutEffect(() => {
    const end = new AbortController();
    figure.current = room.current && new FigureView(room.current, on, end.signal, setting);
    return () => end.abort();
  }, []);
  return { room, figure };
}

/** Letters of a still figure, relative to the page's. */
const SMALL = 11 / 16;

/** A small figure without handles: panels one above the other.
 *
 * @param {{kind: string, words: string, panels: readonly Pick<Panel, "x"|"y"|"traces">[]}} props `kind` is a class of the style
 *     sheet, the words are for screen readers.
 */
export function StillFigure({ kind, words, panels }) {
  const { room, figure } = useFigure({}, { isCompact: true, letters: SMALL });
  useLayoutEffect(() => {
    /** @type {Panel[]} */
    const all = panels.map((panel, row) => ({ id: String(row), title: "", words: "", handles: [], row, share: [1, 1], ...panel }));
    figure.current?.show({ panels: all }, { locked: true });
  }, [panels]);
  return html`<div ref=${room} class=${kind} role="img" aria-label=${words}></div>`;
}
