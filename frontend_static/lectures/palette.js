/** The palette of a lecture's items: a list of each kind, a form for a poll, and a field for a link. */

import { itemOfAddress, itemOfSession } from "../lecturer/items.js";
import { PollForm } from "../lecturer/poll.js";
import { minutesText } from "../lecturer/walk.js";
import { sessionTitle } from "../session/steering.js";
import { request } from "../shared/api.js";
import { attempt } from "../shared/dom.js";
import { count, moment } from "../shared/format.js";
import { Loaded } from "../shared/page.js";
import { presetRecipe } from "../shared/share_link.js";
import { h, html, useSignal } from "../vendor/preact.js";

/** @import { Item } from "../lecturer/items.js" */
/** @import { Child } from "../vendor/preact.js" */

/** @typedef {(item: Item, title?: string, minutes?: number) => void} Add `title` is for an item without its own; the server's title
 * replaces it. */

const MOST_LISTED = 50;
const POLL_MINUTES = 2;
/** @type {readonly {id: string, title: string, list: (add: Add) => Promise<Child>}[]} */
const PLACES = [
  { id: "lessons", title: "Lessons", list: listLessons },
  { id: "failures", title: "Failures", list: listFailures },
  { id: "sessions", title: "Sessions", list: listSessions },
  { id: "comparisons", title: "Comparisons", list: listComparisons },
  { id: "polls", title: "Polls", list: listPollForm },
];

/** @param {{add: Add}} props */
export function Palette({ add }) {
  const shown = useSignal(PLACES[0]);
  const { id, title, list } = shown.value;
  const kind = (/** @type {typeof PLACES[number]} */ place) => html`<button
    type="button" aria-pressed=${String(place.id === id)} data-place=${place.id} onClick=${() => (shown.value = place)}
  >
    ${place.title}
  </button>`;
  return html`<section class="palette" aria-label="Add to the lecture">
    <h2>Add</h2>
    <div class="kinds" role="group" aria-label="Kind">${PLACES.map(kind)}</div>
    <div key=${id} class="palette-place">${h(Loaded, { load: () => list(add), failed: `Couldn't load ${title.toLowerCase()}` })}</div>
    ${h(LinkField, { add })}
  </section>`;
}

/** @param {Add} add */
async function listLessons(add) {
  const { lessons: all } = await request("GET lessons");
  return rows(all.filter(({ problem }) => problem === null).map(({ id, number, title, minutes }) => {
    const ask = () => add({ question: id }, `Question: ${title}`, POLL_MINUTES);
    const question = html`<button type="button" aria-label=${`Add the question of ${title} as a poll`} onClick=${ask}>Its question</button>`;
    return row(number > 0 ? `${number} · ${title}` : title, minutesText(minutes), () => add({ lesson: id }, title, minutes), { name: title, more: question });
  }));
}

/** @param {Add} add */
async function listFailures(add) {
  const all = await request("GET failures");
  return rows(all.map(({ id, number, title, kind_title: hint }) =>
    row(`${number} · ${title}`, hint, () => add({ failure: id }, title), { name: title })));
}

/** @param {Add} add */
async function listSessions(add) {
  const [{ sessions, runs }, experiments] = await Promise.all([request("GET work", { limit: MOST_LISTED }), request("GET experiments")]);
  const own = [
    ...sessions.map((session) => row(sessionTitle(session), `running, frame ${session.position}`, () => add(itemOfSession(session)))),
    ...runs.map(({ id, title, created }) => row(title, `saved ${moment(created)}`, () => add({ session: { reference: id }, title }))),
  ];
  const presets = experiments.map((experiment) => html`
    <h3>${experiment.title}</h3>
    ${rows(experiment.presets.map((preset) => {
      const title = `${experiment.title}: ${preset.title}`;
      return row(preset.title, preset.watch, () => add({ session: { recipe: presetRecipe(experiment, preset) }, title }), { name: title });
    }))}
  `);
  return html`
    <h3>Running sessions and saved runs</h3>
    ${own.length === 0 && html`<p class="hint">None yet. Add a preset from the list below, or paste a session's link.</p>`}
    ${rows(own)}
    ${presets}
  `;
}

/** @param {Add} add */
async function listComparisons(add) {
  const { comparisons } = await request("GET work", { limit: MOST_LISTED });
  if (comparisons.length === 0) return html`<p class="hint">No saved comparison yet. Compare runs and save the comparison, or paste a comparison's link.</p>`;
  return rows(comparisons.map(({ title, trackers, created, page }) =>
    row(title, `${count(trackers.length, "run")}, saved ${moment(created)}`, () => addLinked(add, page))));
}

/** @param {Add} add */
async function listPollForm(add) {
  const ask = (/** @type {{question: string, answers: string[]}} */ { question, answers }) => add({ poll: question, answers }, question, POLL_MINUTES);
  return h(PollForm, { ask, action: "Add the poll" });
}

/**
 * @param {Add} add
 * @param {string} address
 * @returns {Promise<boolean>} Whether a lecture can show its page.
 */
async function addLinked(add, address) {
  const item = await attempt(() => itemOfAddress(address));
  if (item !== undefined) add(item);
  return item !== undefined;
}

/** @param {{add: Add}} props */
function LinkField({ add }) {
  const take = async (/** @type {Event & {currentTarget: HTMLFormElement}} */ event) => {
    event.preventDefault();
    const form = event.currentTarget;
    if (await addLinked(add, String(new FormData(form).get("link")))) form.reset();
  };
  const placeholder = "Link of a session, a comparison, a lesson or a failure";
  return html`<form class="palette-link" onSubmit=${take}>
    <label for="palette-link">Or paste a link</label>
    <div class="menu-form">
      <input type="text" name="link" id="palette-link" required autocomplete="off" placeholder=${placeholder} />
      <button type="submit">Add</button>
    </div>
  </form>`;
}

/** @param {readonly Child[]} lines */
function rows(lines) {
  return lines.length > 0 && html`<ul class="rows">${lines}</ul>`;
}

/**
 * @param {string} title
 * @param {string} hint
 * @param {() => void} add
 * @param {{name?: string, more?: Child}} [beside] Its name if its title contains a number, and a further button.
 */
function row(title, hint, add, { name = title, more = null } = {}) {
  return html`<li class="row">
    <span class="row-words"><span class="row-title">${title}</span><span class="hint">${hint}</span></span>
    <span class="row-actions">${more}<button type="button" aria-label=${`Add ${name}`} onClick=${add}>Add</button></span>
  </li>`;
}
