/** Other seeds: a switch above the plot of the error, which then has a band behind its curve, and the share that holds. */

import { later } from "../../shared/timing.js";
import { html, useEffect, useMemo, useSignal, useSignalEffect } from "../../vendor/preact.js";
import { Exploration, settingsOf } from "./exploration.js";

/** @import { Bands } from "../../shared/messages.js" */
/** @import { Mounted } from "../mount.js" */

/** A slider that is dragged changes twenty times a second. */
const SETTLE_MS = 150;
const HINT = "Forty runs of the same settings on the same scene with other random numbers: 10, 50 and 90 % of their errors behind the curve";

/** @param {{view: Mounted}} props */
export function OtherSeeds({ view: { store, signal } }) {
  const isOn = useSignal(false);
  const exploration = useMemo(() => new Exploration(store, signal), []);
  const settings = useSignal("");
  useSignalEffect(() => {
    settings.value = store.session === null ? "" : settingsOf(store.session);
  });
  useSignalEffect(() => {
    if (isOn.value && settings.value !== "") return later(() => exploration.begin({ kind: "ensemble" }), SETTLE_MS, signal);
    exploration.stop();
    exploration.job.value = null;
    return undefined;
  });
  const result = exploration.job.value?.result;
  const bands = result && "holding" in result ? result : null;
  useEffect(() => {
    store.ensemble = bands;
  }, [bands]);
  // What was computed elsewhere is the same whatever one changes.
  if (!store.isAwake || store.known.trackers.some(({ id, replays }) => id === store.known.tracker && replays)) return null;
  return html`<div class="explore" role="group" aria-label="Other seeds">
    <button type="button" class="chip" aria-pressed=${String(isOn.value)} title=${HINT} onClick=${() => (isOn.value = !isOn.value)}>Other seeds</button>
    <output class="explore-words">${isOn.value && (exploration.error.value || words(bands, store.known.position))}</output>
  </div>`;
}

/**
 * What is so in a frame.
 *
 * @param {Bands|null} bands
 * @param {number} frame
 */
function words(bands, frame) {
  if (bands === null) return "computing…";
  const { holding: { [frame]: share }, computed: { [frame]: runs = 0 } } = bands;
  if (share === undefined) return "not there yet";
  return share === null ? `${runs} runs` : `${Math.round(share * runs)} of ${runs} hold in this frame`;
}
