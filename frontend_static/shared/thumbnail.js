/** A picture that keeps its place while it loads, and leaves a plain field if it cannot. */

import { html } from "../vendor/preact.js";

/** @param {{address: string}} props */
export function Thumbnail({ address }) {
  const fail = (/** @type {Event & {currentTarget: HTMLElement}} */ { currentTarget }) => currentTarget.classList.add("missing");
  return html`<img loading="lazy" src=${address} alt="" width="320" height="240" onError=${fail} />`;
}
