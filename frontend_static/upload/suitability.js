/** Before tracking: whether a target can be followed, where in the picture the likelihood is high, and what would help. */

import { api, messageOf } from "../shared/api.js";
import { VIRIDIS } from "../shared/palette.js";
import { later } from "../shared/timing.js";
import { h, html, useEffect, useRef, useSignal } from "../vendor/preact.js";

/** @import { SuitabilityPublic } from "../shared/messages.js" */
/** @import { Mark } from "../shared/marks/mark_json.js" */
/** @import { Target } from "./target.js" */

/** So long a mark must stand still before it is looked at: while a box is dragged, it changes with every movement. */
const STILL_MS = 250;
const SLOW_MS = 400;
const RAMP = `background: linear-gradient(90deg, ${VIRIDIS.map((colour) => `rgb(${colour.join(" ")})`).join(", ")})`;
const CHECKING = "Checking whether this target can be tracked";

/** @param {{target: Target}} props Looks at a target once it stands still. */
export function Suitability({ target }) {
  const { upload, experiment, footage } = target;
  /** What was found, or why nothing was. */
  const known = useSignal(/** @type {SuitabilityPublic|string|null} */ (null));
  /** Whether the answer about what is marked now takes long. */
  const isLate = useSignal(false);
  const end = useRef(new AbortController());
  const { mark, start } = footage.value ?? {};
  const forget = () => {
    end.current.abort();
    isLate.value = false;
    known.value = null;
  };
  useEffect(() => {
    const { signal } = (end.current = new AbortController());
    const look = async (/** @type {Mark} */ about) => {
      later(() => (isLate.value = true), SLOW_MS, signal);
      const question = { experiment: experiment.id, frame: Number(start), mark: JSON.stringify(about) };
      const answer = await api.suitability(upload.id, question, signal).catch(messageOf);
      if (signal.aborted) return;
      forget();
      known.value = answer;
    };
    if (mark) later(() => look(mark), STILL_MS, signal);
    else forget();
    return () => end.current.abort();
  }, [JSON.stringify(mark), start]);
  const found = known.value === null || typeof known.value === "string" ? null : known.value;
  const late = isLate.value && html`
    <p class="hint">${CHECKING}</p>
    <progress aria-label=${CHECKING}></progress>
    <button type="button" onClick=${forget}>Stop</button>
  `;
  // The last picture stays until there is another one, so that nothing jumps.
  return html`<section class=${late ? "suits stale" : "suits"} aria-label="Can it be tracked?">
    ${found?.picture && html`
      <img class="suits-picture" alt=${`Likelihood over the picture. ${found.remark}`} src=${found.picture} width=${upload.width} height=${upload.height} />
      <p class="suits-key hint">Likelihood <span>low</span><span class="suits-ramp" style=${RAMP}></span><span>high</span></p>
    `}
    <div class="suits-words" role="status" data-grade=${late || !found ? "" : found.grade}>
      ${late || h(Words, { known: known.value, take: (better) => target.take(better) })}
    </div>
  </section>`;
}

/** @param {{known: SuitabilityPublic|string|null, take: (mark: Mark) => void}} props `take` is called when a person takes a mark that suits better. */
function Words({ known, take }) {
  if (known === null) return html`<p class="hint">Mark the target to see whether it can be tracked.</p>`;
  if (typeof known === "string") return html`<p class="wrong" role="alert">${known}</p>`;
  const { remark, advice, better } = known;
  return html`
    <p class="suits-remark">${remark}</p>
    ${advice.map((said) => html`<p class="hint">${said}</p>`)}
    ${better && html`<button type="button" data-role="better" onClick=${() => take(better)}>Use the proposed mark</button>`}
  `;
}
