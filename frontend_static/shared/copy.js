/** A button that copies a text. */

import { elementOf } from "./dom.js";
import { toast } from "./toast.js";
import { h, html } from "../vendor/preact.js";

/**
 * @param {{label: string, text: string, what: string}} props `what` the copied text is, for those who hear the names of several such buttons.
 */
export function CopyButton({ label, text, what }) {
  const copy = async () => {
    try {
      await navigator.clipboard.writeText(text);
      toast("Copied");
    } catch {
      toast("The browser does not let this page copy; select the text and copy it with the keyboard", { kind: "error" });
    }
  };
  return html`<button type="button" aria-label=${`${label}: ${what}`} onClick=${copy}>${label}</button>`;
}

/**
 * @param {string} label
 * @param {string} text
 * @param {string} what
 */
export function copyButton(label, text, what) {
  return elementOf(h(CopyButton, { label, text, what }));
}
