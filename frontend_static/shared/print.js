/**
 * Printing: a page as a handout, by the rules of `print.css`. Pictures that only the server can draw for paper, as that of a
 * scene in three dimensions, are fetched before the browser prints; who prints by its menu has them from the last time.
 */

import { h } from "./dom.js";
import { icon } from "./icons.js";

/** Told before the page is printed; who listens adds what has to be waited for. */
const PREPARED = "pftrack-print";
const KEY = "p";

/**
 * Call `prepare` before the page is printed.
 *
 * @param {() => Promise<unknown>} prepare
 * @param {AbortSignal} signal Until then.
 */
export function beforePrinting(prepare, signal) {
  const listen = (/** @type {Event} */ event) => /** @type {CustomEvent<Promise<unknown>[]>} */ (event).detail.push(prepare());
  document.addEventListener(PREPARED, listen, { signal });
}

/** Print the page; control and P do the same. */
export function printButton() {
  document.addEventListener("keydown", (event) => {
    if (event.key.toLowerCase() !== KEY || !(event.ctrlKey || event.metaKey) || event.altKey || event.shiftKey) return;
    event.preventDefault();
    printPage();
  });
  const title = "Print as a handout";
  const button = h("button", { type: "button", class: "quiet icon-only", title, "aria-label": title, on: { click: printPage } }, icon("print"));
  button.dataset.role = "print";
  return button;
}

async function printPage() {
  /** @type {Promise<unknown>[]} */
  const waitFor = [];
  document.dispatchEvent(new CustomEvent(PREPARED, { detail: waitFor }));
  await Promise.allSettled(waitFor);
  globalThis.print();
}
