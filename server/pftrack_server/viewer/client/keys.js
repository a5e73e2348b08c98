// Passes the outer page's keys to it. viser would fly with W, E and some others; the mouse can do that, too.
const KEYS = new Set([" ", "ArrowLeft", "ArrowRight", "Home", "End", "PageUp", "PageDown", "[", "]", "?", ..."bBcCdDeEfFiIlLnNpPtTwW12345678"]);
// Escape ends actions both in the page and in the scene.
const SHARED_KEY = "Escape";
const SLIDER_KEYS = new Set(["ArrowLeft", "ArrowRight", "Home", "End"]);
// A page opened from a file has no origin.
const AROUND = location.origin === "null" ? "*" : location.origin;
let clicked = true;
addEventListener("pointerdown", () => (clicked = true), true);
addEventListener("keydown", (event) => event.key === "Tab" && (clicked = false), true);
const belongsTo = (/** @type {EventTarget|null} */ element, /** @type {string} */ key) => {
  if (!(element instanceof Element)) return false;
  if (element.closest("textarea, select, [contenteditable=''], [contenteditable=true]")) return true;
  const input = element.closest("input");
  if (input && !["checkbox", "radio", "button"].includes(input.type)) return true;
  if (element.closest("[role=slider]")) return SLIDER_KEYS.has(key);
  if (element.closest("[role=listbox], [role=option], [role=dialog]")) return true;
  // Space presses a button focused by keyboard, not one that was just clicked.
  return key === " " && !clicked && element.matches("button, input, [role=button], a");
};
addEventListener(
  "keydown",
  (event) => {
    // A stand-alone scene keeps its keys.
    if (parent === window || event.ctrlKey || event.metaKey || event.altKey || (event.key !== SHARED_KEY && !KEYS.has(event.key))) return;
    if (belongsTo(event.target, event.key)) return;
    if (event.key !== SHARED_KEY) {
      event.preventDefault();
      event.stopImmediatePropagation();
    }
    parent.postMessage({ source: "pftrack-viser", key: event.key, shiftKey: event.shiftKey }, AROUND);
  },
  true,
);
addEventListener(
  "keyup",
  (event) => {
    // A button is pressed when space is released.
    if (event.key === " " && !belongsTo(event.target, " ")) event.preventDefault();
  },
  true,
);
