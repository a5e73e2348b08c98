/**
 * Which view of a session a page shows: what its address says, else what a person chose before, else what the browser can
 * draw fast. A 3-D scene that the processor has to draw is slow, and without WebGL there is none.
 */

import { remember, remembered } from "../shared/memory.js";

/** @typedef {"flat"|"scene"} ViewKind */

const NAME = "view";
const KEY = "pftrack-view";
/** What browsers call WebGL without a graphics card. */
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

/** @returns {ViewKind} */
export function chosenView() {
  return known(new URLSearchParams(location.search).get(NAME)) ?? known(remembered(KEY)) ?? (graphics() === "fast" ? "scene" : "flat");
}

/**
 * Remember what a person has chosen, in the address, too, if that says something else.
 *
 * @param {ViewKind} kind
 */
export function rememberView(kind) {
  remember(KEY, kind);
  const address = new URL(location.href);
  if (!address.searchParams.has(NAME)) return;
  address.searchParams.set(NAME, kind);
  history.replaceState(null, "", address);
}

/**
 * What the browser offers for 3-D scenes.
 *
 * @returns {"none"|"slow"|"fast"}
 */
export function graphics() {
  try {
    const context = document.createElement("canvas").getContext("webgl2");
    if (context === null) return "none";
    const names = context.getExtension("WEBGL_debug_renderer_info");
    const renderer = String(context.getParameter(names?.UNMASKED_RENDERER_WEBGL ?? context.RENDERER));
    context.getExtension("WEBGL_lose_context")?.loseContext();
    return SOFTWARE.test(renderer) ? "slow" : "fast";
  } catch {
    return "none";
  }
}

/**
 * @param {string|null} name
 * @returns {ViewKind|null}
 */
function known(name) {
  return name === "flat" || name === "scene" ? name : null;
}
