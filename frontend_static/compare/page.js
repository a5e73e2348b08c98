/** The page of a comparison: what its address names, beside each other, and a link that holds all that makes it. */

import { absolute } from "../shared/address.js";
import { api, messageOf } from "../shared/api.js";
import { copyButton } from "../shared/copy.js";
import { askName, openDialog } from "../shared/dialog.js";
import { fill, h, part, setText } from "../shared/dom.js";
import { exportLists } from "../shared/exports.js";
import { icon, iconButton } from "../shared/icons.js";
import { navigation } from "../shared/navigation.js";
import { notice } from "../shared/notice.js";
import { present, presentationButton } from "../shared/presentation.js";
import { printButton } from "../shared/print.js";
import { sourceCode } from "../shared/source_code.js";
import { themeButton } from "../shared/theme.js";
import { later } from "../shared/timing.js";
import { attempt, toast } from "../shared/toast.js";
import { followChip } from "../lecturer/chip.js";
import { ClassControl } from "../lecturer/class_control.js";
import { popover } from "../session/popover.js";
import { viewSwitch } from "../session/scene.js";
import { compare } from "./compare.js";
import { help } from "./help.js";
import { linkTo, savedOf, wantedOf } from "../shared/comparison_link.js";

/** @import { ComparedRun } from "../shared/messages.js" */
/** @import { RunComparison } from "./compare.js" */
/** @import { Arrangement, Wanted } from "../shared/comparison_link.js" */

const SKELETON_AFTER_MS = 200;
const WORK = { label: "Choose saved runs", href: "work?show=runs" };
const EMPTY = "Compare a session with its branches or with other trackers (key C on its page), two saved runs (My work), or two trackers on a row of a sweep.";
const RECORDING = "The link does not contain recordings: on another server, upload the recording first.";
const LONGEST_TITLE = 200;
const root = part("comparison");
/** @type {RunComparison|null} */
let compared = null;
/** @type {string[]} */
let sessions = [];
/** What somebody calls it; empty where its runs say what it is. */
let givenTitle = "";
/**
 * The saved comparison that is shown, and what is kept in it, as text; null where that is not known yet.
 *
 * @type {{id: string, content: string|null}|null}
 */
let saved = null;
/** Nothing ends what listens here but the page itself. */
const { signal } = new AbortController();
const control = new ClassControl(() => {
  if (compared === null || sessions.length === 0) return null;
  return { title: titleOf(compared), sessions, lesson: null, arrangement: { comparison: compared.told } };
}, signal);

navigation(null);
const arrangements = arrangementSwitch();
const views = viewSwitch("flat", (kind) => {
  compared?.show(kind);
  if (kind === "scene") arrangements.mark("side");
});
const share = tool("share", "Share", "Share a link to this comparison", shareDialog);
const away = exportLists((name) => {
  if (compared === null) throw new Error("Wait until the comparison is computed, then write it");
  return api.exportComparison(name, { runs: compared.wanted.runs, title: titleOf(compared).slice(0, LONGEST_TITLE) });
});
const files = tool("files", "Files", "Export this comparison", () => {});
const fileMenu = popover(files, h("section", {}, h("h2", {}, "Take away"), away.element));
const save = tool("save", "Save", "Keep this comparison; My work lists it", saveIt);
const rename = iconButton("rename", "Rename this comparison", renameIt);
rename.hidden = true;
part("title").after(rename);
const keys = h("button", { type: "button", class: "quiet icon-only", title: "Keys (?)", "aria-label": "Keys", on: { click: help } }, "?");
const presenting = presentationButton({ hears: false });
part("tools").append(arrangements.element, views, followChip(control, signal), save, fileMenu, share, themeButton(), printButton(), presenting, keys);
// The sessions are the page's own; whoever comes back by the browser's cache begins anew.
addEventListener("pageshow", (event) => event.persisted && location.reload());
addEventListener("hashchange", () => location.reload());
load();

async function load() {
  try {
    const id = savedOf(location);
    saved = id === null ? null : { id, content: null };
    const wanted = id === null ? wantedOf(location) : await api.savedComparison(id);
    if (wanted === null) fill(root, notice("Nothing to compare yet", EMPTY, WORK));
    else show(wanted);
  } catch (error) {
    fill(root, notice("This link cannot be read", messageOf(error), WORK));
  }
}

/** @param {Wanted} wanted */
async function show(wanted) {
  const wait = h("p", { class: "note compiling", role: "status", hidden: true });
  const there = later(() => fill(root, h("div", { class: "comparison-wait" }, wait, h("div", { class: "shimmer" }))), SKELETON_AFTER_MS);
  const tell = (/** @type {string} */ sentence) => {
    setText(wait, sentence && `${sentence}. The comparison begins by itself.`);
    wait.hidden = sentence === "";
  };
  givenTitle = wanted.title ?? "";
  try {
    const actions = { help, present: () => present() };
    compared = await compare(root, wanted, tell, signal, { actions, onChange: keepAddress, onFewer: showFewer });
    there();
    arrangements.mark(wanted.arrangement ?? "side");
    if (saved) saved.content = contentOf(compared);
    entitle(compared);
    keepAddress(compared);
    away.draw(compared.exports, []);
    share.disabled = files.disabled = rename.hidden = false;
    compared.begun.then((ids) => {
      sessions = ids;
      control.find();
    }, () => {});
  } catch (error) {
    there();
    setText(part("title"), "Compare");
    fill(root, notice("These runs cannot be compared", messageOf(error), WORK));
  }
}

