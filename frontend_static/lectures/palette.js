/** What a lecture can be made of: lists of each kind, a form for a poll, and a field for a link. */

import { lessons } from "../learn/api.js";
import { pollForm } from "../lecturer/poll_form.js";
import { minutesText } from "../lecturer/walk.js";
import { bodyOf } from "../session/share.js";
import { sessionTitle } from "../session/timeline.js";
import { api, messageOf } from "../shared/api.js";
import { fill, h, setText } from "../shared/dom.js";
import { count, moment } from "../shared/format.js";
import { presetRecipe } from "../shared/share_link.js";
import { attempt } from "../shared/toast.js";
import { itemOfLink } from "../lecturer/item_of_link.js";

/** @import { LectureItemPublic, RunPublic, SessionPublic } from "../shared/messages.js" */
/** @import { Child } from "../shared/elements.js" */

/** @typedef {{item: Record<string, unknown>, kind: LectureItemPublic["kind"], title: string, minutes: number}} New */
/** @typedef {(added: New) => void} Add */
/** @typedef {"lessons"|"failures"|"sessions"|"comparisons"|"polls"} Place */

/** @type {readonly {id: Place, title: string, show: (add: Add) => Promise<Child[]>}[]} */
const PLACES = [
  { id: "lessons", title: "Lessons", show: lessonRows },
  { id: "failures", title: "Failures", show: failureRows },
  { id: "sessions", title: "Sessions", show: sessionRows },
  { id: "comparisons", title: "Comparisons", show: comparisonRows },
  { id: "polls", title: "Polls", show: async (add) => [poll(add)] },
];
const MOST_COMPARED = 4;
const MOST_LISTED = 50;
const RUN_MINUTES = 5;
const POLL_MINUTES = 2;

/** @param {Add} add */
export function palette(add) {
  const place = h("div", { class: "palette-place" });
  let shown = "";
  const buttons = PLACES.map(({ id, title }) =>
    h("button", { type: "button", "aria-pressed": "false", data: { place: id }, on: { click: () => show(id) } }, title));
  show("lessons");
  return h(
    "section",
    { class: "palette", "aria-label": "Add to the lecture" },
    h("h2", {}, "Add"),
    h("div", { class: "kinds", role: "group", "aria-label": "Kind" }, buttons),
    place,
    linkField(add),
  );

  /** @param {Place} id */
  async function show(id) {
    shown = id;
    for (const each of buttons) each.setAttribute("aria-pressed", String(each.dataset.place === id));
    const kind = PLACES.find((each) => each.id === id);
    try {
      const found = (await kind?.show(add)) ?? [];
      if (shown === id) fill(place, found);
    } catch (error) {
      fill(place, h("p", { class: "wrong" }, messageOf(error)));
    }
  }
}

/** @param {Add} add */
async function lessonRows(add) {
  const { lessons: all } = await lessons.all();
  return [rows(all.filter(({ problem }) => problem === null).map(({ id, number, title, minutes }) => {
    const name = number > 0 ? `${number} · ${title}` : title;
    const question = () => add({ item: { question: id }, kind: "question", title: `Question: ${title}`, minutes: POLL_MINUTES });
    return row(name, minutesText(minutes), [
      button("Its question", `Add the question of ${title} as a poll`, question),
      adding(title, () => add({ item: { lesson: id }, kind: "lesson", title, minutes })),
    ]);
  }))];
}

/** @param {Add} add */
async function failureRows(add) {
  const all = await api.failures();
  return [rows(all.map(({ id, number, title, kind_title: hint }) =>
    row(`${number} · ${title}`, hint, [adding(title, () => add({ item: { failure: id }, kind: "failure", title, minutes: RUN_MINUTES }))])))];
}

/** @param {Add} add */
async function sessionRows(add) {
  const [{ sessions, runs }, experiments] = await Promise.all([mine(), api.experiments()]);
  const one = (/** @type {string} */ title, /** @type {unknown} */ session) => add({ item: { session, title }, kind: "session", title, minutes: RUN_MINUTES });
  return [
    h("h3", {}, "Running sessions and saved runs"),
    sessions.length + runs.length === 0 && h("p", { class: "hint" }, "There are none. Presets are below; a session's link can be pasted."),
    rows([
      ...sessions.map((session) => row(session.name, `running, frame ${session.position}`, [adding(session.name, () => one(session.name, bodyOf(session)))])),
      ...runs.map(({ id, title, created }) => row(title, `saved ${moment(created)}`, [adding(title, () => one(title, { reference: id }))])),
    ]),
    ...experiments.flatMap((experiment) => [
      h("h3", {}, experiment.title),
      rows(experiment.presets.map((preset) => {
        const title = `${experiment.title}: ${preset.title}`;
        return row(preset.title, preset.watch, [adding(title, () => one(title, { recipe: presetRecipe(experiment, preset) }))]);
      })),
    ]),
  ];
}

