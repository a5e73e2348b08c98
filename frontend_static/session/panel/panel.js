/**
 * What one can try in a session: tracker, the parameters that the run's preset is about, and behind *More* every other that the
 * tracker reads, the seed, and what to draw.
 *
 * A control never decides. It proposes a value, the session accepts or refuses it, and the panel shows what the session
 * says.
 */

import { remember, remembered } from "../../shared/memory.js";
import { h, html, useMemo, useSignal } from "../../vendor/preact.js";
import { StopAtLoss } from "../transport.js";
import { OtherSeeds } from "../why/other_seeds.js";
import { Choice, DeclaredControl, LayerBoxes, NumberBox } from "./control.js";
import { Proposals, sendValues } from "./proposals.js";

/** @import { Declaration, SessionPublic } from "../../shared/messages.js" */
/** @import { Child } from "../../vendor/preact.js" */
/** @import { Mounted } from "../mount.js" */
/** @import { Values } from "./proposals.js" */

const TRACKER_HINT = "What follows the target; a change counts from the next frame.";
const FIT_HINT = "Find the values under which what was seen is most probable, instead of tuning by eye.";
const SEED_HINT = "The same seed gives the same scene and the same run, to the bit. A change starts the run again.";
/** So many parameters are tried first. */
const FIRST = 5;
/** Of a run without a preset, so many. */
const FIRST_OF_ALL = 3;

/** @param {{view: Mounted}} props */
export function Panel({ view }) {
  const { session } = view.store;
  return session && h(Parameters, { view, session });
}

/** @param {{view: Mounted, session: SessionPublic}} props */
function Parameters({ view, session }) {
  const { store, scene, signal } = view;
  const proposals = useMemo(() => new Proposals((values) => sendValues(session.id, values), signal), []);
  /** Where there is little room they open above the rest. */
  const isOpen = useSignal(false);
  const { parameters, tracker, trackers, recipe, title } = session;
  /** @type {Values} */
  const inForce = { ...parameters, tracker, seed: recipe.seed, ...proposals.held };
  const of = (/** @type {string} */ name) => (/** @type {import("../../shared/format.js").Value} */ value) => proposals.propose(name, value);
  const control = (/** @type {Declaration} */ declaration) =>
    h(DeclaredControl, { key: declaration.name, declaration, value: inForce[declaration.name], propose: of(declaration.name) });
  const read = readBy(session);
  const first = firstOf(session, read);
  const others = read.filter((each) => !first.includes(each));
  const groups = [...new Set(others.map(({ group }) => group))];
  const layers = scene?.layers ?? null;
  const options = trackers.map((each) => [each.id, each.title]);
  const fit = async () => (await import("../fit.js")).fitDialog(store);
  const opener = html`<button type="button" class="controls-opener" aria-expanded=${String(isOpen.value)} onClick=${() => (isOpen.value = !isOpen.value)}>
    ${isOpen.value ? "Close" : "Parameters"}
  </button>`;
  const more = [
    h(NumberBox, { label: "Seed", hint: SEED_HINT, min: 0, step: 1, value: Number(inForce.seed), propose: of("seed") }),
    scene !== null && h(OtherSeeds, { view }),
    h(StopAtLoss, { view }),
    (session.fittable[tracker] ?? []).length > 0 && html`<button type="button" class="quiet" title=${FIT_HINT} onClick=${fit}>Fit noise to data…</button>`,
    groups.map((group) => {
      const members = others.filter((each) => each.group === group);
      return h(Fold, { key: group, experiment: title, title: group || "Parameters" }, members.map(control));
    }),
    layers !== null && layers.declared.length > 0 && h(Fold, { experiment: title, title: "What to draw" }, h(LayerBoxes, { layers })),
  ];
  return html`<div class="panel-body" data-open=${String(isOpen.value)} inert=${store.connection !== "open" || !store.isSteerable}>
    <h2>Try</h2>
    ${opener}
    <div class="panel-controls">
      ${h(Choice, { label: "Tracker", hint: TRACKER_HINT, options, value: String(inForce.tracker), propose: of("tracker") })}
      ${first.map(control)}
      ${h(Fold, { experiment: title, title: "More", name: "More parameters" }, more)}
      ${h(Effect, { session })}
    </div>
  </div>`;
}

/**
 * The parameters that a session's tracker reads, without the files, which are brought in by the menu.
 *
 * @param {SessionPublic} session
 */
export function readBy({ declarations, parameters, tracker }) {
  return declarations.filter(
    ({ name, kind, trackers }) => name in parameters && kind !== "file" && (trackers.length === 0 || trackers.includes(tracker)),
  );
}

/**
 * The parameters of a filter of one's own, and those that the preset is about; failing them, the first that have a slider.
 *
 * @param {SessionPublic} session
 * @param {Declaration[]} read Those that the tracker reads.
 */
function firstOf({ about, recipe, tracker }, read) {
  const own = tracker in (recipe.filters ?? {}) ? read.filter(({ trackers }) => trackers.length === 1) : [];
  const first = [...own, ...about.flatMap((name) => read.filter((each) => each.name === name))].slice(0, FIRST);
  return first.length > 0 ? first : read.filter(({ useful }) => useful !== null).slice(0, FIRST_OF_ALL);
}

/**
 * What a change will do, where it does more than count from the next frame on.
 *
 * @param {{session: SessionPublic}} props
 */
function Effect({ session: { branch_point: frame, position, frames, playing } }) {
  const end = frame !== null && position === frames - 1 && `The run has ended. A change runs it again from frame ${frame}, as a branch.`;
  return html`<p class="control-effect" role="status" hidden=${frame === null || playing}>${end || `A change at frame ${frame} makes a branch.`}</p>`;
}

/**
 * A fold that stays as a person has left it in this browser, for each experiment. The 3-D scene's panel keeps its folds in the
 * same place (`folds.js` of the viser adapter).
 *
 * @param {{experiment: string, title: string, name?: string, children?: Child}} props `name` is what the scene's panel calls it
 */
function Fold({ experiment, title, name = title, children }) {
  const place = `pftrack-folds ${experiment}`;
  const kept = () => JSON.parse(remembered(place) ?? "{}");
  // Pressed by mouse or key: `toggle` would also be told of what is open from the start.
  const press = (/** @type {Event & {currentTarget: HTMLElement}} */ { currentTarget }) => {
    remember(place, JSON.stringify({ ...kept(), [name]: !currentTarget.parentElement?.hasAttribute("open") }));
  };
  return html`<details class="control-group" open=${Boolean(kept()[name])}><summary onClick=${press}>${title}</summary>${children}</details>`;
}
