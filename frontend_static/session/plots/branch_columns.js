/** The numbers of branches in columns. Of a history that has only grown the new frames alone are read. */

/** @import { BranchPublic } from "../../shared/messages.js" */
/** @import { History } from "../history.js" */
/** @import { Store } from "../store.js" */

/** @typedef {Record<string, number[]>} Columns */

/** The columns of a branch, and how much of its history they hold. */
class Known {
  edition = -1;
  length = 0;
  low = Infinity;
  high = -Infinity;
  /** @type {Columns} */
  data = {};
}

export class BranchColumns {
  #read;
  #limits;
  #onlyActive;
  /** @type {Map<string, Known>} */
  #known = new Map();

  /**
   * @param {(history: History, from: number) => Columns} read The columns of the frames from one on.
   * @param {{limits?: string[], onlyActive?: boolean}} [options] The columns whose extent counts, all but the frames if not
   *     given; and whether those of the active branch are enough.
   */
  constructor(read, { limits, onlyActive = false } = {}) {
    this.#read = read;
    this.#limits = limits;
    this.#onlyActive = onlyActive;
  }

  /**
   * Take over what is new.
   *
   * @param {Store} store
   * @returns {{branch: BranchPublic, data: Columns, isActive: boolean}[]} The active branch last, so that it lies above.
   */
  update(store) {
    const active = store.known.branch;
    const branches = store.branches.filter(({ id }) => id === active || !this.#onlyActive);
    const ids = new Set(branches.map(({ id }) => id));
    for (const id of this.#known.keys()) if (!ids.has(id)) this.#known.delete(id);
    const found = branches.map((branch) => ({ branch, data: this.#fed(branch.id, store.historyOf(branch.id)), isActive: branch.id === active }));
    return found.sort((one, other) => Number(one.isActive) - Number(other.isActive));
  }

  /** The largest, the sign apart; 0 where there is nothing. */
  get most() {
    return Math.max(0, ...this.extent.filter(Number.isFinite).map(Math.abs));
  }

  /**
   * The smallest and the largest; the wrong way round where there is nothing.
   *
   * @returns {[number, number]}
   */
  get extent() {
    const known = [...this.#known.values()];
    return [Math.min(...known.map(({ low }) => low)), Math.max(...known.map(({ high }) => high))];
  }

  /**
   * @param {string} id
   * @param {History} history
   */
  #fed(id, history) {
    let known = this.#known.get(id);
    if (known === undefined || known.edition !== history.edition || history.length < known.length) {
      known = new Known();
      this.#known.set(id, known);
      known.data = this.#read(history, 0);
      this.#widen(known, known.data);
    } else if (history.length > known.length) {
      const more = this.#read(history, known.length);
      for (const [name, values] of Object.entries(more)) append(known.data[name], values);
      this.#widen(known, more);
    }
    [known.edition, known.length] = [history.edition, history.length];
    return known.data;
  }

  /**
   * @param {Known} known
   * @param {Columns} data
   */
  #widen(known, { frame, ...data }) {
    for (const name of this.#limits ?? Object.keys(data)) {
      for (const value of data[name]) {
        if (value < known.low) known.low = value;
        if (value > known.high) known.high = value;
      }
    }
  }
}

/**
 * @param {number[]} column
 * @param {number[]} values
 */
function append(column, values) {
  for (const value of values) column.push(value);
}
