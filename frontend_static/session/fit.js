/**
 * Fitting: numbers of the tracker are fitted to the first half of what the run has seen, and judged by the second. The session
 * goes on meanwhile; what is found opens as a branch beside it.
 */

import { api, messageOf } from "../shared/api.js";
import { openDialog } from "../shared/dialog.js";
import { fill, h } from "../shared/dom.js";
import { number, parameterValue } from "../shared/format.js";
import { cancelJob, followJob, onMeter } from "../shared/jobs.js";
import { explain } from "../shared/terms.js";
import { attempt } from "../shared/toast.js";
import { Commands } from "./commands.js";

/** @import { Declaration, Fit, Half, SessionPublic } from "../shared/messages.js" */

const MOST = 4;

/**
 * The numbers that can be fitted now.
 *
 * @param {SessionPublic} session
 */
export function fittable({ declarations, fittable: offered, tracker }) {
  const names = offered[tracker] ?? [];
  return names.flatMap((name) => declarations.filter((each) => each.name === name));
}

/**
 * Ask which numbers to fit, and show what comes of it.
 *
 * @param {import("./store.js").Store} store
 */
export function fitDialog(store) {
  const session = store.known;
  const commands = new Commands(store);
  const offered = fittable(session);
  const wanted = new AbortController();
  /** @type {string|null} The fit under way. */
  let working = null;
  const stop = () => {
    wanted.abort();
    if (working !== null) cancelJob(working);
  };
  const element = openDialog(
    "Fit to what was seen",
    (close) => {
      const place = h("div", { class: "fit", "aria-live": "polite" });
      const ask = (/** @type {string} */ problem) =>
        fill(
          place,
          question(session, offered, problem, close, async (numbers) => {
            const meter = h("progress", { max: 1, "aria-label": "How far the fit is" });
            const cancel = h("button", { type: "button", autofocus: true, on: { click: close } }, "Cancel");
            fill(place, h("p", {}, "Running the tracker on the same frames with other values. The session goes on meanwhile."), meter, h("footer", {}, cancel));
            cancel.focus();
            try {
              const begun = await api.fit(session.id, numbers);
              working = begun.id;
              const job = await followJob(begun, onMeter(meter), wanted.signal);
              working = null;
              if (job === null) return;
              if (job.result === null) ask(job.error ?? "The fit has failed.");
              else fill(place, result(job.result, session, commands, close));
            } catch (error) {
              ask(messageOf(error));
            }
          }),
        );
      ask("");
      return [place];
    },
    { wide: true },
  );
  element.addEventListener("close", stop);
}

/**
 * @param {SessionPublic} session
 * @param {Declaration[]} offered
 * @param {string} problem What went wrong before; "" if nothing did.
 * @param {() => void} close
 * @param {(numbers: string[]) => void} begin
 */
function question(session, offered, problem, close, begin) {
  const boxes = offered.map((each, place) => h("input", { type: "checkbox", value: each.name, checked: place < MOST }));
  const chosen = () => boxes.filter((box) => box.checked).map((box) => box.value);
  const go = h("button", { type: "submit", class: "primary" }, "Fit");
  const check = () => {
    const count = chosen().length;
    go.disabled = count === 0;
    for (const box of boxes) box.disabled = !box.checked && count >= MOST;
  };
  check();
  const submit = (/** @type {Event} */ event) => {
    event.preventDefault();
    begin(chosen());
  };
  const rows = offered.map((each, place) => {
    const now = h("span", { class: "hint" }, valueOf(session.parameters[each.name], each));
    return h("label", { class: "fit-choice", title: each.description }, boxes[place], h("span", { class: "grow" }, each.title), now);
  });
  const words = `Looks for the values under which frames 1 to ${session.computed} are most probable.`;
  return h(
    "form",
    { method: "dialog", on: { submit, change: check } },
    h("p", {}, words, " They are found on the first half, and kept only if the second half agrees."),
    problem && h("p", { class: "hint", role: "alert" }, problem),
    h("div", { class: "fit-choices", role: "group", "aria-label": `Numbers to fit, ${MOST} at most` }, rows),
    h("footer", {}, h("button", { type: "button", on: { click: close } }, "Cancel"), go),
  );
}

/**
 * What was found, before and after, and a branch to see it in.
 *
 * @param {Fit} found
 * @param {SessionPublic} session
 * @param {Commands} commands
 * @param {() => void} close
 */
function result(found, session, commands, close) {
  const open = h("button", { type: "button", class: "primary", autofocus: true }, "Open as a branch");
  open.addEventListener("click", async () => {
    open.disabled = true;
    const made = await commands.branch({ frame: 0, values: { ...found.values, tracker: found.tracker }, title: "Fitted values" });
    open.disabled = false;
    if (!made) return;
    close();
    await attempt(() => api.command(session.id, { kind: "seek", frame: session.position }));
  });
  const numbers = found.numbers.map((each) => {
    const note = each.at_bound && " (at its bound: the best may lie beyond)";
    return h("tr", {}, h("th", { scope: "row" }, each.title), h("td", {}, valueOf(each.before, each)), h("td", {}, valueOf(each.after, each), note));
  });
  const heads = ["", "Before", "After"].map((title) => h("th", { scope: "col" }, title));
  const words = `${found.procedure} Log evidence is how probable the filter had called what came next, in nats a frame: more is better.`;
  const again = session.computed + 1 < session.frames && "More frames may tell more: let the run go on, and fit again.";
  const about = h("p", { class: "hint" }, words, " ", !found.kept && again);
  explain(about, { experiment: session.recipe.experiment });
  return [
    h("p", { class: "fit-verdict", role: "status" }, found.verdict),
    found.caution && h("p", { class: "hint" }, found.caution),
    h("div", { class: "fit-table" }, h("table", {}, h("thead", {}, h("tr", {}, heads)), h("tbody", {}, numbers, found.halves.map(halfRows)))),
    about,
    h("footer", {}, h("button", { type: "button", on: { click: close } }, found.kept ? "Leave it as it is" : "Close"), found.kept && open),
  ];
}

/**
 * @param {Half} half
 * @param {number} place
 */
function halfRows({ first, last, before, after }, place) {
  const title = `Frames ${first} to ${last}, ${place === 0 ? "used" : "not used"}`;
  const head = h("th", { scope: "rowgroup" }, title);
  head.colSpan = 3;
  const row = (/** @type {string} */ name, /** @type {string[]} */ values) =>
    h("tr", {}, h("th", { scope: "row" }, name), values.map((value) => h("td", {}, value)));
  const shares = ["50", "95"].filter((promised) => promised in before.coverage);
  /** @type {["NEES" | "NIS", "nees" | "nis", string][]} */
  const squares = [
    ["NEES", "nees", "1 is right"],
    ["NIS", "nis", `${(before.nis_limits ?? []).map((end) => number(end, 2)).join(" to ")} is right`],
  ];
  return [
    h("tr", { class: "fit-half" }, head),
    row("Log evidence", [before, after].map((score) => number(score.log_evidence, 3).replace("-", "−"))),
    shares.map((promised) => row(`Truth in the ${promised} % band`, [before, after].map(({ coverage }) => `${number(100 * coverage[promised], 0)} %`))),
    squares
      .filter(([, name]) => before[name] !== null)
      .map(([measure, name, right]) => row(`${measure} (${right})`, [before, after].map((score) => number(Number(score[name]), 2)))),
  ];
}

/**
 * @param {unknown} value
 * @param {{unit: string}} declaration
 */
function valueOf(value, declaration) {
  return parameterValue(Number(value), { unit: declaration.unit, kind: "number" });
}
