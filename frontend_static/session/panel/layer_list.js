/** What a run's drawings show: boxes that switch their layers, and a legend of their colours. */

import { fill, h } from "../../shared/dom.js";
import { checkbox } from "./control.js";

/** @import { Layers } from "../flat/layers.js" */

/**
 * A box for each layer.
 *
 * @param {Layers} layers
 */
export function layerBoxes(layers) {
  return layers.declared.map(({ name, title }) => {
    const box = checkbox(title, "", (shown) => layers.set(name, shown));
    box.show(layers.isShown(name));
    return box.element;
  });
}

/**
 * What the colours mean that are drawn.
 *
 * @param {Layers} layers
 * @param {AbortSignal} signal
 */
export function layerLegend(layers, signal) {
  const legend = h("ul", { class: "legend", "aria-label": "Legend" });
  const draw = () => {
    const keys = layers.legend.map(({ colour, meaning }) => h("li", { class: "legend-key" }, h("i", { style: `background: var(--${colour})` }), meaning));
    fill(legend, keys);
  };
  layers.on(draw, signal);
  draw();
  return legend;
}
