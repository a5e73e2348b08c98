/** What the run so far comes to beside its truth: the measure that decides on success, and on request all others. */

import { fill, h } from "../shared/dom.js";
import { measureValue } from "../shared/format.js";
import { coalesce } from "../shared/timing.js";

/**
 * @param {HTMLElement} root
 * @param {import("./mount.js").Mounted} view
 */
export function measures(root, { store, signal }) {
  const leading = h("summary", {});
  const list = h("dl", {});
  const element = h("details", { class: "measures", hidden: true }, leading, list);
  root.append(element);
  let shown = "";
  const draw = coalesce(() => {
    const { session } = store;
    if (session === null) return;
    const { measured, computed } = session;
    const known = session.measures.filter(({ name }) => name in measured);
    const now = JSON.stringify([measured, computed]);
    if (now === shown) return;
    shown = now;
    // Without a truth there is nothing to measure.
    element.hidden = known.length === 0;
    const decisive = known.find(({ name }) => name === session.success_measure) ?? known[0];
    if (decisive === undefined) return;
    /** @param {import("../shared/messages.js").MeasurePublic} measure */
    const words = (measure) => measureValue(measured[measure.name], measure, computed + 1);
    fill(leading, h("span", {}, `So far: ${decisive.title.toLowerCase()}`), h("strong", {}, words(decisive)));
    const others = known.filter((measure) => measure !== decisive);
    fill(list, others.map((measure) => [h("dt", { title: measure.description }, measure.title.toLowerCase()), h("dd", {}, words(measure))]));
  }, signal);
  store.on(["measured", "computed"], draw);
}
