/** The session page: one session with all its parts, and a header above it. */

import { aboutDialog } from "./about.js";
import { api } from "../shared/api.js";
import { askName } from "../shared/dialog.js";
import { fill, h, part, setText } from "../shared/dom.js";
import { icon, iconButton } from "../shared/icons.js";
import { navigation } from "../shared/navigation.js";
import { present, presentationButton } from "../shared/presentation.js";
import { linkTo, newSweep } from "../shared/share_link.js";
import { explain } from "../shared/terms.js";
import { themeButton } from "../shared/theme.js";
import { attempt, toast } from "../shared/toast.js";
import { tourOfAddress } from "../shared/tour_link.js";
import { END_FORK, endFork } from "../lecturer/api.js";
import { brand, isFollower, isParticipant } from "../shared/participant.js";
import { followChip } from "../lecturer/chip.js";
import { ClassControl } from "../lecturer/class_control.js";
import { compareDialog } from "../shared/comparison_dialog.js";
import { editorButton } from "./editor/editor_button.js";
import { helpDialog } from "./help.js";
import { mount } from "./mount.js";
import { presetMenu } from "./presets.js";
import { start } from "./page_start.js";
import { shareDialog } from "./share.js";
import { sessionTitle } from "./timeline.js";
import { guide } from "./tour/tour.js";
import { wideNote } from "./wide_note.js";

/** @import { ExperimentDetail, Preset, SessionPublic } from "../shared/messages.js" */

/** @type {ExperimentDetail|null} */
let experiment = null;

const actions = {
  help: helpDialog,
  present: () => present(),
  compare: () => {
    if (view.able && !isParticipant && store.session !== null) compareDialog(store.session);
  },
  presets: () => presets.open(),
};
const view = mount(start.element, { start, actions });
const { store, commands } = view;
const presets = presetMenu(openPreset);
const control = new ClassControl(() => {
  const { session } = store;
  return session === null || !view.able ? null : { title: sessionTitle(session), sessions: [session.id], lesson: null };
}, view.signal);

header();
wideNote(part("too-narrow"));
if (!isFollower) start.begun.then(() => control.find(), () => {});
store.on(["tracker", "recipe", "state", "connection"], () => control.update());
store.on(["connection"], () => {
  part("disconnected").hidden = store.connection !== "lost";
});
store.on(["problem", "position"], () => {
  const { problem, position } = store.known;
  const place = problem && (problem.line === null ? problem.file : `${problem.file}, line ${problem.line}`);
  part("problem").hidden = !problem;
  if (problem) fill(part("problem"), h("strong", {}, place), `${problem.text}. The run stands at frame ${position}. Mend the line and save the file.`);
});
const tour = tourOfAddress();
if (tour !== null) start.begun.then(() => guide(view, tour), () => {});
start.begun.then(({ session }) => session.remark && toast(session.remark, { kind: "error" }), () => {});
start.begun
  .then(({ session }) => api.experiment(session.recipe.experiment))
  .then((found) => presets.fill((experiment = found).presets), () => {});

/**
 * A preset is a fresh run; the one that was watched stays among the running sessions.
 *
 * A class that sees this page comes along.
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

function header() {
  const title = h("h1", {});
  const sweep = h("a", { class: "button icon-only", "aria-label": "Sweep", hidden: true }, icon("sweep"));
  const rename = iconButton("rename", "Rename this session", async () => {
    const { session } = store;
    const name = session && (await askName("Rename this session", session.name));
    if (session && name !== null) await attempt(() => api.renameSession(session.id, name));
  });
  rename.dataset.role = "rename";
  const about = h(
    "button",
    {
      type: "button",
      class: "quiet",
      title: "About this experiment, and how to cite it",
      data: { role: "about" },
      on: { click: () => experiment && aboutDialog(experiment) },
    },
    icon("about"),
    h("span", { class: "wide-only" }, "About"),
  );
  const steering = tools();
  fill(
    part("header"),
    brand(),
    title,
    !isParticipant && rename,
    h("span", { class: "spring" }),
    !isParticipant && presets.element,
    !isParticipant && editorButton(store),
    steering,
    sweep,
    !isFollower && followChip(control, view.signal),
    themeButton(),
    presentationButton({ hears: false }),
    about,
    h("button", { type: "button", class: "quiet icon-only", title: "Keys (?)", "aria-label": "Keys", on: { click: actions.help } }, "?"),
  );
  if (!isParticipant) navigation(null);
  store.on(["name", "tracker", "recipe", "state", "connection"], () => {
    const { session } = store;
    if (session === null) return;
    const words = sessionTitle(session);
    setText(title, words);
    explain(title, { experiment: session.recipe.experiment });
    linkSweep(sweep, session);
    document.title = `${words} · pftrack`;
    for (const element of steering) element.disabled = !view.able;
  });
}

/**
 * Lead to the sweep that a run comes from, or to a new one.
 *
 * @param {HTMLAnchorElement} link
 * @param {SessionPublic} session
 */
function linkSweep(link, session) {
  link.hidden = isParticipant;
  link.title = session.sweep ? "The sweep that this run comes from" : "Repeat this run with other seeds, parameters and trackers";
  link.href = session.sweep ? `sweep/${encodeURIComponent(session.sweep)}` : newSweep(repeated(session));
}

/**
 * The plan of a sweep over a session's scene or recording, with the values with which the run began, over what was moved last.
 *
 * @param {SessionPublic} session
 */
function repeated({ recipe, tracker, upload }) {
  const { footage, timeline } = recipe;
  const [first] = timeline ?? [];
  const last = timeline?.findLast(({ frame }) => frame > 0);
  const axes = Object.keys(last?.values ?? {}).slice(-1).map((name) => ({ name }));
  const parameters = first?.frame === 0 ? first.values : {};
  return { experiment: recipe.experiment, upload, footage, axes, trackers: [recipe.tracker ?? tracker], parameters };
}

/** What can be done with the run beside moving through it; whoever came by the link of a class keeps nothing here. */
function tools() {
  return [
    ...(isParticipant ? [] : [tool("compare", "Compare", "Compare this run with others (C)", actions.compare)]),
    tool("branch", "Branch", "Branch from this frame (N)", view.actions.branch),
    ...(isParticipant ? [] : [
      tool("save", "Save", "Save this run", () => commands.save()),
      tool("share", "Share", "Share a link to this run", () => store.session && shareDialog(store.session)),
    ]),
    ...(isFollower ? [tool("close", "End", END_FORK, endFork)] : []),
  ];
}

/**
 * @param {import("../shared/icons.js").IconName} name
 * @param {string} text
 * @param {string} hint
 * @param {(() => void)|undefined} run
 */
function tool(name, text, hint, run) {
  const properties = { type: "button", class: "tool", title: hint, data: { tool: name }, disabled: true, on: { click: run } };
  return h("button", properties, icon(name), h("span", { class: "wide-only" }, text));
}
