/** Line icons on a 16 px grid, drawn in the colour of the text around them. */

import { elementOf } from "./dom.js";
import { h, html } from "../vendor/preact.js";

/**
 * Paths; one may be filled instead of stroked.
 *
 * @satisfies {Record<string, [path: string, isFilled?: boolean]>}
 */
const PATHS = {
  play: ["M4.5 2.8v10.4l8.6-5.2z", true],
  pause: ["M4 3h3v10H4zM9 3h3v10H9z", true],
  next: ["M6 3l5 5-5 5"],
  previous: ["M10 3L5 8l5 5"],
  first: ["M12 3L7 8l5 5M4.5 3v10"],
  last: ["M4 3l5 5-5 5M11.5 3v10"],
  replay: ["M3.5 8a4.5 4.5 0 1 0 1.7-3.5M5 1.8v3h3"],
  bookmark: ["M4.5 2.5h7v11L8 10.8 4.5 13.5z"],
  branch: [
    "M4.5 5.5v5M4.5 8.5c4 0 7-.5 7-3" +
      "M4.5 5.5a1.5 1.5 0 1 0 0-3 1.5 1.5 0 0 0 0 3zM4.5 13.5a1.5 1.5 0 1 0 0-3 1.5 1.5 0 0 0 0 3zM11.5 5.5a1.5 1.5 0 1 0 0-3 1.5 1.5 0 0 0 0 3z",
  ],
  compare: ["M2.5 3h4.5v10H2.5zM9 3h4.5v10H9z"],
  sweep: ["M2.5 2.5h11v11h-11zM2.5 6.2h11M2.5 9.8h11M6.2 2.5v11M9.8 2.5v11"],
  inspect: ["M7 11.5a4.5 4.5 0 1 0 0-9 4.5 4.5 0 0 0 0 9zM10.3 10.3l3.2 3.2M7 5.2v3.6M5.2 7h3.6"],
  save: ["M8 2.5v7.5M4.8 7L8 10.2 11.2 7M2.5 11v2.5h11V11"],
  code: ["M5.5 4.5 2 8l3.5 3.5M10.5 4.5 14 8l-3.5 3.5"],
  share: ["M6.5 9.5a2.7 2.7 0 0 0 4 .2l2-2a2.7 2.7 0 0 0-3.8-3.8l-1 1M9.5 6.5a2.7 2.7 0 0 0-4-.2l-2 2a2.7 2.7 0 0 0 3.8 3.8l1-1"],
  rename: ["M3 13l.6-2.8 7-7 2.2 2.2-7 7zM9.3 4.5l2.2 2.2"],
  trash: ["M3 4.5h10M6.5 4.5v-2h3v2M4.5 4.5l.6 9h5.8l.6-9"],
  print: ["M4.5 6V2.5h7V6M4.5 11.5h-2V6h11v5.5h-2M4.5 9.5h7v4h-7z"],
  close: ["M4 4l8 8M12 4l-8 8"],
  sun: ["M8 5a3 3 0 1 0 0 6 3 3 0 0 0 0-6zM8 1.5v1.5M8 13v1.5M1.5 8H3M13 8h1.5M3.4 3.4l1 1M11.6 11.6l1 1M12.6 3.4l-1 1M4.4 11.6l-1 1"],
  moon: ["M13 9.6A5.5 5.5 0 0 1 6.4 3 5.5 5.5 0 1 0 13 9.6z"],
  auto: ["M8 2.5a5.5 5.5 0 1 0 0 11zM8 2.5a5.5 5.5 0 0 1 0 11"],
  enlarge: ["M9.5 2.5h4v4M13.5 2.5L9.2 6.8M6.5 13.5h-4v-4M2.5 13.5l4.3-4.3"],
  shrink: ["M13.5 6.5h-4v-4M9.5 6.5l4.3-4.3M2.5 9.5h4v4M6.5 9.5l-4.3 4.3"],
  about: ["M8 2a6 6 0 1 0 0 12A6 6 0 0 0 8 2zM8 7.4v3.8M8 4.7v.2"],
  check: ["M3 8.5l3.5 3.5L13 4.5"],
  presets: ["M6 4h7.5M6 8h7.5M6 12h7.5M2.5 4h1M2.5 8h1M2.5 12h1"],
  menu: ["M2.5 4h11M2.5 8h11M2.5 12h11"],
  more: ["M3.5 8h.01M8 8h.01M12.5 8h.01"],
  up: ["M8 13V3.5M4 7.5l4-4 4 4"],
  down: ["M8 3v9.5M4 8.5l4 4 4-4"],
  class: ["M8 7.5a2.2 2.2 0 1 0 0-4.4 2.2 2.2 0 0 0 0 4.4zM3.5 13c0-2.6 2-4 4.5-4s4.5 1.4 4.5 4M2.2 8.2a1.6 1.6 0 1 1 1.6-2.6M13.8 8.2a1.6 1.6 0 1 0-1.6-2.6"],
  camera: ["M2.5 5.5h2.7l1.2-2h3.2l1.2 2h2.7v7.5h-11zM8 11a2.3 2.3 0 1 0 0-4.6 2.3 2.3 0 0 0 0 4.6z"],
  files: ["M4 2.5h5l3 3v8H4zM9 2.5v3h3M6 8.5h4M6 11h4"],
  film: ["M2.5 3.5h11v9h-11zM5 3.5v9M11 3.5v9M2.5 6.5H5M2.5 9.5H5M11 6.5h2.5M11 9.5h2.5"],
};

/** @typedef {keyof typeof PATHS} IconName */

/** @param {{name: IconName}} props */
export function Icon({ name }) {
  const [path, solid = false] = /** @type {[string, boolean?]} */ (PATHS[name]);
  const pen = solid ? { fill: "currentColor", stroke: "none" } : { fill: "none", stroke: "currentColor" };
  return html`<svg viewBox="0 0 16 16" width="16" height="16" class="icon" aria-hidden="true" focusable="false">
    <path d=${path} stroke-width="1.5" stroke-linecap="round" stroke-linejoin="round" ...${pen} />
  </svg>`;
}

/**
 * A button with an icon alone.
 *
 * @param {{name: IconName, title: string, run: () => void}} props `title` says what it does.
 */
export function IconButton({ name, title, run }) {
  return html`<button type="button" class="quiet icon-only" title=${title} aria-label=${title} onClick=${run}>${h(Icon, { name })}</button>`;
}

/** @param {{name: IconName, title: string, href: string, rel: string, go: () => void}} props A link with an icon alone; `go` runs before. */
export function IconLink({ name, title, href, rel, go }) {
  return html`<a class="button quiet icon-only" rel=${rel} href=${href} title=${title} aria-label=${title} onClick=${go}>${h(Icon, { name })}</a>`;
}

/** @param {IconName} name */
export function icon(name) {
  return elementOf(h(Icon, { name }));
}