/**
 * The address holds what makes the runs as soon as that is known, so that it can be kept, sent and reloaded.
 *
 * @param {RunComparison} shown
 */
function keepAddress(shown) {
  if (shown !== compared) return;
  history.replaceState(null, "", linkTo({ ...shown.wanted, position: 0, title: givenTitle }));
  save.disabled = saved?.content === contentOf(shown);
  control.update();
}

/**
 * What of a comparison is kept when it is saved, but for the frame that is shown.
 *
 * @param {RunComparison} shown
 */
function contentOf({ wanted: { runs, arrangement } }) {
  return JSON.stringify([runs, arrangement]);
}

/** @param {RunComparison} shown */
function titleOf(shown) {
  return givenTitle || shown.title;
}

/** @param {RunComparison} shown */
function entitle(shown) {
  setText(part("title"), `Compare · ${titleOf(shown)}`);
  document.title = `${titleOf(shown)} · Compare · pftrack`;
}

/** Keep it as it is seen now, as one more. */
async function saveIt() {
  if (compared === null) return;
  const shown = compared;
  const name = await askName("Save this comparison", titleOf(shown).slice(0, LONGEST_TITLE), "Save");
  if (name === null) return;
  const { runs, position = 0, arrangement = "side" } = shown.wanted;
  const recipes = runs.flatMap(({ recipe }) => (recipe ? [{ recipe }] : []));
  await attempt(async () => {
    const kept = await api.saveComparison({ title: name, runs: recipes, position, arrangement });
    saved = { id: kept.id, content: contentOf(shown) };
    givenTitle = name;
    entitle(shown);
    save.disabled = true;
    toast("Saved; My work lists it", { action: { label: "My work", href: "work?show=comparisons" } });
  });
}

/** Give it another name, here and where it is kept. */
async function renameIt() {
  if (compared === null) return;
  const shown = compared;
  const name = await askName("Rename this comparison", titleOf(shown));
  if (name === null) return;
  await attempt(async () => {
    if (saved !== null) await api.renameComparison(saved.id, name);
    givenTitle = name;
    entitle(shown);
    keepAddress(shown);
  });
}

/** @param {ComparedRun[]} runs */
function showFewer(runs) {
  const wanted = { runs, position: compared?.position ?? 0 };
  compared?.end();
  // It is another one now.
  [compared, sessions, saved] = [null, [], null];
  show(wanted);
}

function shareDialog() {
  if (compared === null) return;
  const { wanted } = compared;
  const address = absolute(linkTo({ ...wanted, title: givenTitle }));
  openDialog("Share this comparison", (close) => {
    const field = h("input", { type: "text", readonly: true, value: address, "aria-label": "Link", "data-role": "share-link", autofocus: true });
    field.addEventListener("focus", () => field.select());
    return [
      h(
        "p",
        {},
        `The link holds the settings of all runs, and frame ${wanted.position}. `,
        "Wherever it is opened, the runs have the same numbers and differ from the same frame on.",
      ),
      wanted.runs.some(({ recipe }) => recipe?.footage) && h("p", { class: "hint" }, RECORDING),
      field,
      sourceCode(() => api.sourceCode(wanted.runs)),
      h("footer", {}, h("button", { type: "button", on: { click: close } }, "Close"), copyButton("Copy link", address, "the link")),
    ];
  }, { wide: true });
}

/**
 * @param {import("../shared/icons.js").IconName} name
 * @param {string} text
 * @param {string} hint
 * @param {() => void} run
 */
function tool(name, text, hint, run) {
  const properties = { type: "button", class: "tool", title: hint, disabled: true, data: { tool: name }, on: { click: run } };
  return h("button", properties, icon(name), h("span", { class: "wide-only" }, text));
}

function arrangementSwitch() {
  /** @type {Record<Arrangement, HTMLButtonElement>} */
  const buttons = {
    side: button("side", "Side by side", "Each run has its own picture"),
    over: button("over", "Over each other", "All runs on the picture of the first, each in its colour"),
  };
  const mark = (/** @type {Arrangement} */ chosen) => {
    for (const [name, each] of Object.entries(buttons)) each.setAttribute("aria-pressed", String(name === chosen));
  };
  /**
   * @param {Arrangement} name
   * @param {string} text
   * @param {string} title
   */
  function button(name, text, title) {
    const press = () => {
      compared?.arrange(name);
      mark(name);
      if (name === "over") views.querySelector("[data-view=flat]")?.dispatchEvent(new MouseEvent("click"));
    };
    return h("button", { type: "button", title, "aria-pressed": String(name === "side"), data: { arrangement: name }, on: { click: press } }, text);
  }
  return { element: h("div", { class: "view-switch", role: "group", "aria-label": "Arrangement" }, buttons.side, buttons.over), mark };
}
