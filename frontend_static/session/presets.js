/** The presets of a session's experiment: a button with a list under it. */

import { fill, h } from "../shared/dom.js";
import { icon } from "../shared/icons.js";
import { popover } from "./popover.js";

/** @import { Preset } from "../shared/messages.js" */

/** @param {(preset: Preset) => void} choose Called with the preset that is chosen. */
export function presetMenu(choose) {
  const list = h("ul", { class: "menu-list preset-list" });
  const title = "Presets: what to look at in this experiment (P)";
  const button = h("button", { type: "button", title, "aria-label": "Presets", hidden: true }, icon("presets"), h("span", { class: "wide-only" }, "Presets"));
  const element = popover(button, list);
  return {
    element,
    /** @param {Preset[]} presets */
    fill(presets) {
      button.hidden = presets.length === 0;
      fill(list, presets.map((preset) => entry(preset, choose)));
    },
    /** Open the list, with the first of them under the keys. */
    open() {
      if (button.hidden || !button.isConnected) return;
      button.click();
      list.querySelector("button")?.focus();
    },
  };
}

/**
 * @param {Preset} preset
 * @param {(preset: Preset) => void} choose
 */
function entry(preset, choose) {
  const words = [h("span", {}, preset.title), h("span", { class: "hint" }, preset.watch)];
  return h("li", {}, h("button", { type: "button", class: "quiet grow", data: { preset: preset.name }, on: { click: () => choose(preset) } }, words));
}
