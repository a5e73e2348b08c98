/** Reading a timeline of parameter changes: what a change did, in words. */

import { parameterValue } from "../shared/format.js";

/** @import { Value } from "../shared/format.js" */

/**
 * @typedef {import("../shared/messages.js").SessionPublic} SessionPublic
 * @typedef {{frame: number, lines: string[]}} Mark
 */

/**
 * Changes as diamonds: one for each frame after the start in which something changes beside what is drawn.
 *
 * @param {SessionPublic} session
 * @returns {Mark[]}
 */
export function marks(session) {
  const isDrawn = (/** @type {string} */ name) => session.declarations.some((each) => each.name === name && each.role === "drawing");
  return session.timeline
    .filter(({ frame, values }) => frame > 0 && !Object.keys(values).every(isDrawn))
    .map(({ frame, values, before }) => ({
      frame,
      lines: trackerFirst(values).map(([name, value]) => {
        const what = done(session, name, value);
        if (what !== null) return what;
        const [title, old, now] = inWords(session, name, before[name], value);
        return old === null || old === now ? `${title} ${now}` : `${title} ${old} → ${now}`;
      }),
    }));
}

/**
 * What was done, where the value says nothing to a person: the text of a file.
 *
 * @param {SessionPublic} session
 * @param {string} name
 * @param {Value} value
 */
function done(session, name, value) {
  const declaration = session.declarations.find((candidate) => candidate.name === name);
  if (declaration?.kind === "file") return value === "" ? `${declaration.title}: none` : declaration.title;
  return null;
}

/** @param {Record<string, Value>} values */
function trackerFirst(values) {
  return Object.entries(values).sort(([a], [b]) => Number(b === "tracker") - Number(a === "tracker"));
}

/**
 * @param {SessionPublic} session
 * @param {string} name
 * @param {Value|undefined} before
 * @param {Value} after
 * @returns {[string, string|null, string]} Title, old value and new one.
 */
function inWords(session, name, before, after) {
  if (name === "tracker") return ["Tracker", before === undefined ? null : trackerTitle(session, String(before)), trackerTitle(session, String(after))];
  const declaration = session.declarations.find((candidate) => candidate.name === name);
  const old = before === undefined ? null : parameterValue(before, null);
  return [declaration?.title ?? name, old, parameterValue(after, declaration)];
}

/**
 * What tells a session from others: its name, its tracker, its seed.
 *
 * @param {SessionPublic} session
 */
export function sessionTitle(session) {
  return `${session.name} · ${trackerTitle(session, session.tracker)} · seed ${session.recipe.seed}`;
}

/**
 * The heading of a session's page: the experiment, and the clip, the preset or the name that a person gave.
 *
 * @param {SessionPublic} session
 */
export function headingOf({ title, name }) {
  return name === "" || name === title ? title : `${title} · ${name}`;
}

/**
 * A tracker's name as people know it.
 *
 * @param {{trackers: {id: string, title: string}[]}} session
 * @param {string|undefined} id
 */
export function trackerTitle(session, id) {
  return session.trackers.find((tracker) => tracker.id === id)?.title ?? id ?? "–";
}
