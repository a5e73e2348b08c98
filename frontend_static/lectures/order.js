/**
 * The order of a lecture: a list whose lines are moved by dragging their handles, by the arrow keys on these, or by buttons.
 */

import { fill, h, setText } from "../shared/dom.js";
import { icon, iconButton } from "../shared/icons.js";

/** @import { LectureItemPublic } from "../shared/messages.js" */

/** @typedef {Omit<LectureItemPublic, "item"> & {key: number, item: Record<string, unknown>}} Entry An item, and what tells it from others. */

/**
 * @typedef {object} Listener
 * @property {(entries: Entry[]) => void} changed Called with the new order.
 * @property {(entry: Entry) => void} rename
 * @property {(entry: Entry) => string} note What more is known of an item, or nothing.
 */

const KINDS = { lesson: "Lesson", failure: "Failure", session: "Session", comparison: "Comparison", question: "Question", poll: "Poll" };

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
  const at = Math.max(0, Math.min(rest.length, to));
  return [...rest.slice(0, at), list[from], ...rest.slice(at)];
}

export class OrderList {
  #on;
  #list = h("ol", { class: "rows order", "aria-label": "Order" });
  #said = h("p", { class: "visually-hidden", role: "status" });
  /** @type {Entry[]} */
  #entries = [];
  #drawn = "";
  #isDragged = false;