/** @param {Add} add */
async function comparisonRows(add) {
  const { sessions, runs } = await mine();
  /** @type {Map<string, unknown>} */
  const chosen = new Map();
  const go = h("button", { type: "button", class: "primary", disabled: true, on: { click: () => compare() } }, "Add");
  const boxes = [...sessions.map(ofSession), ...runs.map(ofRun)].map(({ title, hint, run }) => {
    /** @type {HTMLInputElement} */
    const box = h("input", { type: "checkbox", on: { change: () => choose(title, run, box.checked) } });
    return h("li", {}, h("label", { class: "row" }, box, words(title, hint)));
  });
  if (boxes.length < 2) return [h("p", { class: "hint" }, "Two sessions or saved runs make a comparison. There are fewer; the link of one can be pasted.")];
  return [h("h3", {}, "Choose two to four"), rows(boxes), h("div", { class: "poll-line" }, go)];

  /**
   * @param {string} title
   * @param {unknown} run
   * @param {boolean} isChosen
   */
  function choose(title, run, isChosen) {
    if (isChosen) chosen.set(title, run);
    else chosen.delete(title);
    go.disabled = chosen.size < 2 || chosen.size > MOST_COMPARED;
    setText(go, chosen.size < 2 ? "Add" : `Add a comparison of ${count(chosen.size, "run")}`);
  }

  function compare() {
    const title = [...chosen.keys()].join(" · ");
    add({ item: { comparison: { runs: [...chosen.values()] }, title }, kind: "comparison", title, minutes: RUN_MINUTES });
  }
}

/** @param {SessionPublic} session */
function ofSession(session) {
  const { recipe, upload } = session;
  return { title: sessionTitle(session), hint: `running, seed ${recipe.seed}`, run: { recipe, ...(upload && { upload }) } };
}

/** @param {RunPublic} run */
function ofRun({ id, title, created }) {
  return { title, hint: `saved ${moment(created)}`, run: { reference: id } };
}

/** @param {Add} add */
function poll(add) {
  const form = pollForm(async ({ question, answers }) => {
    add({ item: { poll: question, answers }, kind: "poll", title: question ?? "", minutes: POLL_MINUTES });
    form.replaceWith(poll(add));
  }, "Add the poll");
  return form;
}

/** @param {Add} add */
function linkField(add) {
  const field = h("input", { type: "text", id: "palette-link", autocomplete: "off", placeholder: "Link of a session, a comparison, a lesson or a failure" });
  const take = async (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    const added = await attempt(() => linked(field.value));
    if (added === undefined) return;
    field.value = "";
    add(added);
  };
  return h(
    "form",
    { class: "palette-link", on: { submit: take } },
    h("label", { for: "palette-link" }, "Or paste a link"),
    h("div", { class: "menu-form" }, field, h("button", { type: "submit" }, "Add")),
  );
}

/**
 * @param {string} text
 * @returns {Promise<New>}
 */
async function linked(text) {
  const found = itemOfLink(text, document.baseURI);
  if ("session" in found) {
    const session = await api.session(found.session);
    return { item: { session: bodyOf(session), title: session.name }, kind: "session", title: session.name, minutes: RUN_MINUTES };
  }
  const [kind] = /** @type {LectureItemPublic["kind"][]} */ (Object.keys(found.item));
  // The server finds out what it is called.
  return { item: found.item, kind, title: kind, minutes: RUN_MINUTES };
}

function mine() {
  return api.work({ limit: MOST_LISTED }, new AbortController().signal);
}

/** @param {Child[]} lines */
function rows(lines) {
  return lines.length > 0 && h("ul", { class: "rows" }, lines);
}

/**
 * @param {string} title
 * @param {string} hint
 * @param {Child[]} actions
 */
function row(title, hint, actions) {
  return h("li", { class: "row" }, words(title, hint), h("span", { class: "row-actions" }, actions));
}

/**
 * @param {string} title
 * @param {string} hint
 */
function words(title, hint) {
  return h("span", { class: "row-words" }, h("span", { class: "row-title" }, title), h("span", { class: "hint" }, hint));
}

/**
 * @param {string} title
 * @param {() => void} run
 */
function adding(title, run) {
  return button("Add", `Add ${title}`, run);
}

/**
 * @param {string} text
 * @param {string} label
 * @param {() => void} run
 */
function button(text, label, run) {
  return h("button", { type: "button", "aria-label": label, on: { click: run } }, text);
}
