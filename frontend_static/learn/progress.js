/** Lessons of the server, and a person's progress in the course: stored in this browser, without an account. */

import { remember, remembered } from "../shared/visitor.js";
import { signal } from "../vendor/preact.js";

/** @import * as Messages from "../shared/messages.js" */

/** A lesson's entry: the prediction, or that the question was skipped.
 *
 * @typedef {{given: number|string, right: boolean}|{skipped: true}} Entry
 */

const PLACE = "pftrack-lessons";
const VERSION = 1;
const NOT_KEPT = "This browser's storage is full or disabled: your progress is kept until you close this page.";

/** The progress of this browser; a component that reads it is drawn again when it changes. */
export class Progress {
  #entries = signal(entriesKept());
  #isKept = signal(true);

  /** A remark for the person, one sentence, or nothing. */
  get remark() {
    return this.#isKept.value ? "" : NOT_KEPT;
  }

  /**
   * @param {string} id
   * @returns {Entry|null}
   */
  of(id) {
    return Object.hasOwn(this.#entries.value, id) ? this.#entries.value[id] : null;
  }

  /** The number of answered lessons among some.
   *
   * @param {readonly {id: string}[]} all
   */
  done(all) {
    return all.filter(({ id }) => ["right", "wrong"].includes(stateOf(this.of(id)))).length;
  }

  /**
   * @param {string} id
   * @param {Entry|null} entry Null to ask the question again.
   */
  set(id, entry) {
    // Another page may have stored progress meanwhile.
    const { [id]: before, ...others } = this.#isKept.peek() ? entriesKept() : this.#entries.peek();
    const lessons = entry === null ? others : { ...others, [id]: entry };
    this.#entries.value = lessons;
    this.#isKept.value = remember(PLACE, JSON.stringify({ version: VERSION, lessons }));
  }
}

/** @returns {Record<string, Entry>} Damaged entries are left out; their questions are asked again. */
function entriesKept() {
  try {
    const { lessons } = /** @type {{lessons: Record<string, unknown>}} */ (JSON.parse(remembered(PLACE) ?? "{}"));
    return Object.fromEntries(Object.entries(lessons).filter(/** @returns {each is [string, Entry]} */ (each) => isEntry(each[1])));
  } catch {
    return {};
  }
}

/**
 * @param {unknown} value It may be of another version.
 * @returns {value is Entry}
 */
function isEntry(value) {
  const { skipped, given, right } = /** @type {Record<string, unknown>} */ (value ?? {});
  return skipped === true || (["string", "number"].includes(typeof given) && typeof right === "boolean");
}

/**
 * @param {Entry|null} entry
 * @returns {"open"|"skipped"|"right"|"wrong"}
 */
export function stateOf(entry) {
  if (entry === null) return "open";
  if ("skipped" in entry) return "skipped";
  return entry.right ? "right" : "wrong";
}
