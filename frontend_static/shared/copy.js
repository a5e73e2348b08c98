/** A button that copies a text. */

import { h } from "./dom.js";
import { toast } from "./toast.js";

/**
 * @param {string} label
 * @param {string} text What is copied.
 * @param {string} what What that is, for those who hear the names of several such buttons.
 * @returns {HTMLButtonElement}
 */
export function copyButton(label, text, what) {
  const copy = async () => {
    try {
      await navigator.clipboard.writeText(text);
      toast("Copied");
    } catch {
      toast("The browser does not let this page copy; select the text and copy it with the keyboard", { kind: "error" });
    }
  };
  return h("button", { type: "button", "aria-label": `${label}: ${what}`, on: { click: copy } }, label);
}
