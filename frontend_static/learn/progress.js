/** Lessons of the server, and how far a person is in the course: kept in this browser, without an account. */

import { signal } from "../vendor/preact.js";

/** @import * as Messages from "../shared/messages.js" */

/**
 * What is known of a lesson: the prediction that was made, or that none was.
 *
 * @typedef {{given: number|string, right: boolean}|{skipped: true}} Entry
 */

const PLACE = "pftrack-lessons";
const VERSION = 1;
const UNREAD = "Some of your progress in this browser could not be read; those lessons are asked again.";
const NOT_KEPT = "This browser's storage is full or disabled: your progress is kept until you close this page.";

/** The progress of this browser; a component that reads it is drawn again when it changes. */
export class Progress {
  #storage;
  #entries = signal(/** @type {Record<string, Entry>} */ ({}));
  #remark = signal("");

  /** @param {() => Pick<Storage, "getItem"|"setItem">} [storage] It may be forbidden. */
  constructor(storage = () => localStorage) {
    this.#storage = storage;
    this.#load();
  }

  /** What a person should know of it, one sentence, or nothing. */
  get remark() {
    return this.#remark.value;
  }

  /**
   * @param {string} id
   * @returns {Entry|null}
   */
  of(id) {
    return Object.hasOwn(this.#entries.value, id) ? this.#entries.value[id] : null;
  }

  /**
   * How many of some lessons have been answered.
   *
   * @param {readonly {id: string}[]} all
   */
  done(all) {
    return all.filter(({ id }) => ["right", "wrong"].includes(stateOf(this.of(id)))).length;
  }

  /**
   * @param {string} id
   * @param {Entry|null} entry Null to be asked again.
   */
  set(id, entry) {
    // Another page may have gone on meanwhile.
    if (this.#remark.peek() !== NOT_KEPT) this.#load();
    const { [id]: before, ...others } = this.#entries.peek();
    this.#entries.value = entry === null ? others : { ...others, [id]: entry };
    try {
      this.#storage().setItem(PLACE, JSON.stringify({ version: VERSION, lessons: this.#entries.peek() }));
    } catch {
      this.#remark.value = NOT_KEPT;
    }
  }

  #load() {
    let text;
    try {
      text = this.#storage().getItem(PLACE);
    } catch {
      this.#remark.value = NOT_KEPT;
      return;
    }
    const kept = text === null ? [] : entriesIn(text);
    const known = kept.filter(/** @returns {each is [string, Entry]} */ (each) => isEntry(each[1]));
    this.#entries.value = Object.fromEntries(known);
    if (known.length < kept.length) this.#remark.value = UNREAD;
  }
}

/**
 * @param {string} text
 * @returns {[string, unknown][]} One that says nothing where it is damaged.
 */
function entriesIn(text) {
  try {
    return Object.entries(/** @type {{lessons: Record<string, unknown>}} */ (JSON.parse(text)).lessons);
  } catch {
    return [["", null]];
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
