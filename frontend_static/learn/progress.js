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
export const VERSION = 1;

/**
 * Understand what was kept.
 *
 * @param {string|null} text
 * @returns {Reading}
 */
export function read(text) {
  if (text === null) return { entries: {}, remark: "", rest: {} };
  /** @type {unknown} */
  let stored;
  try {
    stored = JSON.parse(text);
  } catch {
    return { entries: {}, remark: "Your progress could not be read and begins anew; what was kept is left aside.", rest: {} };
  }
  const { version, lessons, ...rest } = isRecord(stored) ? stored : { version: undefined, lessons: undefined };
  const known = isRecord(lessons) ? Object.entries(lessons) : [];
  /** @type {Record<string, Entry>} */
  const entries = {};
  for (const [id, value] of known) {
    const entry = entryOf(value);
    if (entry !== null) entries[id] = entry;
  }
  const found = Object.keys(entries).length;
  const all = `${found} of ${known.length} lessons could be read`;
  if (version !== VERSION) return { entries, remark: `Your progress was kept by another version of pftrack: ${all}.`, rest };
  return { entries, remark: found < known.length ? `Your progress is damaged: ${all}.` : "", rest };
}

/** The progress of this browser. */
export class Progress {
  #storage;
  /** @type {Reading} */
  #reading;
  #isKept = true;

  /** @param {() => Pick<Storage, "getItem"|"setItem">} [storage] It may be forbidden. */
  constructor(storage = () => localStorage) {
    this.#storage = storage;
    this.#reading = this.#load();
  }

  /** What a person should know of it, one sentence, or nothing. */
  get remark() {
    return this.#isKept ? this.#reading.remark : "This browser keeps nothing more: your progress lasts until you close this page.";
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
      if (this.#storage().getItem(ASIDE) === null) this.#storage().setItem(ASIDE, text);
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
