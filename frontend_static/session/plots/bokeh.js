/** BokehJS, which draws the plots: a megabyte of script that has to be asked for. */

import { h } from "../../shared/dom.js";

/** Their addresses have the version of this module's own. */
export const SCRIPTS = ["bokeh.min.js", "bokeh-api.min.js"].map((name) => new URL(`../../bokeh/${name}`, import.meta.url).pathname);

/** @import { BokehApi } from "./bokeh_api.js" */

/** @type {Promise<BokehApi>|null} */
let loading = null;

/** Load BokehJS, once for all sessions of the page. */
export function loadBokeh() {
  loading ??= load();
  // Who asks again after a failure gets another try.
  loading.catch(() => (loading = null));
  return loading;
}

async function load() {
  await Promise.all(SCRIPTS.map((source) => script(source)));
  globalThis.Bokeh.set_log_level("error");
  return globalThis.Bokeh;
}

/**
 * @param {string} source
 * @returns {Promise<Event>}
 */
function script(source) {
  return new Promise((resolve, reject) => {
    const element = h("script", {});
    element.async = false;  // all are fetched at once and run in their order
    element.src = source;
    element.addEventListener("load", resolve);
    element.addEventListener("error", () => reject(new Error(source)));
    document.head.append(element);
  });
}
