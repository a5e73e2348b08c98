/** What the run so far comes to beside its truth: the measure that decides on success, and on request all others. */

import { fill, h, setText } from "../shared/dom.js";
import { measureValue } from "../shared/format.js";
import { explain } from "../shared/terms.js";
import { coalesce } from "../shared/timing.js";

/** @import { MeasurePublic } from "../shared/messages.js" */

/**
 * @param {HTMLElement} root
 * @param {Pick<import("./mount.js").View, "store"|"signal">} view
 */
export function measures(root, { store, signal }) {
  const when = h("span", {});
  const leading = h("span", {});
  const value = h("strong", {});
  const list = h("dl", {});
  const all = h("details", {}, h("summary", { "aria-label": "All measures", title: "All measures" }, value), list);
  const element = h("div", { class: "measures", hidden: true }, h("span", { class: "leading" }, when, leading), all);
  root.append(element);
  /** @type {Map<string, HTMLElement>} */
  let values = new Map();
  let listed = "";
  const draw = coalesce(() => {
    const { session } = store;
    if (session === null) return;
    const { measured, computed } = session;
    const known = session.measures.filter(({ name }) => name in measured);
    // Without a truth there is nothing to measure.
    element.hidden = known.length === 0;
    const decisive = known.find(({ name }) => name === session.success_measure) ?? known[0];
    if (decisive === undefined) return;
    const others = known.filter((measure) => measure !== decisive);
    const now = [decisive, ...others].map(({ name }) => name).join(" ");
    if (now !== listed) {
      listed = now;
      values = new Map([[decisive.name, value], ...others.map(({ name }) => /** @type {[string, HTMLElement]} */ ([name, h("dd", {})]))]);
      nameOf(leading, decisive);
      fill(list, others.map((measure) => [nameOf(h("dt", {}), measure), values.get(measure.name)]));
    }
    setText(when, computed + 1 < session.frames ? "So far: " : "Whole run: ");
    for (const measure of known) setText(values.get(measure.name) ?? value, measureValue(measured[measure.name], measure, computed + 1));
  }, signal);
  store.on(["measured", "computed"], draw);
}

/**
 * @param {HTMLElement} place
 * @param {MeasurePublic} measure
 */
function nameOf(place, { title, description }) {
  fill(place, title.charAt(0).toLowerCase() + title.slice(1));
  explain(place, { own: description });
  return place;
}
