/**
 * Series: what tracker and experiment measure of every frame. General code finds them by role or by the name that a plot
 * declares; a row has only those that its tracker reports.
 */

/** The declaration of a series; undefined where nobody declares one of that name. */
export function declared(session, name) {
  return session.series?.find((series) => series.name === name);
}

/** The declarations of a role. */
export function ofRole(session, role) {
  return (session.series ?? []).filter((series) => series.role === role);
}

/** What a row has of a role: the value of the first series of it, or undefined. */
export function measured(session, role, row) {
  const series = ofRole(session, role).find(({ name }) => row?.series?.[name] !== undefined);
  return series && row.series[series.name];
}

/**
 * A number of a series in a frame, or the one at a place of several; NaN where it is not known.
 *
 * @param {import("./history.js").Row|undefined} row
 * @param {string} name
 * @param {number|null} [place]
 */
export function valueOf(row, name, place = null) {
  const found = row?.series?.[name];
  return finite(place === null ? found : found?.[place]) ?? NaN;
}

/** The number that a row has of a role; null where there is none. */
export function numberOf(session, role, row) {
  return finite(measured(session, role, row));
}

/** How many particles came from each sampler; null where the tracker does not choose between samplers. */
export function samplesOf(session, row) {
  return measured(session, "share", row) ?? null;
}

/** The components of what `samplesOf` counts: [{name, colour}], the colours as tokens of the style sheet. */
export function samplers(session) {
  const [series] = ofRole(session, "share");
  return (series?.components ?? []).map((name, place) => ({ name, colour: series.colours[place] ?? "muted" }));
}

/** Of flags, the share that were set up to each frame; NaN before any is known. */
export function frequencies(history, name, last = history.length - 1) {
  /** @type {number[]} */
  const found = [];
  let [set, known] = [0, 0];
  for (let frame = 0; frame <= Math.min(last, history.length - 1); frame += 1) {
    const value = history.at(frame)?.series?.[name] ?? [];
    for (const flag of Array.isArray(value) ? value : [value]) {
      if (finite(flag) === null) continue;
      set += flag;
      known += 1;
    }
    found.push(known > 0 ? set / known : NaN);
  }
  return found;
}

/** Whether a value says anything: a number, or several of which one is known. */
export function isKnown(value) {
  if (Array.isArray(value)) return value.some(isKnown);
  if (value !== null && typeof value === "object") return value.values.length > 0;
  return finite(value) !== null;
}

/**
 * @param {unknown} value
 * @returns {number|null}
 */
function finite(value) {
  return typeof value === "number" && Number.isFinite(value) ? value : null;
}
