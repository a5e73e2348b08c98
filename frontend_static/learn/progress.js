/**
 * How far a person is in the course: kept in this browser, without an account.
 *
 * What is there may be of another version, damaged, or find no room. Then whatever can be read of it is taken up, what
 * cannot is kept beside it as it was, and a sentence says so.
 */

/**
 * What is known of a lesson: the prediction that was made, or that none was.
 *
 * @typedef {{given: number|string, right: boolean}|{skipped: true}} Entry
 */

/** @typedef {{entries: Record<string, Entry>, remark: string, rest: Record<string, unknown>}} Reading `rest`: what else there is. */

const PLACE = "pftrack-lessons";
/** Where what could not be read is left, as it was. */
const ASIDE = "pftrack-lessons-unread";
const DAMAGED = "Your progress in this browser is damaged";
const OTHER = "Your progress was saved by another version of pftrack";
export const VERSION = 1;

/**
 * Understand what was kept.
 *
 * @param {string|null} text
 * @returns {Reading}
 */
export function read(text) {
  if (text === null) return { entries: {}, remark: "", rest: {} };
  const stored = parsed(text);
  if (!isRecord(stored)) return { entries: {}, remark: anew(DAMAGED), rest: {} };
  const { version, lessons, ...rest } = stored;
  const why = version === VERSION ? DAMAGED : OTHER;
  if (!isRecord(lessons)) return { entries: {}, remark: anew(why), rest };
  const known = Object.entries(lessons);
  /** @type {Record<string, Entry>} */
  const entries = {};
  for (const [id, value] of known) {
    const entry = entryOf(value);
    if (entry !== null) entries[id] = entry;
  }
  return { entries, remark: told(why, Object.keys(entries).length, known.length), rest };
}

/**
 * @param {string} why
 * @param {number} found How many lessons can be read.
 * @param {number} all
 */
function told(why, found, all) {
  if (found === all) return why === OTHER && all > 0 ? `${OTHER}, and all of it could be read.` : "";
  return found === 0 ? anew(why) : `${why}: ${found} of its ${all} lessons could be read; the others are asked again.`;
}

/** @param {string} why */
function anew(why) {
  return `${why}. None of it could be read, so every lesson is asked again.`;
}

/**
 * @param {string} text
 * @returns {unknown} Undefined where it says nothing.
 */
function parsed(text) {
  try {
    return JSON.parse(text);
  } catch {
    return undefined;
  }
}

/** The progress of this browser. */
export class Progress {
  #storage;
  /** @type {Reading} */
  #reading;
  #isKept = true;
  #isAside = false;

  /** @param {() => Pick<Storage, "getItem"|"setItem">} [storage] It may be forbidden. */
  constructor(storage = () => localStorage) {
    this.#storage = storage;
    this.#reading = this.#load();
  }

  /** What a person should know of it, one sentence, or nothing. */
  get remark() {
    if (!this.#isKept) return "This browser's storage is full or disabled: your progress is kept until you close this page.";
    return this.#isAside ? `${this.#reading.remark} The old data is still in this browser's local storage, under “${ASIDE}”.` : this.#reading.remark;
  }

  /**
   * @param {string} id
   * @returns {Entry|null}
   */
  of(id) {
    return Object.hasOwn(this.#reading.entries, id) ? this.#reading.entries[id] : null;
  }

  /**
   * How many of some lessons have been answered.
   *
   * @param {readonly {id: string}[]} lessons
   */
  done(lessons) {
    return lessons.filter(({ id }) => this.of(id) !== null && !("skipped" in (this.of(id) ?? {}))).length;
  }

  /**
   * @param {string} id
   * @param {Entry|null} entry Null to be asked again.
   */
  set(id, entry) {
    // Another page may have gone on meanwhile.
    const newest = this.#isKept ? this.#load() : this.#reading;
    const { [id]: before, ...others } = newest.entries;
    const entries = entry === null ? others : { ...newest.entries, [id]: entry };
    this.#reading = { ...newest, entries, remark: this.#reading.remark || newest.remark };
    try {
      this.#storage().setItem(PLACE, JSON.stringify({ ...newest.rest, version: VERSION, lessons: entries }));
    } catch {
      this.#isKept = false;
    }
  }

  /** @returns {Reading} */
  #load() {
    try {
      const text = this.#storage().getItem(PLACE);
      const reading = read(text);
      if (reading.remark && text !== null) this.#setAside(text);
      return reading;
    } catch {
      this.#isKept = false;
      return { entries: {}, remark: "", rest: {} };
    }
  }

  /** @param {string} text */
  #setAside(text) {
    try {
      this.#storage().setItem(ASIDE, text);
      this.#isAside = true;
    } catch {
      // No room: it stays in its place until something is answered.
    }
  }
}

/**
 * @param {unknown} value
 * @returns {Entry|null}
 */
function entryOf(value) {
  if (!isRecord(value)) return null;
  if (value.skipped === true) return { skipped: true };
  const { given, right } = value;
  const isGiven = typeof given === "string" || (typeof given === "number" && Number.isFinite(given));
  return isGiven && typeof right === "boolean" ? { given, right } : null;
}

/**
 * @param {unknown} value
 * @returns {value is Record<string, unknown>}
 */
function isRecord(value) {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}
