/** A picture that keeps its place while it loads, and leaves a plain field if it cannot. */

import { h } from "./dom.js";

/** @param {string} address */
export function thumbnail(address) {
  const image = h("img", { src: address, alt: "", loading: "lazy", width: 320, height: 240 });
  image.addEventListener("error", () => image.classList.add("missing"));
  return image;
}
