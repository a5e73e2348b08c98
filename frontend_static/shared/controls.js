/** Controls to choose one of several things. */

import { html } from "../vendor/preact.js";

/**
 * What can be chosen: the value, the words for it, and its group in a list.
 *
 * @typedef {{value: string, words: string, hint?: string, group?: string}} Option
 */

/** @typedef {{label: string, options: readonly Option[], value: string, choose: (value: string) => void}} Props */

/** @param {Props & {field?: string}} props `field` is what the server calls it. */
export function Select({ label, options, value, choose, field }) {
  const groups = [...new Set(options.map(({ group = "" }) => group))].map((group) => {
    const members = options.filter((option) => (option.group ?? "") === group).map((option) => html`<option value=${option.value}>${option.words}</option>`);
    return group ? html`<optgroup label=${group}>${members}</optgroup>` : members;
  });
  const change = (/** @type {{currentTarget: HTMLSelectElement}} */ { currentTarget }) => choose(currentTarget.value);
  return html`<select aria-label=${label} data-field=${field} value=${value} onChange=${change}>${groups}</select>`;
}

/** @param {Props} props A row of buttons; the pressed one is chosen. */
export function Segments({ label, options, value, choose }) {
  const buttons = options.map((option) =>
    html`<button type="button" title=${option.hint} aria-pressed=${option.value === value} onClick=${() => choose(option.value)}>${option.words}</button>`,
  );
  return html`<span class="segments" role="group" aria-label=${label}>${buttons}</span>`;
}
