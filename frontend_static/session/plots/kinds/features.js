/** A row a component of a vector, each from 0 at its bottom to 1 at its top; of the active branch alone. */

import { number } from "../../../shared/format.js";
import { declared, valueOf } from "../../series.js";
import { BranchColumns } from "../branch_columns.js";
import { Shades } from "../shades.js";
import { Plot } from "./plot.js";
import { key } from "./samplers.js";

/** @import { Plot as Declared, SessionPublic } from "../../../shared/messages.js" */
/** @import { Row } from "../../history.js" */
/** @import { Store } from "../../store.js" */
/** @import { Trace } from "../../../shared/figure/traces.js" */
/** @import { History } from "../../history.js" */
/** @import { Columns } from "../branch_columns.js" */
/** @import { Limits, Look } from "./plot.js" */

/** Within its row a line leaves this free above and below. */
const FREE = 0.12;

export class FeaturesPlot extends Plot {
  #columns = new BranchColumns((history, from) => this.#heights(history, from), { onlyActive: true });

  /**
   * @param {Declared} plot
   * @param {SessionPublic} session
   */
  constructor(plot, session) {
    super(plot, session);
    this.features = declared(session, plot.series[0])?.components ?? [];
    this.rows = this.features.length;
    const seen = (/** @type {Row} */ row, /** @type {number} */ place) => valueOf(row, plot.visible, place);
    // Where the truth is unknown the tracker's own account has to do; it is not the same, so neither is the colour.
    const missed = (/** @type {Row} */ row, /** @type {number} */ place) => Number.isNaN(seen(row, place)) && valueOf(row, plot.recognised, place) === 0;
    this.shades = [new Shades("hidden", 0.2, (row, place) => seen(row, place) === 0, this.rows), new Shades("lost", 0.16, missed, this.rows)];
    this.rowTitles = plot.row_titles.map((words, place) => /** @type {[string, string]} */ ([this.features[place], words]));
  }

  /** @param {Store} store */
  heading({ history }) {
    const { title, visible } = this.declared;
    return [`${title} `, history.measures(visible) ? key("hidden", "hidden") : key("lost", "unrecognised")];
  }

  /** @param {Store} store */
  reading({ known, history }) {
    const row = history.at(known.position);
    const values = this.features.map((_, place) => valueOf(row, this.declared.series[0], place));
    const mean = number(values.reduce((sum, value) => sum + value, 0) / values.length, 2);
    return mean === number(null) ? mean : `mean ${mean}`;
  }

  /**
   * @param {Store} store
   * @returns {Trace[]}
   */
  traces(store) {
    return this.#columns.update(store).flatMap(({ branch, data }) =>
      this.features.map((said) =>
        this.line({ name: `${this.id} ${said}`, x: data.frame, y: data[said], values: data[`value ${said}`], ink: branch.colour, width: 1.5, said }),
      ),
    );
  }

  /**
   * The rows are named in words where there is room for them.
   *
   * @param {Store} store
   * @param {Look} look
   * @returns {Limits}
   */
  limits(store, { isRoomy }) {
    const words = isRoomy ? new Map(this.rowTitles) : new Map();
    // The first at the top.
    return { low: this.rows, high: 0, ticks: this.features.map((name, place) => ({ at: place + 0.5, text: words.get(name) ?? name })) };
  }

  /**
   * @param {History} history
   * @param {number} from
   */
  #heights(history, from) {
    /** @type {Columns} */
    const data = { frame: [] };
    for (let frame = from; frame < history.length; frame += 1) data.frame.push(frame);
    this.features.forEach((feature, place) => {
      const values = data.frame.map((frame) => valueOf(history.at(frame), this.declared.series[0], place));
      data[`value ${feature}`] = values;
      data[feature] = values.map((value) => place + 1 - FREE - (1 - 2 * FREE) * value);
    });
    return data;
  }
}
