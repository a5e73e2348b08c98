/** The list of keys. */

import { openDialog } from "../shared/dialog.js";
import { h } from "../shared/dom.js";
import { HELP } from "./keys.js";

/** @param {{name: string, title: string}[]} presets */
export function helpDialog(presets) {
  openDialog("Keys", () => [
    h(
      "dl",
      { class: "keys" },
      HELP.map(({ keys, what }) => [h("dt", {}, keys.split(" ").map((key) => (key === "–" ? " – " : h("kbd", {}, key)))), h("dd", {}, what)]),
    ),
    presets.length > 0 && h("p", { class: "hint" }, `Presets: ${presets.map(({ title }, index) => `${index + 1} ${title}`).join(", ")}`),
  ]);
}
