/** From a session to a comparison: with its branches, with the same run by other trackers, or with other sessions. */

import { api } from "./api.js";
import { openDialog } from "./dialog.js";
import { h } from "./dom.js";
import { linkToReferences } from "./comparison_link.js";

/** @import { BranchPublic, SessionPublic } from "./messages.js" */

const MOST_OTHERS = 3;
const MOST_SESSIONS = 8;
const SAVED = "Saved runs are compared in My work, trackers over many conditions in a sweep.";

/** @typedef {{reference: string, title: string, hint: string, colour: string, isChosen: boolean}} Other What this run can be compared with. */

/**
 * Ask with what to compare the run that is shown.
 *
 * @param {SessionPublic} session
 */
export async function compareDialog(session) {
  const sessions = await api.sessions().catch(() => []);
  const within = [...branchesOf(session), ...methodsOf(session)];
  const others = [...within, ...sessionsBeside(session, sessions, within.length === 0)];
  openDialog("Compare this run", (close) => {
    const go = h("button", { type: "submit", class: "primary", autofocus: true }, "Compare");
    const boxes = others.map(({ reference, isChosen }) => h("input", { type: "checkbox", value: reference, checked: isChosen, on: { change: () => look() } }));
    const chosen = () => boxes.filter((box) => box.checked);
    const look = () => {
      go.disabled = chosen().length === 0;
      for (const box of boxes) box.disabled = !box.checked && chosen().length >= MOST_OTHERS;
    };
    look();
    return [
      h(
        "form",
        {
          method: "dialog",
          on: {
            submit: (event) => {
              event.preventDefault();
              const own = `${session.id}:${session.branch}`;
              location.assign(linkToReferences([own, ...chosen().map(({ value }) => value)], session.position));
              close();
            },
          },
        },
        h("p", {}, "It is shown with up to three others, on the same frames, in step. This session continues unchanged."),
        others.length === 0 && h("p", { class: "note" }, "There is nothing yet to compare it with: no branch, no other tracker or session of this kind."),
        h("ul", { class: "compare-choices" }, others.map((other, place) => h("li", {}, choice(other, boxes[place])))),
        h("p", { class: "hint" }, SAVED),
        h("footer", {}, h("button", { type: "button", on: { click: close } }, "Cancel"), go),
      ),
    ];
  }, { wide: true });
}

/**
 * @param {Other} other
 * @param {HTMLInputElement} box
 */
function choice({ title, hint, colour }, box) {
  const swatch = h("span", { class: "swatch" });
  swatch.style.background = colour;
  return h("label", {}, box, colour !== "" && swatch, h("span", {}, title), h("span", { class: "hint" }, hint));
}

/**
 * The other branches; the one that this one left comes first, and is chosen.
 *
 * @param {SessionPublic} session
 * @returns {Other[]}
 */
function branchesOf({ id, branch: active, branches }) {
  const own = branches.find((branch) => branch.id === active);
  const isNear = (/** @type {BranchPublic} */ branch) => branch.id === own?.parent || branch.parent === active;
  const others = branches.filter((branch) => branch !== own).sort((a, b) => Number(isNear(b)) - Number(isNear(a)));
  return others.map((branch, place) => ({
    reference: `${id}:${branch.id}`,
    title: branch.title,
    hint: branch.parent === null ? "the run as it began" : `branched from frame ${branch.frame}`,
    colour: branch.colour,
    isChosen: place === 0,
  }));
}

/**
 * Other sessions of the same experiment, those on a recording as well where this one is; the newest first.
 *
 * @param {SessionPublic} session
 * @param {SessionPublic[]} all The newest first.
 * @param {boolean} alone Whether there is nothing else to compare with, so that the newest is chosen.
 * @returns {Other[]}
 */
export function sessionsBeside(session, all, alone) {
  const isLike = (/** @type {SessionPublic} */ { id, recipe }) =>
    id !== session.id && recipe.experiment === session.recipe.experiment && Boolean(recipe.footage) === Boolean(session.recipe.footage);
  return all.filter(isLike).slice(0, MOST_SESSIONS).map(({ id, branch, name, title, recipe }, place) => ({
    reference: `${id}:${branch}`,
    title: name || title,
    hint: `another session, seed ${recipe.seed}`,
    colour: "",
    isChosen: alone && place === 0,
  }));
}

/**
 * The same run by other methods from frame 0 on, with the same random numbers.
 *
 * @param {SessionPublic} session
 * @returns {Other[]}
 */
function methodsOf({ id, branch, branches, recipe, trackers }) {
  const others = trackers.filter((tracker) => tracker.id !== recipe.tracker);
  return others.map((tracker, place) => ({
    reference: `${id}:${branch}:${tracker.id}`,
    title: tracker.title,
    hint: "same seed, from frame 0 on",
    colour: "",
    isChosen: branches.length === 1 && place === 0,
  }));
}
