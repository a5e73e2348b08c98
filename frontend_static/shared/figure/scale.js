/** From the values of an axis to px of a panel and back. */

/** @import { Axis } from "./traces.js" */

/** What lies further out than so many px is not told apart, and browsers grow slow. */
const FAR_PX = 30_000;

export class Scale {
  #start;
  #rate;
  #from;
  #log;

  /**
   * @param {Pick<Axis, "low"|"high"|"log">} axis A logarithmic one begins above 0.
   * @param {number} from px of the lowest value.
   * @param {number} to px of the highest value.
   */
  constructor({ low, high, log }, from, to) {
    this.low = low;
    this.high = high;
    this.#log = log;
    this.#from = from;
    this.#start = this.#bent(low);
    const span = this.#bent(high) - this.#start;
    this.#rate = (to - from) / (span || 1);
  }

  /** @param {number|null} value A gap stays one: NaN. */
  at(value) {
    if (value === null) return NaN;
    const px = this.#from + (this.#bent(value) - this.#start) * this.#rate;
    return Math.min(Math.max(px, -FAR_PX), FAR_PX);
  }

  /** @param {number} px */
  value(px) {
    const bent = this.#start + (px - this.#from) / this.#rate;
    return this.#log ? 10 ** bent : bent;
  }

  /**
   * All of a trace's values at once.
   *
   * @param {readonly (number|null)[]} values
   */
  all(values) {
    const places = new Float64Array(values.length);
    for (let index = 0; index < values.length; index += 1) places[index] = this.at(values[index]);
    return places;
  }

  /**
   * The same, but that what lies beyond the axis is a gap, too.
   *
   * @param {readonly (number|null)[]} values
   */
  held(values) {
    const [least, greatest] = this.low <= this.high ? [this.low, this.high] : [this.high, this.low];
    const places = this.all(values);
    values.forEach((value, index) => {
      if (value === null || value < least || value > greatest) places[index] = NaN;
    });
    return places;
  }

  /** The value from which bars and stems rise: 0, or the end of the axis that is nearest to it. */
  get ground() {
    if (this.#log) return Math.min(this.low, this.high);
    return Math.min(Math.max(0, Math.min(this.low, this.high)), Math.max(this.low, this.high));
  }

  /** @param {number} value */
  #bent(value) {
    if (!this.#log) return value;
    // Nothing is the lowest that there is: bars and curves come up from below.
    return value > 0 ? Math.log10(value) : -Infinity;
  }
}
