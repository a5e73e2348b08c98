/**
 * What is known of each frame of one branch: the diagnostics in columns, row i belonging to frame i.
 */

export class History {
  #rows = [];
  /** Counts every change that is not an appended row; a plot that saw the same count only has to add the tail. */
  edition = 0;

  get length() {
    return this.#rows.length;
  }

  /** The diagnostics of a frame, or undefined where it has not been computed. */
  at(frame) {
    return this.#rows[frame];
  }

  /** Forget everything and take over what the server sends, column by column. */
  replace(columns) {
    this.#rows = [];
    this.merge(columns);
  }

  /** Begin like another history, up to and including a frame. */
  share(parent, frame) {
    this.#rows = parent.#rows.slice(0, frame + 1);
    this.edition += 1;
  }

  /** Fill in what the server sends; rows that came by the stream in the meantime stay. */
  merge(columns) {
    const names = Object.keys(columns);
    for (let index = 0; index < (columns.frame?.length ?? 0); index += 1) {
      const row = {};
      for (const name of names) row[name] = columns[name][index];
      this.#rows[row.frame] = row;
    }
    this.edition += 1;
  }

  /**
   * Add a row, or see an old one again (a replay gives the same numbers).
   *
   * @returns {boolean} False when rows in between are missing, so that the whole history has to be fetched.
   */
  add(row) {
    const whole = row.frame <= this.#rows.length;
    if (row.frame < this.#rows.length && row.estimate?.[0] !== this.#rows[row.frame]?.estimate?.[0]) this.edition += 1;
    this.#rows[row.frame] = row;
    return whole;
  }

  /** Spans [first, last] of frames for which `test` holds. */
  spans(test) {
    const found = [];
    let first = -1;
    for (let frame = 0; frame <= this.#rows.length; frame += 1) {
      const holds = frame < this.#rows.length && test(this.#rows[frame]);
      if (holds && first < 0) first = frame;
      if (!holds && first >= 0) {
        found.push([first, frame - 1]);
        first = -1;
      }
    }
    return found;
  }

  /** Whether `test` holds for any frame. */
  some(test) {
    return this.#rows.some((row) => test(row));
  }

  /** Largest of the numbers that `value` gives, over the frames from..to; null where there is none. */
  most(value, from = 0, to = this.#rows.length - 1) {
    let most = null;
    for (let frame = from; frame <= to; frame += 1) {
      const number = value(this.#rows[frame]);
      if (number !== null && (most === null || number > most)) most = number;
    }
    return most;
  }
}

/** The curves that scrubber, plots and readout draw from a row; null where it is not known. */
export const curve = {
  error: (row) => finite(row?.error),
  /** A filter switches as soon as any component spreads too far, so the largest one is the one to look at. */
  sigma: (row) => finite(row?.sigma?.length ? Math.max(...row.sigma) : null),
  ess: (row) => finite(row?.effective_sample_size),
  prediction: (row) => finite(row?.prediction_count) ?? 0,
  observation: (row) => finite(row?.observation_count) ?? 0,
  particles: (row) => curve.prediction(row) + curve.observation(row),
};

/** A number of a series in a frame, or the one at a place of several; NaN where it is not known. */
export function valueOf(row, series, place = null) {
  const found = row?.series?.[series];
  return finite(place === null ? found : found?.[place]) ?? NaN;
}

/** Of a series of zeros and ones, the share of ones up to each frame; NaN before any is known. */
export function shares(history, series, last = history.length - 1) {
  const found = [];
  let [ones, known] = [0, 0];
  for (let frame = 0; frame <= Math.min(last, history.length - 1); frame += 1) {
    for (const value of history.at(frame)?.series?.[series] ?? []) {
      if (finite(value) === null) continue;
      ones += value;
      known += 1;
    }
    found.push(known > 0 ? ones / known : NaN);
  }
  return found;
}

/** Whether the target is lost: the truth says so, or the tracker itself, which looks for it. */
export function isGone(row) {
  return row?.lost === true || row?.searching === true;
}

function finite(value) {
  return typeof value === "number" && Number.isFinite(value) ? value : null;
}
