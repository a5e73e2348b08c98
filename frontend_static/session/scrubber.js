/** The scrubber: an overview of the run, and the way to any of its frames. Dragging shows the frame under the finger; releasing stays
 there. */

import { build, renderIn, tip } from "../shared/dom.js";
import { plainAxis, scales } from "../shared/figure/axes.js";
import { KINDS as PAINTERS, linksOver } from "../shared/figure/kinds.js";
import { within } from "../shared/figure/paint.js";
import { percent, quantity } from "../shared/format.js";
import { Explained } from "../shared/terms.js";
import { enlargement, onTheme, tokens, watchCanvasSize } from "../shared/theme.js";
import { follow, throttle } from "../shared/timing.js";
import { h, html, signal as newSignal, useEffect, useMemo, useRef } from "../vendor/preact.js";
import { KINDS, range, reader } from "./plots/kinds.js";
import { column, shades } from "./plots/plots.js";
import { eventsOf, numberOf, ofRole } from "./readings.js";
import { marks } from "./steering.js";
import { curve, isGone } from "./store.js";

/** @import { Plot, SessionPublic } from "../shared/messages.js" */
/** @import { View } from "./mount.js" */
/** @import { Kind, Shown } from "./plots/kinds.js" */
/** @import { Role } from "./readings.js" */
/** @import { Curve, Row, Store } from "./store.js" */

// The overview of a run: the error, or sigma if no truth is known, events, the probability of a loss, and bands, in rows over one axis of
// frames. Rows consist of traces, as in any figure (`shared/figure`).

/** @typedef {"flags"|"error"|"sigma"|"events"|"loss"|"bands"|"changes"} RowName */
/** @typedef {Partial<Record<RowName, [label: string, top: number, height: number]>>} Rows From top to bottom; px. */

/** Name, height and space below each row, px: from one name to the next is a line of letters. The curve takes the remaining height. */
const ROWS = /** @type {const} */ ({
  flags: ["", 12, 0],
  error: ["error", 0, 4],
  sigma: ["sigma", 0, 4],
  events: ["events", 14, 4],
  loss: ["P(lost)", 8, 5],
  bands: ["hidden, lost", 10, 2],
  changes: ["changes", 16, 2],
});
/** Overhang of lines at the edge of a row, px. */
const EDGE = 1;
/** Opacity of the least probable loss. */
const FAINTEST = 0.4;
const INKS = ["ink", "muted", "well", "hidden", "lost"];

class Memory {
  #store;
  #hidden = shades("hidden", 0.55, (row) => row.hidden === true);
  #lost = shades("lost", 1, isGone);
  /** @type {Record<"error"|"sigma", Kind>|null} */
  #plots = null;
  /** Width of a frame, px. */
  #px = 1;
  rows = newSignal(/** @type {Rows} */ ({}));
  /** @type {Record<string, string>|null} The colours as they are now; null to ask for them anew. */
  ink = null;

  /** @param {Store} store */
  constructor(store) {
    this.#store = store;
  }

