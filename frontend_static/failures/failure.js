/** A failure beside its cure: two runs of one seed in step, why the one fails, and what helps the other. */

import { api, messageOf, statusOf } from "../shared/api.js";
import { whenCompiled } from "../shared/compiling.js";
import { fill, h, lastOfAddress, part, setText } from "../shared/dom.js";
import { icon } from "../shared/icons.js";
import { navigation } from "../shared/navigation.js";
import { notice } from "../shared/notice.js";
import { presentationButton } from "../shared/presentation.js";
import { printButton } from "../shared/print.js";
import { sourceCodeButton } from "../shared/source_code.js";
import { themeButton } from "../shared/theme.js";
import { later } from "../shared/timing.js";
import { followChip } from "../lecturer/chip.js";
import { ClassControl } from "../lecturer/class_control.js";
import { linkTo } from "../shared/comparison_link.js";
import { column } from "./column.js";
import { pair, told } from "./pair.js";

/** @import { FailurePublic } from "../shared/messages.js" */
/** @import { JointView } from "../compare/joint_view.js" */
/** @import { Column } from "./column.js" */

const SKELETON_AFTER_MS = 200;
const NOT_FOUND = 404;
const GALLERY = { label: "All failures", href: "failures" };
const name = lastOfAddress();
const root = part("failure");
/** @type {{failure: FailurePublic, columns: Column[], sessions: string[]}|null} What a class may see. */
let shown = null;
/** Nothing ends what listens here but the page itself. */
const page = new AbortController();
const control = new ClassControl(() => {
  if (shown === null) return null;
  const { failure, columns, sessions } = shown;
  return { title: failure.title, sessions, lesson: null, arrangement: { comparison: told(columns, failure) } };
}, page.signal);

navigation("failures");
part("tools").append(followChip(control, page.signal), themeButton(), printButton(), presentationButton());
// The next failure is the next page of the lecture.
part("neighbours").addEventListener("click", () => control.takeAlong());
// The sessions are the page's own; whoever comes back by the browser's cache begins anew.
addEventListener("pageshow", (event) => event.persisted && location.reload());
load();

async function load() {
  const there = later(() => fill(root, h("div", { class: "failure-wait" }, h("div", { class: "shimmer" }))), SKELETON_AFTER_MS);
  try {
    const failure = await api.failure(name);
    there();
    setText(part("title"), `${failure.number}  ${failure.title}`);
    document.title = `${failure.title} · pftrack`;
    history.replaceState(null, "", failure.page + location.search);
    fill(part("neighbours"), neighbour(failure.previous, "previous"), neighbour(failure.next, "next"));
    begin(failure);
  } catch (error) {
    there();
    const isUnknown = statusOf(error) === NOT_FOUND;
    setText(part("title"), "Failure");
    const title = isUnknown ? "There is no such failure" : "The failure cannot be shown";
    fill(root, notice(title, messageOf(error), isUnknown ? GALLERY : { label: "Try again", run: load }));
  }
}

/**
 * @param {FailurePublic["next"]} failure
 * @param {"previous"|"next"} way
 */
function neighbour(failure, way) {
  if (failure === null) return null;
  const words = `${way === "next" ? "Next" : "Previous"} failure, ${failure.title}`;
  const href = `failures/${encodeURIComponent(failure.id)}`;
  return h("a", { class: "button quiet icon-only", rel: way === "next" ? "next" : "prev", href, title: words, "aria-label": words }, icon(way));
}

/** @param {FailurePublic} failure */
function begin(failure) {
  const columns = [column(failure, "failing"), column(failure, "cured")];
  const deck = h("div", { class: "failure-deck" });
  fill(root, columns.map(({ element }) => element), deck);
  const runs = pair(columns, deck, failure);
  measure(failure, columns, runs.signal);
  const both = [{ recipe: failure.failing }, { recipe: failure.cured }];
  fill(part("compare"), comparisonLink(failure, runs), sourceCodeButton(() => api.sourceCode(both)));
  runs.begun.then((sessions) => {
    shown = { failure, columns, sessions };
    return control.find();
  }, (error) => {
    if (runs.signal.aborted) return;
    runs.end();
    fill(root, notice("The two runs could not be started", messageOf(error), { label: "Try again", run: () => begin(failure) }));
  });
}

/**
 * A link to both runs as a comparison, at the frame that is shown.
 *
 * @param {FailurePublic} failure
 * @param {JointView} runs
 */
function comparisonLink({ failing, cured, frame }, runs) {
  const to = (/** @type {number} */ position) => linkTo({ runs: [{ recipe: failing }, { recipe: cured }], position });
  const go = () => (link.href = to(runs.store.session?.position ?? frame));
  const link = h(
    "a",
    {
      class: "button tool",
      href: to(frame),
      title: "Compare both runs: what differs, all plots, and what came of them",
      "aria-label": "Compare both runs",
      on: { pointerenter: go, focus: go, click: go },
    },
    icon("compare"),
    h("span", { class: "wide-only" }, "Compare"),
  );
  return link;
}

/**
 * Say of both runs what is measured in them as wholes.
 *
 * @param {FailurePublic} failure
 * @param {Column[]} columns
 * @param {AbortSignal} signal
 */
async function measure(failure, columns, signal) {
  const tell = (/** @type {string} */ sentence) => columns.forEach((each) => each.tell(sentence));
  try {
    const course = await whenCompiled(failure.experiment, () => api.course(failure.id, signal), tell, signal);
    columns.forEach((each) => each.show(course));
  } catch (error) {
    if (!signal.aborted) tell(`The measurement is not available: ${messageOf(error)}`);
  }
}
