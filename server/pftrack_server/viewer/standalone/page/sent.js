// What is in this file, unpacked: text of bytes, and bytes of text.

/** @param {string} id Of the element whose text it is. */
function text(id) {
  return document.getElementById(id)?.textContent ?? "";
}

/** @param {string} id */
export function values(id) {
  return JSON.parse(text(id));
}

/** @param {string} id */
export function bytes(id) {
  const letters = atob(text(id));
  const data = new Uint8Array(letters.length);
  for (let at = 0; at < letters.length; at += 1) data[at] = letters.charCodeAt(at);
  return data;
}

/** @param {Uint8Array<ArrayBuffer>} packed */
export function unzipped(packed) {
  return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}