  /** Paint the rows that have content.
   *
   * @param {HTMLCanvasElement} canvas The canvas; its font size sets the sizes.
   */
  paint(canvas) {
    const { session } = this.#store;
    const pen = canvas.getContext("2d");
    if (session === null || pen === null || canvas.clientWidth === 0) return;
    const unit = enlargement(canvas);
    const [width, height] = [canvas.clientWidth / unit, canvas.clientHeight / unit];
    this.#px = width / Math.max(1, session.frames - 1);
    this.rows.value = this.#arranged(height);
    this.ink ??= tokens(...INKS, ...ofRole(session, "event").flatMap(({ colours }) => colours));
    canvas.width = Math.round(canvas.clientWidth * devicePixelRatio);
    canvas.height = Math.round(canvas.clientHeight * devicePixelRatio);
    pen.scale(canvas.width / width, canvas.height / height);
    const x = plainAxis({ low: 0, high: Math.max(1, session.frames - 1) });
    for (const [name, content] of Object.entries(this.#content(session))) {
      const [, top, high] = this.rows.value[/** @type {RowName} */ (name)] ?? ["", 0, 0];
      if (high === 0) continue;
      const { traces, y } = content();
      const [axes, box] = [{ x, y: plainAxis(y) }, { left: 0, top, width, height: high }];
      const sheet = { pen, box, ...scales(axes, box), axes, ink: this.ink, unit: 1, cased: false };
      pen.fillStyle = this.ink.well;
      pen.fillRect(0, top, width, high);
      within(sheet, EDGE, () => traces.forEach((trace) => PAINTERS[trace.kind].paint(sheet, trace, traces)));
    }
  }

  /** The rows with content in some frame: a recording without truth has no error. Until a frame is computed nothing is known about the
   * curve, and its room is kept.
   *
   * @param {number} height
   */
  #arranged(height) {
    const { known, history } = this.#store;
    const isMeasured = (/** @type {Role} */ role) => ofRole(known, role).some(({ name }) => history.measures(name));
    const isDrawn = (/** @type {Curve} */ read) => history.length === 0 || range(this.#store, [read])[0] < Infinity;
    const isHidden = history.some(({ hidden }) => typeof hidden === "boolean") && "hidden";
    const gone = [isHidden, history.some((row) => Boolean(row.lost_by)) && "lost"].filter(Boolean).join(", ");
    const hasError = isDrawn(curve.error);
    /** @type {Record<RowName, boolean>} */
    const has = {
      flags: true,
      error: hasError,
      sigma: !hasError && isDrawn(curve.sigma),
      events: isMeasured("event"),
      // In the first frame no tracker can have lost its target, so rows that begin with the next frame get their room.
      loss: isMeasured("loss_probability") || (history.length <= 1 && ofRole(known, "loss_probability").length > 0),
      bands: history.length === 0 || gone !== "",
      changes: true,
    };
    const shown = /** @type {RowName[]} */ (Object.keys(ROWS)).filter((name) => has[name]);
    const hasLimits = known.thresholds.some(({ of }) => of === "sigma");
    return placed(shown, height, { bands: gone, ...(hasLimits && { sigma: "sigma | limit" }) });
  }

  /** The traces of the rows, from back to front: as in the plots, or only for the active branch.
   *
   * @param {SessionPublic} session
   * @returns {Partial<Record<RowName, () => Pick<Shown, "traces"|"y">>>}
   */
  #content(session) {
    const store = this.#store;
    const { history } = store;
    const plot = /** @type {Plot} */ ({ id: "", title: "", unit: session.unit });
    this.#plots ??= { error: KINDS.error(plot, session), sigma: KINDS.sigma(plot, session) };
    const { error, sigma } = this.#plots;
    return {
      error: () => error.show(store, false),
      sigma: () => sigma.show(store, false),
      loss: () => this.#probabilities(session),
      events: () => {
        const all = ofRole(session, "event");
        const traces = all.map(({ name, colours: [ink = "ink"] }, place) => {
          const frames = column(history, reader(name)).flatMap((value, frame) => (value > 0 ? [frame] : []));
          const links = frames.map((x) => ({ x0: x, y0: all.length - place, x1: x, y1: all.length - place - 1, opacity: 1 }));
          return linksOver({ ink, width: Math.max(2, Math.min(5, this.#px)), links });
        });
        return { traces, y: { low: 0, high: all.length } };
      },
      bands: () => {
        const { losses } = store;
        // A loss is translucent and leaves the neighbouring lane visible.
        const apart = losses.length === 1 ? 0.2 : 0.1;
        const traces = losses.map(({ history: own, colour: ink }, place) => {
          const lane = losses.length - place;
          const trace = this.#lost(own);
          return { ...trace, ink, intervals: trace.intervals.map((each) => ({ ...each, low: lane - 1 + apart, high: lane - apart })) };
        });
        return { traces: [this.#hidden(history), ...traces], y: { low: 0, high: losses.length } };
      },
    };
  }

  /** The probability of a loss in each frame, by height and opacity, so not by colour alone. If a run has more frames than pixels, the
   * largest value of each pixel is drawn, so that no peak is lost.
   *
   * @param {SessionPublic} session
   */
  #probabilities(session) {
    const values = column(this.#store.history, (row) => numberOf(session, "loss_probability", row));
    const every = Math.max(1, Math.floor(1 / this.#px));
    const links = Array.from({ length: Math.ceil(values.length / every) }, (_, place) => {
      const most = Math.max(...values.slice(every * place, every * (place + 1)).map((value) => (Number.isNaN(value) ? -Infinity : value)));
      return { x0: every * place, y0: 0, x1: every * place, y1: most, opacity: FAINTEST + (1 - FAINTEST) * most };
    });
    return { traces: [linksOver({ ink: "lost", width: every * this.#px, links: links.filter(({ y1 }) => y1 >= 0) })], y: { low: 0, high: 1 } };
  }
}

/** Place the shown rows. The curve takes the remaining height.
 *
 * @param {readonly RowName[]} shown
 * @param {number} height Height of all rows.
 * @param {Partial<Record<RowName, string>>} [names] Names of some rows.
 * @returns {Rows}
 */
export function placed(shown, height, names = {}) {
  const spare = height - shown.reduce((sum, name) => sum + ROWS[name][1] + ROWS[name][2], 0);
  /** @type {Rows} */
  const rows = {};
  let top = 0;
  for (const name of shown) {
    const [label, own, free] = ROWS[name];
    const tall = own || spare;
    rows[name] = [names[name] ?? label, top, tall];
    top += tall + free;
  }
  return rows;
}

// The scrubber on the page: the picture, marks over it, and the handling of the pointer.

const REPAINT_MS = 100;

/**
 * Put the scrubber into a place.
 *
 * @param {HTMLElement} root
 * @param {View} view
 */
export function scrubber(root, view) {
  renderIn(root, h(Scrubber, { view }), view.signal);
}

/** @param {{view: View}} props */
function Scrubber({ view }) {
  const { store } = view;
  const { session } = store;
  const memory = useMemo(() => new Memory(store), []);
  const rows = memory.rows.value;
  const position = view.steering.goal.value ?? session?.position ?? 0;
  const words = session === null ? "" : describe(store, position).join(", ");
  const names = Object.values(rows).filter(([label]) => label !== "");
  const top = rows.changes?.[1] ?? 0;
  const at = (/** @type {number} */ frame) => `left: ${share(frame, session)}; height: ${em(top)}`;
  return html`
    <div
      class="scrubber small-print" role="slider" tabindex="0" data-rows=${Object.keys(rows).join(" ")} aria-label="Position in the run"
      aria-valuemin="0" aria-valuemax=${(session?.frames ?? 1) - 1} aria-valuenow=${position} aria-valuetext=${words} ...${usePointer(view)}
    >
      <div class="scrubber-frames" aria-hidden="true">
        <canvas class="scrubber-canvas" ref=${usePainted(view, memory)}></canvas>
        ${session !== null && h(Marks, { session, top })}
        ${session !== null && session.computed > position && html`<i class="scrubber-computed" style=${at(session.computed)}></i>`}
        <i class="scrubber-position" style=${at(position)}></i>
      </div>
    </div>
    <ul class="scrubber-rows small-print">
      ${names.map(([label, above, height]) => html`<li key=${label} style=${`top: ${em(above + height / 2)}`}>
        ${h(Explained, { text: label, experiment: session?.recipe.experiment })}
      </li>`)}
    </ul>
  `;
}

/** Painting on the canvas: it follows the run, the available room, and the colours.
 *
 * @param {View} view
 * @param {Memory} memory
 */
function usePainted({ store, signal }, memory) {
  const canvas = useRef(/** @type {HTMLCanvasElement|null} */ (null));
  useEffect(() => {
    const paint = () => canvas.current && memory.paint(canvas.current);
    const soon = throttle(paint, REPAINT_MS, signal);
    follow(() => [store.session?.timeline, store.session?.branch, store.lengths], soon, signal);
    if (canvas.current) watchCanvasSize(canvas.current, soon, signal);
    onTheme(() => {
      memory.ink = null;
      paint();
    }, signal);
  }, []);
  return canvas;
}

/** Dragging, and the tooltip of the pointer.
 *
 * @param {View} view
 */
function usePointer(view) {
  useEffect(() => () => tip.hide(), []);
  const frameAt = (/** @type {PointerEvent & {currentTarget: HTMLElement}} */ { currentTarget, clientX }) => {
    const { left, width } = /** @type {Element} */ (currentTarget.firstElementChild).getBoundingClientRect();
    const last = (view.store.session?.frames ?? 1) - 1;
    return Math.min(Math.max(0, Math.round(((clientX - left) / width) * last)), last);
  };
  return {
    onPointerDown: (/** @type {PointerEvent & {currentTarget: HTMLElement}} */ event) => {
      if (event.button !== 0 || !view.store.isSteerable) return;
      event.currentTarget.setPointerCapture(event.pointerId);
      view.steering.seek(frameAt(event));
    },
    onPointerMove: (/** @type {PointerEvent & {currentTarget: HTMLElement, target: HTMLElement}} */ event) => {
      const { clientX: x, currentTarget, pointerId, target } = event;
      if (view.store.session === null) return;
      const frame = frameAt(event);
      if (currentTarget.hasPointerCapture(pointerId) && frame !== view.steering.frame) view.steering.seek(frame);
      const { top, bottom } = currentTarget.getBoundingClientRect();
      const lines = target.dataset.said?.split("\n") ?? [describe(view.store, frame).join(" · ")];
      tip.show(lines.map((line) => build("div", {}, line)), { x, y: top, below: bottom });
    },
    onPointerLeave: () => tip.hide(),
  };
}

/** Bookmarks as flags, and changes as diamonds, labelled if there is room.
 *
 * @param {{session: SessionPublic, top: number}} props `top` of the row of changes, px of the scrubber.
 */
function Marks({ session, top }) {
  const { bookmarks, branch, frames } = session;
  const flags = bookmarks.filter((mark) => !mark.branch || mark.branch === branch);
  const changes = marks(session);
  return html`
    ${flags.map(({ frame, note }) => {
      const said = `frame ${frame}\n${note || "bookmark"}`;
      return html`<i class="scrubber-flag" data-said=${said} style=${`left: ${share(frame, session)}`}></i>`;
    })}
    ${changes.map(({ frame, lines: [first, ...others] }, place) => {
      const room = share((changes[place + 1]?.frame ?? frames - 1) - frame, session);
      const said = [`from frame ${frame}`, first, ...others].join("\n");
      return html`<span class="scrubber-change" data-said=${said} style=${`left: ${share(frame, session)}; top: ${em(top)}; width: ${room}`}>
        <span>${others.length > 0 ? `${first}, …` : first}</span>
      </span>`;
    })}
  `;
}

/**
 * @param {number} frames Number of all frames.
 * @param {{frames: number}|null} session
 */
function share(frames, session) {
  return `${(100 * frames) / Math.max(1, (session?.frames ?? 1) - 1)}%`;
}

/** Lengths grow with the letters, which are 11 px high at the page's usual size.
 *
 * @param {number} px Length in the scrubber.
 */
function em(px) {
  return `${px / 11}em`;
}

/**
 * A frame in words.
 *
 * @param {Store} store
 * @param {number} frame
 * @returns {string[]}
 */
function describe({ known: session, history }, frame) {
  const row = history.at(frame);
  if (!row) return [`frame ${frame}`, "not computed yet"];
  const { unit } = session;
  const numbers = /** @type {const} */ (["error", "sigma"]).map((name) => {
    const value = curve[name](row);
    return value === null ? "" : `${name} ${quantity(value, unit)} ${unit}`.trim();
  });
  const probability = numberOf(session, "loss_probability", row);
  const loss = probability === null ? "" : `lost with ${percent(probability)}`;
  const events = eventsOf(session, row).map(({ title }) => title);
  return [`frame ${frame}`, ...numbers, seen(row, session.target), loss, ...events].filter(Boolean);
}

/**
 * @param {Row} row
 * @param {string} target
 */
function seen(row, target) {
  if (row.searching) return `no ${target}`;
  if (isGone(row)) return "lost";
  return row.hidden ? "hidden" : "";
}
