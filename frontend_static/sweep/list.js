/** The recent sweeps, with what came of them, and the way to a new one. */

import { confirmLoss } from "../shared/dialog.js";
import { fill, h } from "../shared/dom.js";
import { moment } from "../shared/format.js";
import { iconButton } from "../shared/icons.js";
import { sweeps } from "./api.js";
import { attempt } from "../shared/toast.js";

/** @import { SweepPublic } from "../shared/messages.js" */

const SHOWN = 8;
const EMPTY =
  "A sweep runs an experiment over a grid of conditions and draws a map of where each method succeeds. None has been started yet.";
const STATES = { running: "running", stopped: "stopped, can be resumed", done: "complete" };

/**
 * List the newest sweeps.
 *
 * @param {HTMLElement} root
 * @param {number} [most]
 * @returns {Promise<void>}
 */
export async function sweepList(root, most = SHOWN) {
  const found = await sweeps.list();
  const again = () => attempt(() => sweepList(root, most));
  const all = () => attempt(() => sweepList(root, found.length));
  fill(
    root,
    h("header", { class: "section-head" }, h("h2", {}, "Sweeps"), h("a", { class: "button", href: "/sweep/new" }, "New sweep")),
    found.length === 0
      ? h("p", { class: "empty" }, EMPTY)
      : h("ul", { class: "rows" }, found.slice(0, most).map((sweep) => row(sweep, again))),
    found.length > most && h("button", { type: "button", class: "quiet", on: { click: all } }, `Show all ${found.length}`),
  );
}

/**
 * @param {SweepPublic} sweep
 * @param {() => Promise<void>} again
 */
function row(sweep, again) {
  const methods = sweep.trackers.map(({ title }) => /\(([^)]+)\)$/.exec(title)?.[1] ?? title).join(", ");
  return h(
    "li",
    { class: "row", data: { sweep: sweep.id } },
    h(
      "div",
      { class: "row-words" },
      h("a", { class: "row-title", href: sweep.page }, sweep.title),
      h("span", { class: "hint" }, [methods, sweep.outcome, STATES[sweep.state], moment(sweep.created)].join(" · ")),
    ),
    h(
      "div",
      { class: "row-actions" },
      sweep.state === "running" && h("progress", { class: "row-meter", max: 1, value: sweep.done / sweep.runs, "aria-label": `${sweep.title}, runs done` }),
      h("a", { class: "button", href: sweep.page }, "Open"),
      iconButton("trash", `Delete ${sweep.title}`, () => remove(sweep, again)),
    ),
  );
}

/**
 * @param {SweepPublic} sweep
 * @param {() => Promise<void>} again
 */
async function remove(sweep, again) {
  const text = `${sweep.title} and everything computed of it are lost for good, unless you downloaded them.`;
  if (await confirmLoss({ title: "Delete this sweep?", text, action: "Delete it" })) await attempt(() => sweeps.remove(sweep.id).then(again));
}
