/** What a lecture can be made of: lists of each kind, a form for a poll, and a field for a link. */

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

/** @typedef {(item: Item, title?: string, minutes?: number) => void} Add `title` is for an item that says none itself; the server knows better. */

const MOST_COMPARED = 4;
const MOST_LISTED = 50;
const POLL_MINUTES = 2;
/** @type {readonly {id: string, title: string, list: (add: Add) => Promise<Child>}[]} */
const PLACES = [
  { id: "lessons", title: "Lessons", list: listLessons },
  { id: "failures", title: "Failures", list: listFailures },
  { id: "sessions", title: "Sessions", list: listSessions },
  { id: "comparisons", title: "Comparisons", list: async (add) => h(Compared, { add, all: await mine() }) },
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
    <div key=${id} class="palette-place">${h(Loaded, { load: () => list(add), failed: `${title} could not be listed` })}</div>
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
  const [own, experiments] = await Promise.all([mine(), request("GET experiments")]);
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
    ${rows(own.map(({ title, hint, item }) => row(title, hint, () => add(item))))}
    ${presets}
  `;
}

/** @param {Add} add */
async function listPollForm(add) {
  const ask = (/** @type {{question: string, answers: string[]}} */ { question, answers }) => add({ poll: question, answers }, question, POLL_MINUTES);
  return h(PollForm, { ask, action: "Add the poll" });
}

/**
 * Runs to be chosen for a comparison.
 *
 * @param {{add: Add, all: Awaited<ReturnType<typeof mine>>}} props
 */
function Compared({ add, all }) {
  const chosen = useSignal(/** @type {readonly typeof all[number][]} */ ([]));
  if (all.length < 2) return html`<p class="hint">A comparison needs two sessions or saved runs. Start another, or paste the link of a comparison.</p>`;
  const box = (/** @type {typeof all[number]} */ run) => {
    const isChosen = chosen.value.includes(run);
    const turn = () => (chosen.value = isChosen ? chosen.value.filter((other) => other !== run) : [...chosen.value, run]);
    return html`<li><label class="row"><input type="checkbox" checked=${isChosen} onChange=${turn} />${words(run.title, run.hint)}</label></li>`;
  };
  const amount = chosen.value.length;
  const compare = () => add({ comparison: { runs: chosen.value.map(({ run }) => run) }, title: chosen.value.map(({ title }) => title).join(" · ") });
  return html`
    <h3>Choose two to four</h3>
    ${rows(all.map(box))}
    <div class="poll-line">
      <button type="button" class="primary" disabled=${amount < 2 || amount > MOST_COMPARED} onClick=${compare}>
        ${amount < 2 ? "Add" : `Add a comparison of ${count(amount, "run")}`}
      </button>
    </div>
  `;
}

/** What somebody has: as an item by itself, and as a run of a comparison. */
async function mine() {
  const { sessions, runs } = await request("GET work", { limit: MOST_LISTED });
  return [
    ...sessions.map((session) => {
      const { recipe, upload, position } = session;
      return { title: sessionTitle(session), hint: `running, frame ${position}`, item: itemOfSession(session), run: { recipe, upload } };
    }),
    ...runs.map(({ id, title, created }) => {
      const run = { reference: id };
      return { title, hint: `saved ${moment(created)}`, item: { session: run, title }, run };
    }),
  ];
}

/** @param {{add: Add}} props */
function LinkField({ add }) {
  const take = async (/** @type {Event & {currentTarget: HTMLFormElement}} */ event) => {
    event.preventDefault();
    const form = event.currentTarget;
    const item = await attempt(() => itemOfAddress(String(new FormData(form).get("link"))));
    if (item === undefined) return;
    add(item);
    form.reset();
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
 * @param {{name?: string, more?: Child}} [beside] Its name where its title has a number, and what else can be added.
 */
function row(title, hint, add, { name = title, more = null } = {}) {
  return html`<li class="row">
    ${words(title, hint)}
    <span class="row-actions">${more}<button type="button" aria-label=${`Add ${name}`} onClick=${add}>Add</button></span>
  </li>`;
}

/**
 * @param {string} title
 * @param {string} hint
 */
function words(title, hint) {
  return html`<span class="row-words"><span class="row-title">${title}</span><span class="hint">${hint}</span></span>`;
}