  /** @param {Listener} on */
  constructor(on) {
    this.#on = on;
    this.element = h("div", {}, this.#list, this.#said);
  }

  /** @param {Entry[]} entries */
  show(entries) {
    this.#entries = entries;
    // What is held must not be exchanged under the hand; most of what the server answers changes nothing that is seen.
    const drawn = JSON.stringify(entries.map((entry) => [entry.key, entry.kind, entry.title, entry.minutes, entry.problem, this.#on.note(entry)]));
    if (this.#isDragged || drawn === this.#drawn) return;
    this.#drawn = drawn;
    const held = this.#held();
    fill(this.#list, entries.map((entry, place) => this.#line(entry, place)));
    if (held) /** @type {HTMLElement|null} */ (this.#list.querySelector(held))?.focus();
  }

  /** What has the focus, to be found again among new lines. */
  #held() {
    const focused = document.activeElement;
    if (!(focused instanceof HTMLElement) || !this.#list.contains(focused)) return null;
    const line = focused.closest("li");
    const role = line?.dataset.again ?? focused.dataset.role;
    return `[data-key="${line?.dataset.key}"] [data-role="${role}"]:not(:disabled)`;
  }

  /**
   * @param {Entry} entry
   * @param {number} place
   */
  #line(entry, place) {
    const { key, kind, title, minutes, problem } = entry;
    const last = this.#entries.length - 1;
    const handle = h(
      "button",
      {
        type: "button",
        class: "quiet icon-only order-handle",
        title: "Drag, or move with the arrow keys",
        "aria-label": `Move ${title}: arrow keys`,
        data: { role: "handle" },
        on: { keydown: (event) => this.#press(event, key), pointerdown: (event) => this.#drag(event) },
      },
      icon("menu"),
    );
    /** @type {HTMLInputElement} */
    const field = h("input", {
      type: "number",
      min: 0.5,
      max: 180,
      step: 0.5,
      value: minutes,
      "aria-label": `Minutes for ${title}`,
      data: { role: "minutes" },
      on: { change: () => this.#time(key, field) },
    });
    const up = this.#mover("up", `Move ${title} up`, place === 0, () => this.#move(key, -1));
    const down = this.#mover("down", `Move ${title} down`, place === last, () => this.#move(key, 1));
    const rename = iconButton("rename", `Rename ${title}`, () => this.#on.rename(this.#of(key)));
    const away = iconButton("close", `Leave ${title} out`, () => this.#on.changed(this.#entries.filter((each) => each.key !== key)));
    const note = this.#on.note(entry);
    return h(
      "li",
      { class: "row", data: { key, kind } },
      handle,
      h(
        "span",
        { class: "row-words" },
        h("span", { class: "row-title" }, title),
        h("span", { class: "hint" }, [KINDS[kind], note].filter(Boolean).join(", ")),
        problem !== null && h("span", { class: "wrong" }, problem),
      ),
      h("span", { class: "row-actions" }, h("label", { class: "order-minutes" }, field, "min"), up, down, rename, away),
    );
  }

  /**
   * @param {"up"|"down"} way
   * @param {string} title
   * @param {boolean} isOff
   * @param {() => void} run
   */
  #mover(way, title, isOff, run) {
    const button = iconButton(way, title, run);
    button.dataset.role = way;
    button.disabled = isOff;
    return button;
  }

  /**
   * @param {KeyboardEvent} event
   * @param {number} key
   */
  #press(event, key) {
    const by = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    if (by === undefined) return;
    event.preventDefault();
    this.#move(key, by);
  }

  /**
   * @param {number} key
   * @param {number} by
   */
  #move(key, by) {
    const from = this.#entries.findIndex((each) => each.key === key);
    const to = from + by;
    if (to < 0 || to >= this.#entries.length) return;
    const line = this.#list.children[from];
    // At an end its own button is off: the handle keeps the focus.
    if (line instanceof HTMLElement && (to === 0 || to === this.#entries.length - 1)) line.dataset.again = "handle";
    this.#tell(moved(this.#entries, from, to), key);
  }

  /**
   * The lines beside the one that is dragged change places with it: it stays in the page, and keeps the pointer.
   *
   * @param {PointerEvent} event
   */
  #drag(event) {
    const handle = event.currentTarget;
    const line = handle instanceof HTMLElement ? handle.closest("li") : null;
    if (event.button !== 0 || !(handle instanceof HTMLElement) || line === null) return;
    event.preventDefault();
    handle.focus();
    handle.setPointerCapture(event.pointerId);
    line.dataset.dragged = "";
    this.#isDragged = true;
    const end = new AbortController();
    const { signal } = end;
    handle.addEventListener("pointermove", ({ clientY }) => {
      const [before, after] = [line.previousElementSibling, line.nextElementSibling];
      if (before !== null && clientY < middle(before)) line.after(before);
      else if (after !== null && clientY > middle(after)) line.before(after);
    }, { signal });
    const drop = () => {
      end.abort();
      delete line.dataset.dragged;
      this.#isDragged = false;
      const found = [...this.#list.children].map((each) => this.#of(Number(/** @type {HTMLElement} */ (each).dataset.key)));
      this.#drawn = "";
      if (found.some((entry, place) => entry !== this.#entries[place])) this.#tell(found, Number(line.dataset.key));
      else this.show(this.#entries);
    };
    for (const type of ["pointerup", "pointercancel", "lostpointercapture"]) handle.addEventListener(type, drop, { signal });
  }

  /**
   * @param {Entry[]} entries
   * @param {number} key Of the one that was moved.
   */
  #tell(entries, key) {
    const place = entries.findIndex((each) => each.key === key);
    setText(this.#said, `${entries[place].title} is item ${place + 1} of ${entries.length}`);
    this.#on.changed(entries);
  }

  /**
   * @param {number} key
   * @returns {Entry} As it is by now.
   */
  #of(key) {
    return /** @type {Entry} */ (this.#entries.find((each) => each.key === key));
  }

  /**
   * @param {number} key
   * @param {HTMLInputElement} field
   */
  #time(key, field) {
    const entry = this.#of(key);
    const minutes = field.valueAsNumber;
    if (!(minutes > 0 && minutes <= 180)) {
      field.value = String(entry.minutes);
      return;
    }
    const changed = { ...entry, minutes, item: { ...entry.item, minutes } };
    this.#on.changed(this.#entries.map((each) => (each.key === key ? changed : each)));
  }
}

/** @param {Element} element */
function middle(element) {
  const { top, height } = element.getBoundingClientRect();
  return top + height / 2;
}
