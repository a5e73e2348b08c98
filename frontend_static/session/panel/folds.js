/**
 * Which folds of the panel are open: as a person has left them in this browser, for each experiment by its title. The 3-D
 * scene's panel keeps its folds in the same place (`folds.js` of the viser adapter).
 */

import { h } from "../../shared/dom.js";

export class Folds {
  #place;

  /** @param {string} title The experiment's. */
  constructor(title) {
    this.#place = `pftrack-folds ${title}`;
  }

  /**
   * Make a fold.
   *
   * @param {string} title
   * @param {Parameters<typeof h>[2]} content
   * @param {{open?: boolean, className?: string}} [options] Whether it is open until a person decides.
   */
  make(title, content, { open = false, className = "control-group" } = {}) {
    // Pressed by mouse or key: `toggle` would also be told of what is open from the start.
    const press = () => this.#keep(title, !element.open);
    const summary = h("summary", { on: { click: press } }, title);
    /** @type {HTMLDetailsElement} */
    const element = h("details", { class: className, open: this.#kept[title] ?? open }, summary, content);
    return element;
  }

  /** @returns {Record<string, boolean>} */
  get #kept() {
    try {
      return JSON.parse(localStorage.getItem(this.#place) ?? "{}");
    } catch {
      return {};
    }
  }

  /**
   * @param {string} title
   * @param {boolean} open
   */
  #keep(title, open) {
    try {
      localStorage.setItem(this.#place, JSON.stringify({ ...this.#kept, [title]: open }));
    } catch {
      // Without storage it lasts as long as the page.
    }
  }
}
