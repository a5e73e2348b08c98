/** A row a component of a vector, each from 0 at its bottom to 1 at its top; of the active branch alone. */

import { number } from "../../../shared/format.js";
import { declared, valueOf } from "../../series.js";
import { Plot, made } from "./plot.js";
import { key } from "./samplers.js";

/** @import { Plot as Declared, SessionPublic } from "../../../shared/messages.js" */
/** @import { Row } from "../../history.js" */
/** @import { Store } from "../../store.js" */
/** @import { BokehApi, Range, Renderer } from "../bokeh_api.js" */
/** @import { Ink } from "../figure.js" */

/** Within its row a line leaves this free above and below. */
const FREE = 0.12;

export class FeaturesPlot extends Plot {
  /** @type {Renderer|null} */
  #lines = null;
  /** @type {number[][]} */
  #heights = [];
  /** Of which branch the heights are, and how much of its history. */
  #seen = { id: "", edition: -1, length: 0 };

  /**
   * @param {Declared} plot
   * @param {SessionPublic} session
   */
  constructor(plot, session) {
    super(plot, session);
    this.features = declared(session, plot.series[0])?.components ?? [];
    this.rows = this.features.length;
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
   * @param {BokehApi} Bokeh
   * @param {Range} frames
   */
  build(Bokeh, frames) {
    const { features, declared: plot } = this;
    super.build(Bokeh, frames, { ticks: features.map((_, place) => place + 0.5) });
    const { model, range } = this.figure;
    const [yaxis] = model.yaxes;
    yaxis.major_tick_out = 0;
    model.ygrid.ticker = new Bokeh.FixedTicker({ ticks: features.map((_, place) => place) });
    [range.start, range.end] = [features.length, 0];
    // One glyph for all rows: eleven take BokehJS three times as long.
    const source = this.figure.source({ xs: [], ys: [] });
    this.#lines = model.multi_line({ field: "xs" }, { field: "ys" }, { source, line_width: 1.5, line_join: "round", name: this.id });
    const seen = (/** @type {Row} */ row, /** @type {number} */ place) => valueOf(row, plot.visible, place);
    this.figure.shade("hidden", 0.2, (row, place) => seen(row, place) === 0, features.length);
    // Where the truth is unknown the tracker's own account has to do; it is not the same, so neither is the colour.
    const missed = (/** @type {Row} */ row, /** @type {number} */ place) => Number.isNaN(seen(row, place)) && valueOf(row, plot.recognised, place) === 0;
    this.figure.shade("lost", 0.16, missed, features.length);
  }

  /**
   * Name the rows, in words where there is room for them.
   *
   * @param {Ink} ink
   * @param {boolean} sparkline
   */
  dress(ink, sparkline) {
    super.dress(ink, sparkline);
    const words = this.figure.isRoomy ? new Map(this.rowTitles) : new Map();
    this.figure.model.yaxes[0].major_label_overrides = new Map(this.features.map((name, place) => [place + 0.5, words.get(name) ?? name]));
  }

  /** @param {Store} store */
  draw(store) {
    super.draw(store);
    const { history, activeBranch: branch } = store;
    if (branch === undefined) return;
    const lines = made(this.#lines);
    const { id, edition, length } = this.#seen;
    if (id !== branch.id) lines.glyph.line_color = branch.colour;
    const grown = id === branch.id && edition === history.edition && length <= history.length;
    if (grown && length === history.length) return;
    if (!grown) this.#heights = Array.from({ length: this.rows }, () => []);
    for (let frame = grown ? length : 0; frame < history.length; frame += 1) {
      this.#heights.forEach((row, place) => row.push(this.#height(history.at(frame), place)));
    }
    this.#seen = { id: branch.id, edition: history.edition, length: history.length };
    const frames = Array.from({ length: history.length }, (_, frame) => frame);
    lines.data_source.data = { xs: this.#heights.map(() => frames), ys: this.#heights.map((row) => row.slice()) };
  }

  /**
   * @param {Row|undefined} row
   * @param {number} place
   */
  #height(row, place) {
    return place + 1 - FREE - (1 - 2 * FREE) * valueOf(row, this.declared.series[0], place);
  }
}
