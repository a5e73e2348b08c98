/**
 * Printing: a page as a handout, by the rules of `print.css`. Pictures that only the server can draw for paper, as that of a
 * scene in three dimensions, are fetched before the browser prints; who prints by its menu has them from the last time.
 */

import { h } from "./dom.js";
import { icon } from "./icons.js";

/** @type {Set<() => Promise<unknown>>} What is done before the page is printed. */
const preparing = new Set();

/**
 * Call `prepare` before the page is printed.
 *
 * @param {() => Promise<unknown>} prepare
 * @param {AbortSignal} signal Until then.
 */
export function beforePrinting(prepare, signal) {
  preparing.add(prepare);
  signal.addEventListener("abort", () => preparing.delete(prepare));
}

/** Print the page; control and P do the same. */
export function printButton() {
  document.addEventListener("keydown", (event) => {
    if (event.key.toLowerCase() !== "p" || !(event.ctrlKey || event.metaKey) || event.altKey || event.shiftKey) return;
    event.preventDefault();
    printPage();
  });
  const title = "Print as a handout";
  const button = h("button", { type: "button", class: "quiet icon-only", title, "aria-label": title, on: { click: printPage } }, icon("print"));
  button.dataset.role = "print";
  return button;
}

async function printPage() {
  await Promise.allSettled([...preparing].map((prepare) => prepare()));
  globalThis.print();
}
