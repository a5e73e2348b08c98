/** BokehJS, which draws the plots: a megabyte of script that has to be asked for. */

import { h } from "../../shared/dom.js";

export const SCRIPTS = ["/static/bokeh/bokeh.min.js", "/static/bokeh/bokeh-api.min.js"];

/** Load BokehJS. */
export async function loadBokeh() {
  for (const source of SCRIPTS) await script(source);
  return globalThis.Bokeh;
}

function script(source) {
  return new Promise((resolve, reject) => {
    const element = h("script", { src: source });
    element.addEventListener("load", resolve);
    element.addEventListener("error", () => reject(new Error(source)));
    document.head.append(element);
  });
}
