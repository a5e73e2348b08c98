/** Other seeds: a switch that draws a band behind the curve of the error, and tells the share of runs that hold. */

import { later } from "../../shared/timing.js";
import { html, useComputed, useEffect, useMemo, useSignal, useSignalEffect } from "../../vendor/preact.js";
import { Exploration, settingsOf } from "./exploration.js";

/** @import { Bands } from "../../shared/messages.js" */
/** @import { Mounted } from "../mount.js" */

/** A slider that is dragged changes twenty times a second. */
const SETTLE_MS = 150;
const HINT = "Forty runs with other random numbers on the same scene: the 10, 50 and 90 % quantiles of their errors lie behind the curve";

/** @param {{view: Mounted}} props */
export function OtherSeeds({ view: { store, signal } }) {
  const isOn = useSignal(false);
  const exploration = useMemo(() => new Exploration(store, signal), []);
  const settings = useComputed(() => (store.session === null ? "" : settingsOf(store.session)));
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
  // No seed alters a replay.
  if (!store.isAwake || store.known.trackers.some(({ id, replays }) => id === store.known.tracker && replays)) return null;
  return html`<div class="explore" role="group" aria-label="Other seeds">
    <button type="button" class="chip" aria-pressed=${String(isOn.value)} title=${HINT} onClick=${() => (isOn.value = !isOn.value)}>Other seeds</button>
    <output class="explore-words">${isOn.value && (exploration.error.value || words(bands, store.known.position))}</output>
  </div>`;
}

/**
 * How many runs hold in a frame.
 *
 * @param {Bands|null} bands
 * @param {number} frame
 */
function words(bands, frame) {
  if (bands === null) return "computing…";
  const { holding: { [frame]: share }, computed: { [frame]: runs = 0 } } = bands;
  if (share === undefined) return "not computed yet";
  return share === null ? `${runs} runs` : `${Math.round(share * runs)} of ${runs} hold in this frame`;
}
