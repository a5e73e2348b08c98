/**
 * Lines across a panel at values: handles, which are moved by pointer, touch or keys; the one with which a person places a prediction; and
 the marks of the prediction and the exact value. */

import { h, html, useRef, useSignal } from "../../vendor/preact.js";
import { step } from "../dom.js";
import { ends, even, inPx, valueOn } from "./axes.js";

/** @import { Box, Scale } from "./axes.js" */
/** @import { Axis } from "./traces.js" */

/**
 * @typedef {object} Bounds What a grip may be moved to.
 * @property {number} low
 * @property {number} high
 * @property {number} step Step, in decades on a logarithmic axis.
 * @property {boolean} log
 */

/** The place of a handle, and its axis.
 *
 * @typedef {object} Stand
 * @property {Box} box
 * @property {Scale} scale
 * @property {Axis} axis
 * @property {"x"|"y"} along
 * @property {number} at
 * @property {Bounds} bounds
 * @property {string} title
 * @property {boolean} locked
 */

/** Default step, as a share of the axis. */
const STEPS = 400;
/** Digits of a value on a logarithmic axis. */
const DIGITS = 4;
/** Width of a slider's thumb, px; the style sheet has the same. */
const FINGER = 24;

/**
 * A slider over the panel with a line across it. While held, it stays where the person puts it; afterwards it follows
 * `stand`.
 *
 * @param {{stand: Stand, parameter?: string, words?: string, tell?: (value: number) => void}} props `stand` is a new object each
 *     time the panel is drawn; `words` replace the spoken value; `tell` gets each new value, and without it the line is fixed.
 */
export function Handle({ stand, parameter, words, tell }) {
  const { box, scale, axis, along, bounds: { low, high, step: size, log }, title, locked } = stand;
  const own = useSignal({ stand, at: stand.at });
  const isHeld = useRef(false);
  // A handle locked while held gets no release event.
  if (locked) isHeld.current = false;
  const at = isHeld.current || own.value.stand === stand ? own.value.at : stand.at;
  const bent = (/** @type {number} */ value) => (log ? Math.log10(value) : value);
  const [from, to] = [scale.at(low), scale.at(high)];
  const track = { start: Math.min(from, to) - FINGER / 2, length: Math.abs(to - from) + FINGER };
  const room = along === "x" ? { ...box, left: track.start, width: track.length } : { ...box, top: track.start, height: track.length };
  const take = (/** @type {{currentTarget: HTMLInputElement}} */ { currentTarget: { valueAsNumber: taken } }) => {
    isHeld.current = true;
    const value = log ? Number((10 ** taken).toPrecision(DIGITS)) : taken;
    own.value = { stand, at: value };
    tell?.(value);
  };
  const press = (/** @type {KeyboardEvent & {currentTarget: HTMLInputElement}} */ event) => {
    const [way, { value: before }] = [step(event), event.currentTarget];
    if (way === null) return;
    // The up key moves up, even if the axis points down.
    const up = along === "y" && from < to ? way[1] : -way[1];
    event.currentTarget.stepUp(way[0] + up);
    if (event.currentTarget.value !== before) take(event);
  };
  const release = () => (isHeld.current = false);
  const shown = valueOn(axis, at, log ? undefined : size);
  const range = { min: bent(low), max: bent(high), step: size, value: bent(at), disabled: locked || !tell, dir: from > to ? "rtl" : "ltr" };
  const names = { "data-along": along, "data-parameter": parameter, "aria-label": title || axis.title, "aria-valuetext": words ?? shown };
  const hears = { onInput: take, onKeyDown: press, onChange: release, onKeyUp: release, onPointerUp: release, onPointerCancel: release, onBlur: release };
  return html`
    <input type="range" class="figure-grip" style=${inPx(room)} ...${range} ...${names} ...${hears} />
    <div class="figure-line" aria-hidden="true" ...${across(box, along, scale.at(at))}>
      ${tell && html`<span class="figure-knob"></span>`}<span class="figure-flag">${`${title} ${shown}`.trim()}</span>
    </div>
  `;
}

/** Placing a prediction in a panel: a person puts a line where they expect the answer, by pointer, touch or keys.
 *
 * @param {{stand: Stand, place: (value: number) => void}} props `stand` is the line's first place.
 */
export function PlaceQuestion({ stand, place }) {
  const placed = useSignal(/** @type {number|null} */ (null));
  const isPlaced = placed.value !== null;
  const tell = (/** @type {number} */ value) => {
    placed.value = value;
    place(value);
  };
  // The first position is also a prediction once a person chooses it; the slider itself reports only changes.
  const choose = (/** @type {Event & {target: Element}} */ { target }) => isPlaced || target.dispatchEvent(new Event("input"));
  const press = (/** @type {KeyboardEvent & {target: Element}} */ event) => {
    if (event.key !== "Enter" && event.key !== " ") return;
    event.preventDefault();
    choose(event);
  };
  return html`<div class="figure-asking" data-placed=${isPlaced || null} onClick=${choose} onKeyDown=${press}>
    <p class="figure-hint" aria-hidden="true" style=${inPx(stand.box)}><span>Place your prediction here</span></p>
    ${h(Handle, { stand: { ...stand, at: placed.value ?? stand.at }, words: isPlaced ? undefined : "not placed yet", tell })}
  </div>`;
}

/** Allowed values of a handle: those of its parameter on the axis, or the whole axis.
 *
 * @param {Axis} axis
 * @param {{minimum: number|null, maximum: number|null, step: number|null}} [declared]
 * @returns {Bounds}
 */
export function boundsOf(axis, declared) {
  const [low, high] = ends(axis);
  const { minimum, maximum, step: size } = declared ?? {};
  if (!size) return { low, high, step: even(axis.log ? { low: Math.log10(low), high: Math.log10(high) } : axis, STEPS).step, log: axis.log };
  const start = minimum ?? low;
  const first = start + Math.max(0, Math.ceil((low - start) / size)) * size;
  return { low: first, high: Math.max(first, Math.min(maximum ?? high, high)), step: size, log: false };
}

/** @typedef {{panel: string, along: "x"|"y", at: number, exact: number}} Mark What was placed, and what is exact. */

/** The text of a mark.
 *
 * @param {Mark} mark
 * @param {Axis} axis
 */
export function wordsOf({ at, exact }, axis) {
  return `your prediction ${valueOn(axis, at)}, exactly ${valueOn(axis, exact)}`;
}

/**
 * @param {Mark} mark
 * @param {Axis} axis
 * @param {Scale} scale
 * @param {Box} box
 */
export function markLines({ along, at, exact }, axis, scale, box) {
  const both = /** @type {const} */ ([["placed", "your prediction", at], ["exact", "exactly", exact]]);
  return both.map(([name, title, value]) => html`<div class=${`figure-mark ${name}`} aria-hidden="true" ...${across(box, along, scale.at(value))}>
    <span class="figure-flag">${title} ${valueOn(axis, value)}</span>
  </div>`);
}

/** The style that puts a line across a box.
 *
 * @param {Box} box
 * @param {"x"|"y"} along
 * @param {number} at px
 */
function across({ left, top, width, height }, along, at) {
  const place = along === "x" ? { left: at, top, height, width: 0 } : { left, top: at, width, height: 0 };
  // Its label stays within the panel.
  const isFar = along === "x" ? at > left + width / 2 : at < top + height / 2;
  return { style: inPx(place), "data-along": along, "data-far": isFar || null };
}
