// A typed number is sent when it is finished (Enter, Tab, leaving the box), not digit by digit: 800 is not 8. Until then no answer of the
// session may overwrite it.
const unfinished = new WeakSet();
let finishing = false;
/**
 * @param {EventTarget|null} element
 * @returns {element is HTMLInputElement}
 */
const isNumber = (element) => element instanceof HTMLInputElement && element.inputMode !== "" && element.closest(".mantine-NumberInput-root") !== null;
const finish = (/** @type {EventTarget|null} */ element) => {
  if (element === null || !unfinished.delete(element)) return;
  finishing = true;
  element.dispatchEvent(new Event("input", { bubbles: true }));
  finishing = false;
};
const guarded = new WeakSet();
const guard = (/** @type {HTMLInputElement} */ element) => {
  const own = Object.getOwnPropertyDescriptor(element, "value");
  if (guarded.has(element) || !own?.configurable || !own.set) return;
  guarded.add(element);
  const setOwn = own.set.bind(element);
  const set = (/** @type {string} */ value) => {
    if (unfinished.has(element)) return;
    // A wholly selected number will be overwritten by typing, even if it has just changed.
    const selected = Number(element.selectionEnd) - Number(element.selectionStart);
    const isSelected = document.activeElement === element && selected === element.value.length;
    setOwn(value);
    if (isSelected) element.select();
  };
  Object.defineProperty(element, "value", { ...own, set });
};
addEventListener("focusin", (event) => isNumber(event.target) && guard(event.target), true);
addEventListener(
  "input",
  (event) => {
    if (finishing || !isNumber(event.target)) return;
    guard(event.target);
    unfinished.add(event.target);
    event.stopImmediatePropagation();
  },
  true,
);
addEventListener("keydown", (event) => event.key === "Enter" && finish(event.target), true);
addEventListener("focusout", (event) => finish(event.target), true);
