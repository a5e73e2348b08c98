/** A picture that keeps its place while it loads, and leaves a plain field if it cannot. */

import { elementOf } from "./dom.js";
import { h, html } from "../vendor/preact.js";

/** @param {{address: string}} props */
export function Thumbnail({ address }) {
  const fail = (/** @type {Event & {currentTarget: HTMLElement}} */ { currentTarget }) => currentTarget.classList.add("missing");
  return html`<img src=${address} alt="" loading="lazy" width="320" height="240" onError=${fail} />`;
}

/**
 * @param {string} address
 * @returns {HTMLImageElement}
 */
export function thumbnail(address) {
  return elementOf(h(Thumbnail, { address }));
}
