/** What the colours mean. */

import { fill, h } from "../shared/dom.js";
import { css, diverging, gradient, verdict, viridis } from "./colours.js";
import { differenceEnd, errorEnd, short } from "./look.js";
import { onTheme } from "../shared/theme.js";

export function legend(root, store) {
  const draw = () => store.cells !== null && fill(root, content(store));
  store.on("sweep cells view comparison", draw);
  onTheme(draw);
}

function content(store) {
  const { view, sweep } = store;
  const unit = sweep.unit ? ` ${sweep.unit}` : "";
  const quantity = view.show === "error" || (store.compares && view.measure === "error") ? "error" : "success";
  const parts = [];
  if (quantity === "success") parts.push(scale("Success rate", gradient(viridis), "0", "1"));
  else {
    const { most, words } = errorEnd(store);
    parts.push(scale("Mean error", gradient(viridis), `${short(most)}${unit}${words}`, `0${unit}`));
  }
  if (store.compares) {
    const [first, second] = [view.first, view.second].map((id) => store.shortOf(id));
    if (view.show === "difference") {
      const { most, words } = differenceEnd(store);
      const amount = `${short(most)}${view.measure === "error" ? unit : ""}${words}`;
      parts.push(scale("Difference", gradient((share) => diverging(-share), -1), `${first} better by ${amount}`, `${second} better`));
    } else {
      parts.push(key(css(verdict("first")), `${first} better`), key(css(verdict("second")), `${second} better`), key(css(verdict("none")), "not significant"), key(css(verdict("untested")), "not applicable"));
    }
  }
  if (sweep.state === "running") parts.push(h("span", { class: "legend-key" }, h("span", { class: "swatch pending" }), "to come"));
  parts.push(h("span", { class: "legend-key" }, h("span", { class: "swatch hatched" }), "not tested"));
  return parts;
}

function scale(name, background, low, high) {
  const bar = h("span", { class: "legend-bar", role: "img", "aria-label": `Colours from ${low} to ${high}` });
  bar.style.background = background;
  return h("span", { class: "legend-key" }, h("strong", {}, name), low, bar, high);
}

function key(background, words) {
  const swatch = h("span", { class: "swatch" });
  swatch.style.background = background;
  return h("span", { class: "legend-key" }, swatch, words);
}
