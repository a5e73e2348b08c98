/** The running sessions, the saved runs, and what is wrong with experiments of other packages. */

import { api } from "../shared/api.js";
import { thumbnail } from "./cards.js";
import { confirmLoss } from "../shared/dialog.js";
import { fill, h } from "../shared/dom.js";
import { moment } from "../shared/format.js";
import { iconButton } from "../shared/icons.js";
import { trackerTitle } from "../session/timeline.js";
import { attempt } from "../shared/toast.js";

/** @import { Question } from "../shared/dialog.js" */
/** @import { RunPublic, SessionPublic } from "../shared/messages.js" */

/** @type {Record<SessionPublic["state"], string>} */
const STATES = { starting: "starting", ready: "paused", playing: "playing", ended: "at the end", suspended: "sleeping", crashed: "stopped, can be restarted" };

/** @param {import("../shared/messages.js").SessionPublic} session */
const doing = (session) => (session.goal === null ? STATES[session.state] : "computing");

/**
 * List the sessions; nothing at all when there is none.
 *
 * @param {HTMLElement} root
 * @returns {Promise<void>}
 */
export async function sessionList(root) {
  const sessions = await api.sessions();
  const again = () => attempt(() => sessionList(root));
  root.hidden = sessions.length === 0;
  fill(
    root,
    h("h2", {}, "Running sessions"),
    h(
      "ul",
      { class: "rows" },
      sessions.map((session) =>
        h(
          "li",
          { class: "row", data: { session: session.id } },
          h("a", { class: "row-title", href: session.page }, `${session.title} · ${trackerTitle(session, session.tracker)}`),
          h("span", { class: "hint" }, `seed ${session.recipe.seed}, frame ${session.position} / ${session.frames}, ${doing(session)}`),
          h(
            "div",
            { class: "row-actions" },
            h("a", { class: "button", href: session.page }, "Open"),
            removal(`End ${session.title}`, {
              title: "End this session?",
              text: "What was not saved of it is lost for good.",
              action: "End it",
            }, () => api.end(session.id).then(again)),
          ),
        ),
      ),
    ),
  );
}

/**
 * Say of each experiment of another package that cannot be used why; nothing at all when all can.
 *
 * @param {HTMLElement} root
 */
export async function pluginProblems(root) {
  const problems = (await api.plugins()).map((plugin) => plugin.problem).filter(Boolean);
  root.hidden = problems.length === 0;
  fill(root, h("ul", { class: "problems" }, problems.map((problem) => h("li", {}, problem))));
}

/**
 * List the saved runs, newest first.
 *
 * @param {HTMLElement} root
 * @returns {Promise<void>}
 */
export async function runList(root) {
  const runs = await api.runs();
  const again = () => attempt(() => runList(root));
  fill(
    root,
    h("h2", {}, "Saved runs"),
    runs.length === 0
      ? h("p", { class: "empty" }, "No runs are saved yet. Save one on a session's page, and it is listed here.")
      : h("ul", { class: "rows" }, runs.map((run) => row(run, again))),
  );
}

/**
 * @param {RunPublic} run
 * @param {() => Promise<void>} again
 */
function row(run, again) {
  const open = async () => {
    const session = await attempt(() => api.open(run.id));
    if (session) location.assign(session.page);
  };
  return h(
    "li",
    { class: "row", data: { run: run.id } },
    h("div", { class: "row-thumb" }, thumbnail(run.thumbnail)),
    h(
      "div",
      { class: "row-words" },
      h("span", { class: "row-title" }, run.title),
      h("span", { class: "hint" }, [run.outcome, reproduced(run.summary), `seed ${run.seed}`, moment(run.created)].filter(Boolean).join(", ")),
    ),
    h(
      "div",
      { class: "row-actions" },
      h("button", { type: "button", on: { click: open } }, "Open"),
      h("a", { class: "button", href: api.downloadAddress(run.id), download: "" }, "Download"),
      removal(`Delete ${run.title}`, {
        title: "Delete this run?",
        text: `${run.title} is lost for good, unless you downloaded it.`,
        action: "Delete it",
      }, () => api.remove(run.id).then(again)),
    ),
  );
}

/**
 * Whether a run that was brought in came to the numbers here that it had where it was saved.
 *
 * @param {RunPublic["summary"]} summary
 */
function reproduced(summary) {
  if (typeof summary.reproduced !== "boolean") return "";
  const differs = /** @type {{first_frame?: number}|undefined} */ (summary.differs);
  const from = typeof differs?.first_frame === "number" ? `, from frame ${differs.first_frame} on` : "";
  return summary.reproduced ? "same numbers as in its file" : `other numbers than in its file${from}`;
}

/**
 * @param {string} label
 * @param {Question} question
 * @param {() => Promise<unknown>} remove
 */
function removal(label, question, remove) {
  const press = async () => {
    if (await confirmLoss(question)) await attempt(remove);
  };
  return iconButton("trash", label, press);
}
