// A recording's arrays, unpacked when they are first shown: what `packing.py` has made of them.
/** @import { Description, Prop } from "./recording.js" */

/** @typedef {Float32Array|Float64Array|Uint8Array|Uint16Array|Uint32Array|Int32Array} Values */

const NOWHERE = -(2 ** 31);
const STEPS_PER_PX = 16;
/** So many columns are kept unpacked: those of some hundred frames. */
const KEPT = 20_000;
const FORMS = { f4: Float32Array, f8: Float64Array, u1: Uint8Array, u2: Uint16Array, u4: Uint32Array, i4: Int32Array, steps: Int32Array };

/** @param {number} steps */
const place = (steps) => (steps === NOWHERE ? Number.NaN : steps / STEPS_PER_PX);

export class Arrays {
  /** @type {Map<number, Values>} */
  #columns = new Map();
  #description;
  #blob;
  #pictures;

  /**
   * @param {Description} description
   * @param {Uint8Array} blob Bytes of all columns.
   * @param {Uint8Array[]} pictures
   */
  constructor(description, blob, pictures) {
    this.#description = description;
    this.#blob = blob;
    this.#pictures = pictures;
  }

  /**
   * A property of a node as viser takes it.
   *
   * @param {Prop} prop
   */
  value(prop) {
    if (prop === null || typeof prop !== "object" || Array.isArray(prop)) return prop;
    if (prop.picture !== undefined) return this.#pictures[prop.picture];
    if (prop.lines !== undefined) return this.#lines(this.#description.lines[prop.lines], prop.which);
    return this.#table(prop.array, prop.columns);
  }

  /**
   * A column, whose bytes lie in order of their weight.
   *
   * @param {number} index
   * @returns {Values}
   */
  #column(index) {
    const known = this.#columns.get(index);
    if (known) return known;
    const [form, count, at] = this.#description.columns[index];
    const Form = FORMS[/** @type {keyof typeof FORMS} */ (form)];
    const size = Form.BYTES_PER_ELEMENT;
    const bytes = new Uint8Array(count * size);
    for (let weight = 0; weight < size; weight += 1) {
      for (let row = 0; row < count; row += 1) bytes[row * size + weight] = this.#blob[at + weight * count + row];
    }
    const values = new Form(bytes.buffer);
    for (let row = 1; row < (form === "steps" ? count : 0); row += 1) values[row] += values[row - 1];
    if (this.#columns.size > KEPT) this.#columns.clear();
    this.#columns.set(index, values);
    return values;
  }

  /**
   * @param {string} form
   * @param {number[]} which
   */
  #table(form, which) {
    const columns = which.map((index) => this.#column(index));
    const isPlaces = form === "places";
    const Form = isPlaces ? Float32Array : FORMS[/** @type {keyof typeof FORMS} */ (form)];
    const values = new Form((columns[0]?.length ?? 0) * columns.length);
    for (const [offset, column] of columns.entries()) {
      for (let row = 0; row < column.length; row += 1) values[row * columns.length + offset] = isPlaces ? place(column[row]) : column[row];
    }
    return values;
  }

  /**
   * The lines of a frame, which are kept once for all frames.
   *
   * @param {number[]} ends Columns of the six numbers of all lines.
   * @param {number} which Column of the rows that are shown.
   */
  #lines(ends, which) {
    const columns = ends.map((index) => this.#column(index));
    const rows = this.#column(which);
    const values = new Float32Array(rows.length * columns.length);
    for (let line = 0; line < rows.length; line += 1) {
      for (let end = 0; end < columns.length; end += 1) values[line * columns.length + end] = place(columns[end][rows[line]]);
    }
    return values;
  }
}
