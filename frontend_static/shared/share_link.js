/** What a session shall be like, as it travels in the fragment of a link, which no server logs. */

/** Link to a new session that does what `body` says (the body of POST sessions, and where to stand or to play). */
export function linkTo(body) {
  return `/session/new#${encode(body)}`;
}

/** base64url of JSON, in UTF-8. */
export function encode(body) {
  const raw = String.fromCharCode(...new TextEncoder().encode(JSON.stringify(body)));
  return btoa(raw).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/** Read a fragment; throws when it holds no body. */
export function decode(fragment) {
  const raw = atob(fragment.replace(/^#/, "").replaceAll("-", "+").replaceAll("_", "/"));
  const body = JSON.parse(new TextDecoder().decode(Uint8Array.from(raw, (letter) => letter.charCodeAt(0))));
  // A link of an earlier version has no recipe; the server understands it.
  if (typeof (body?.recipe ?? body)?.experiment !== "string") throw new Error("no experiment");
  return body;
}
