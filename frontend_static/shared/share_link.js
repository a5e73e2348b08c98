/** What a session shall be like, as it travels in the fragment of a link, which no server logs. */

/** Link to a new session that does what `wish` says (the body of POST sessions, and where to stand or to play). */
export function linkTo(wish) {
  return `/session/new#${encode(wish)}`;
}

/** What a wish says of the recording that a session runs on, so that another one begins with the same target. */
export function targetOf(session) {
  const known = ["upload", "box", "points", "start"].filter((name) => session[name] !== undefined && session[name] !== null);
  return Object.fromEntries(known.map((name) => [name, session[name]]));
}

/** base64url of JSON, in UTF-8. */
export function encode(wish) {
  const raw = String.fromCharCode(...new TextEncoder().encode(JSON.stringify(wish)));
  return btoa(raw).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/** Read a fragment; throws when it holds no wish. */
export function decode(fragment) {
  const raw = atob(fragment.replace(/^#/, "").replaceAll("-", "+").replaceAll("_", "/"));
  const wish = JSON.parse(new TextDecoder().decode(Uint8Array.from(raw, (letter) => letter.charCodeAt(0))));
  if (typeof wish !== "object" || wish === null || typeof wish.experiment !== "string") throw new Error("no experiment");
  return wish;
}
