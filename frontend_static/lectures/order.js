/** The order of a lecture: a list whose lines move by dragging their handles, by arrow keys on the handles, or by buttons. */

import { Icon, IconButton } from "../shared/dom.js";
import { h, html, useLayoutEffect, useRef, useSignal } from "../vendor/preact.js";

/** @import { LectureItemPublic } from "../shared/messages.js" */

/** @typedef {LectureItemPublic & {key: number}} Entry An item with a unique key. */

const KINDS = { lesson: "Lesson", failure: "Failure", session: "Session", comparison: "Comparison", question: "Question", poll: "Poll" };
const MOST_MINUTES = 180;

/**
 * A list in which one entry has another place.
 *
 * @template T
 * @param {readonly T[]} list
 * @param {number} from
 * @param {number} to
 * @returns {T[]}
 */
export function moved(list, from, to) {
  const rest = list.filter((_, place) => place !== from);
  return [...rest.slice(0, to), list[from], ...rest.slice(to)];
}

/**
 * @typedef {object} OrderProps
 * @property {readonly Entry[]} entries
 * @property {(entries: readonly Entry[]) => void} change Called with the new list.
 * @property {(entry: Entry) => void} rename
 * @property {(entry: Entry) => string} note A note on an item, or nothing.
 */

/** @param {OrderProps} props */
export function Order({ entries, change, rename, note }) {
  const list = useRef(/** @type {HTMLElement|null} */ (null));
  /** The dragged line and its present place. */
  const dragged = useSignal(/** @type {{key: number, to: number}|null} */ (null));
  const said = useSignal("");
  /** The element to focus once the lines have changed places. */
  const held = useRef("");
  useLayoutEffect(() => {
    const focused = held.current && list.current?.querySelector(held.current);
    if (focused instanceof HTMLElement) focused.focus();
    held.current = "";
  });
  const from = entries.findIndex(({ key }) => key === dragged.value?.key);
  const shown = dragged.value === null ? entries : moved(entries, from, dragged.value.to);
  const put = (/** @type {number} */ place, /** @type {number} */ to, role = "handle") => {
    if (!(to in entries)) return;
    const { key, title } = entries[place];
    // At an end of the list the button is disabled, so the handle gets the focus.
    held.current = `[data-key="${key}"] [data-role=${to === 0 || to === entries.length - 1 ? "handle" : role}]`;
    said.value = `${title} is item ${to + 1} of ${entries.length}`;
    change(moved(entries, place, to));
  };
  const drag = (/** @type {PointerEvent} */ { clientY }) => {
    if (dragged.value === null) return;
    const { key, to } = dragged.value;
    const above = [...(list.current?.children ?? [])].filter((line, place) => place !== to && middle(line) < clientY).length;
    if (above === to) return;
    held.current = `[data-key="${key}"] [data-role=handle]`;
    dragged.value = { key, to: above };
  };
  const drop = () => {
    const to = dragged.value?.to ?? from;
    dragged.value = null;
    if (to !== from) put(from, to);
  };
  const line = (/** @type {Entry} */ entry, /** @type {number} */ place) => {
    const grip = (/** @type {PointerEvent & {currentTarget: HTMLElement}} */ event) => {
      if (event.button !== 0) return;
      event.preventDefault();
      event.currentTarget.focus();
      // The list captures the pointer, since it stays in place when lines change places.
      list.current?.setPointerCapture(event.pointerId);
      dragged.value = { key: entry.key, to: place };
    };
    const become = (/** @type {Entry|null} */ other) => change(entries.flatMap((each) => (each.key === entry.key ? (other ?? []) : each)));
    const move = (/** @type {number} */ by, /** @type {string} */ role) => put(place, place + by, role);
    const ends = { isFirst: place === 0, isLast: place === entries.length - 1, isDragged: dragged.value?.key === entry.key };
    return h(Line, { key: entry.key, entry, note: note(entry), ...ends, grip, move, become, rename: () => rename(entry) });
  };
  return html`
    <ol ref=${list} class="rows order" aria-label="Order" onPointerMove=${drag} onLostPointerCapture=${drop}>${shown.map(line)}</ol>
    <p class="visually-hidden" role="status">${said.value}</p>
  `;
}

/**
 * @typedef {object} LineProps
 * @property {Entry} entry
 * @property {string} note
 * @property {boolean} isFirst
 * @property {boolean} isLast
 * @property {boolean} isDragged
 * @property {(event: PointerEvent & {currentTarget: HTMLElement}) => void} grip
 * @property {(by: number, role: string) => void} move
 * @property {(other: Entry|null) => void} become Null to leave it out.
 * @property {() => void} rename
 */

/** @param {LineProps} props */
function Line({ entry, note, isFirst, isLast, isDragged, grip, move, become, rename }) {
  const { key, kind, title, minutes, problem, item } = entry;
  const press = (/** @type {KeyboardEvent} */ event) => {
    const by = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    if (by === undefined) return;
    event.preventDefault();
    move(by, "handle");
  };
  const time = (/** @type {Event & {currentTarget: HTMLInputElement}} */ { currentTarget: field }) => {
    const given = field.valueAsNumber;
    if (given > 0 && given <= MOST_MINUTES) become({ ...entry, minutes: given, item: { ...item, minutes: given } });
    else field.value = String(minutes);
  };
  const mover = (/** @type {"up"|"down"} */ way, /** @type {boolean} */ disabled) =>
    h(IconButton, { name: way, title: `Move ${title} ${way}`, run: () => move(way === "up" ? -1 : 1, way), disabled, "data-role": way });
  return html`<li class="row" data-key=${key} data-kind=${kind} data-dragged=${isDragged || null}>
    <button
      type="button" class="quiet icon-only order-handle" title="Drag, or move with the arrow keys" aria-label=${`Move ${title}: arrow keys`}
      data-role="handle" onKeyDown=${press} onPointerDown=${grip}
    >
      ${h(Icon, { name: "menu" })}
    </button>
    <span class="row-words">
      <span class="row-title">${title}</span>
      <span class="hint">${[KINDS[kind], note].filter(Boolean).join(", ")}</span>
      ${problem !== null && html`<span class="wrong">${problem}</span>`}
    </span>
    <span class="row-actions">
      <label class="order-minutes">
        <input type="number" min="0.5" max=${MOST_MINUTES} step="0.5" defaultValue=${minutes} aria-label=${`Minutes for ${title}`} onChange=${time} />min
      </label>
      ${mover("up", isFirst)}
      ${mover("down", isLast)}
      ${h(IconButton, { name: "rename", title: `Rename ${title}`, run: rename })}
      ${h(IconButton, { name: "close", title: `Remove ${title}`, run: () => become(null) })}
    </span>
  </li>`;
}

/** @param {Element} element */
function middle(element) {
  const { top, height } = element.getBoundingClientRect();
  return top + height / 2;
}
