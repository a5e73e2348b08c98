/** The session page: one session with all its parts, and a header above it. */

import { ClassControl } from "../lecturer/class_control.js";
import { request } from "../shared/api.js";
import { attempt, part, toast } from "../shared/dom.js";
import { skipLink, tourOfAddress } from "../shared/page.js";
import { present } from "../shared/presentation.js";
import { linkTo } from "../shared/share_link.js";
import { isFollower, isParticipant } from "../shared/visitor.js";
import { h, html, render, signal } from "../vendor/preact.js";
import { Header } from "./header.js";
import { Mounted } from "./mount.js";
import { start } from "./page_start.js";
import { sessionTitle } from "./steering.js";

/** @import { IconName } from "../shared/dom.js" */
/** @import { ExperimentDetail, Preset, SessionPublic } from "../shared/messages.js" */
/** @import { Child } from "../vendor/preact.js" */

const experiment = signal(/** @type {ExperimentDetail|null} */ (null));

const actions = {
  help: async () => (await import("./dialogs.js")).helpDialog(),
  present: () => present(),
  compare: async () => {
    if (view.store.isSteerable && !isParticipant && store.session !== null) (await import("../shared/comparison.js")).compareDialog(store.session);
  },
  presets: () => {
    const opener = /** @type {HTMLElement|null} */ (document.querySelector(".top [aria-label=Presets]"));
    opener?.click();
    /** @type {HTMLElement|null} */ (document.querySelector(".preset-list button"))?.focus();
  },
  palette: async () => (await import("./palette.js")).openPalette(page),
};
const view = new Mounted(start, { actions });
const { store } = view;
const control = new ClassControl(() => {
  const { session } = store;
  return session === null || !view.store.isSteerable ? null : { title: sessionTitle(session), sessions: [session.id], lesson: null, arrangement: {} };
}, view.signal);
const page = { view, experiment, control, actions, editor: offerEditor(), openPreset };

render(h(Header, { page }), part("header"));
render(h(Bars, {}), part("bars"));
skipLink();
if (!isFollower) start.begun.then(() => control.find(), () => {});
document.addEventListener("keydown", (event) => {
  if (event.key.toLowerCase() !== "k" || !(event.ctrlKey || event.metaKey) || event.altKey || event.shiftKey) return;
  event.preventDefault();
  if (document.querySelector("dialog[open]") === null) actions.palette();
});
const tour = tourOfAddress();
start.begun.then(async ({ session }) => {
  if (session.remark) toast(session.remark, { kind: "error" });
  if (tour !== null) (await import("./tour.js")).guide(view, tour);
  page.editor.isOffered.value = (await offered(session).catch(() => [])).length > 0;
  experiment.value = await request("GET experiments/{experiment}", { experiment: session.recipe.experiment });
}).catch(() => {});

/** Problems, in lines between the header and the session. */
function Bars() {
  const { session, connection } = store;
  const { problem, position } = session ?? {};
  const place = problem && (problem.line === null ? problem.file : `${problem.file}, line ${problem.line}`);
  const mend = problem && `${problem.text}. The run stands at frame ${position}. Mend the line and save the file.`;
  return html`
    ${connection.value === "lost" && html`<div class="bar-lost" role="status">Reconnecting</div>`}
    ${problem && html`<p class="bar-problem" role="alert"><strong>${place}</strong>${" "}${mend}</p>`}
  `;
}

/** Open a preset as a new run; the present one stays among the running sessions.
 * A class that sees this page is taken along.
 *
 * @param {Preset} preset
 */
function openPreset(preset) {
  const { session } = store;
  if (session === null) return;
  const known = new Set(session.declarations.map(({ name }) => name));
  const values = Object.fromEntries(Object.entries(preset.parameters).filter(([name]) => known.has(name)));
  const { experiment: id, footage } = session.recipe;
  const recipe = { experiment: id, tracker: preset.tracker, seed: preset.seed, timeline: [{ frame: 0, values }], footage };
  control.takeAlong();
  location.assign(linkTo({ recipe, upload: session.upload, play: true }));
}

/** The editor is available if the server was started with a writable filter of this experiment. */
function offerEditor() {
  const element = part("editor");
  const isOffered = signal(false);
  let isMade = false;
  const toggle = () =>
    attempt(async () => {
      element.hidden = isMade && !element.hidden;
      /** @type {HTMLElement|null} */ (element.querySelector(".cm-content"))?.focus();
      if (isMade) return;
      isMade = true;
      const [file] = await offered(store.known);
      // The editor is large, and few pages need it.
      const { Editor } = await import("./editor.js");
      render(h(Editor, { store, file, close: toggle }), element);
    });
  return { isOffered, toggle };
}

/** A participant of a class may not read filter files.
 *
 * @param {SessionPublic} session
 */
async function offered({ recipe }) {
  if (isParticipant) return [];
  return (await request("GET filters")).filter((file) => file.editable && file.experiment === recipe.experiment);
}
