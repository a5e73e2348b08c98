/** The line of the files that is about truth: bringing it in, marking it in the pictures, and taking away what is known. */

import { api } from "../../shared/api.js";
import { h } from "../../shared/dom.js";
import { giveTruth } from "./give_truth.js";
import { markTruth } from "./marking.js";

/**
 * @param {import("../mount.js").Mounted} view Of a session on an upload that takes truth.
 * @returns {{element: HTMLLIElement, look: () => Promise<void>}} `look` finds out whether there is something to take away.
 */
export function truthRow(view) {
  const { id, upload, recipe, truth_columns: columns, truth_mark: mark } = view.store.known;
  const send = async () => {
    const files = [...(input.files ?? [])];
    input.value = "";
    if (files.length > 0) await giveTruth(id, files);
  };
  /** @type {HTMLInputElement} */
  const input = h(
    "input",
    { type: "file", accept: ".csv,.txt,.xml,.json,text/csv", class: "visually-hidden", "aria-label": "Truth", data: { file: "truth" }, on: { change: send } },
  );
  const words = `A table, CSV, with the columns ${columns.join(", ")}; frames count from 0 in the recording`;
  const press = () => {
    /** @type {HTMLElement|null} */ (element.closest("[popover]"))?.hidePopover();
    markTruth(view);
  };
  const marking = { type: "button", class: "quiet", title: "Mark the target in the pictures (T)", data: { role: "mark-truth" }, on: { click: press } };
  const away = { class: "button quiet", hidden: true, download: true, title: "The truth that is known, CSV", data: { role: "known-truth" } };
  const known = h("a", away, "Download");
  const look = async () => {
    if (upload === null) return;
    known.href = api.truthAddress(upload, recipe.experiment);
    known.hidden = (await api.truth(upload, recipe.experiment).catch(() => null)) === null;
  };
  const element = h("li", {}, h("label", { class: "button quiet grow", title: words }, "Truth, CSV…", input), mark && h("button", marking, "Mark…"), known);
  return { element, look };
}
