/** The session page: finds or starts its session, and puts the parts together. */

import { api } from "../shared/api.js";
import { begun, isNew, scene } from "./session_start.js";
import { bookmarkMenu } from "./bookmarks.js";
import { branchDialog, branchLegend } from "./branches.js";
import { Commands } from "./commands.js";
import { fill, h, setText } from "../shared/dom.js";
import { helpDialog } from "./help.js";
import { icon } from "../shared/icons.js";
import { listen } from "./keys.js";
import { plots } from "./plots/plots.js";
import { readout } from "./readout.js";
import { scrubber } from "./scrubber/scrubber.js";
import { shareDialog } from "./share.js";
import { Store } from "./store.js";
import { Stream } from "../shared/stream.js";
import { themeButton } from "../shared/theme.js";
import { trackerTitle } from "./timeline.js";
import { toast } from "../shared/toast.js";
import { transport } from "./transport.js";
import { linkTo, targetOf } from "../shared/share_link.js";

const ENDED = "It may have been ended. What was saved of it is in the gallery.";
const GALLERY = { label: "Back to the gallery", href: "/" };

const part = (name) => document.querySelector(`[data-part="${name}"]`);
const store = new Store();
const commands = new Commands(store);
let experiment = { presets: [] };

const actions = {
  toggle: () => commands.toggle(),
  step: (direction) => commands.step(direction),
  jump: (frames) => commands.jump(frames),
  first: () => commands.first(),
  newest: () => commands.newest(),
  faster: (direction) => commands.faster(direction),
  beforeLoss: () => commands.beforeLoss(),
  bookmark: () => commands.bookmark(),
  branch: () => branchDialog(store, commands, experiment.default_tracker),
  help: () => helpDialog(experiment.presets),
  preset: (which) => openPreset(experiment.presets[which - 1]),
};

header();
transport(part("transport"), store, commands, [bookmarkMenu(store, commands)]);
scrubber(part("scrubber"), store, commands);
readout(part("readout"), store);
branchLegend(part("branches"), store, commands);
listen(actions, () => scene.window);
store.on("connection", () => {
  part("disconnected").hidden = store.connection !== "lost";
});
store.on("refused", ({ message }) => toast(message, { kind: "error" }));
scene.follow(store, commands);
plots(part("plots"), store, scene.drawn);
begin();

async function begin() {
  let session = null;
  let wish = null;
  try {
    ({ session, wish } = await begun);
  } catch (error) {
    if (error.status === 404 && !isNew) scene.fail("There is no such session", ENDED, GALLERY);
    else scene.fail(isNew ? "This session could not be started" : "This session cannot be shown", error.message, GALLERY);
    return;
  }
  new Stream(session.id, {
    message: (message) => store.receive(message),
    lost: () => store.setConnection("lost"),
    gone: () => {
      store.setConnection("gone");
      scene.fail("This session has ended", "What was saved of it is in the gallery.", GALLERY);
    },
  });
  api.experiment(session.experiment).then((found) => (experiment = found), () => {});
  if (wish?.play) {
    await scene.seen;
    await whenOpen(() => commands.toggle());
  }
}

/** Do something as soon as the session listens. */
function whenOpen(work) {
  return new Promise((resolve) => {
    let done = false;
    const look = () => {
      if (done || store.connection !== "open" || !commands.able) return;
      done = true;
      resolve(work());
    };
    store.on("session connection", look);
    look();
  });
}

/** A preset is a fresh run; the one that was watched stays among the running sessions. */
function openPreset(preset) {
  const { session } = store;
  if (!preset || session === null) return;
  const known = new Set(session.declarations.map(({ name }) => name));
  const wish = {
    ...targetOf(session),
    experiment: session.experiment,
    tracker: preset.tracker,
    seed: preset.seed,
    parameters: Object.fromEntries(Object.entries(preset.parameters).filter(([name]) => known.has(name))),
    play: true,
  };
  location.assign(linkTo(wish));
}

function header() {
  const title = h("h1", {});
  const sweep = h("a", { class: "link", title: "The sweep that this run comes from", hidden: true }, "Sweep");
  const tool = (name, text, hint, run) =>
    h("button", { type: "button", title: hint, disabled: true, on: { click: run } }, icon(name), h("span", { class: "wide-only" }, text));
  const tools = [
    tool("branch", "Branch", "Branch from this frame (N)", actions.branch),
    tool("save", "Save", "Save this run", () => commands.save()),
    tool("share", "Share", "Share a link to this run", () => store.session && shareDialog(store.session)),
  ];
  fill(
    part("header"),
    h("a", { class: "brand", href: "/" }, "pftrack"),
    sweep,
    title,
    h("span", { class: "spring" }),
    tools,
    themeButton(),
    h("button", { type: "button", class: "quiet icon-only", title: "Keys (?)", "aria-label": "Keys", on: { click: actions.help } }, "?"),
  );
  store.on("session branches position", () => {
    const { session } = store;
    if (session === null) return;
    const words = `${session.title} · ${trackerTitle(session, session.tracker)} · seed ${session.seed}`;
    setText(title, words);
    sweep.hidden = !session.sweep;
    if (session.sweep) sweep.href = `/sweep/${encodeURIComponent(session.sweep)}`;
    document.title = `${words} · pftrack`;
    for (const element of tools) element.disabled = store.connection !== "open" || !commands.able;
  });
}
