// A typed number counts when it is finished (Enter, Tab, leaving the box), not digit by digit: 800 is not 8. Until
// then no answer of the session to something else may write over it.
const unfinished = new WeakSet();
let finishing = false;
const isNumber = (element) => element instanceof HTMLInputElement && element.inputMode !== "" && element.closest(".mantine-NumberInput-root");
const finish = (element) => {
  if (!unfinished.delete(element)) return;
  finishing = true;
  element.dispatchEvent(new Event("input", { bubbles: true }));
  finishing = false;
};
const guarded = new WeakSet();
const guard = (element) => {
  const own = Object.getOwnPropertyDescriptor(element, "value");
  if (guarded.has(element) || !own?.configurable || !own.set) return;
  guarded.add(element);
  const set = function (value) {
    if (unfinished.has(element)) return;
    // What is selected as a whole is about to be typed over, also when it has just become another number.
    const isSelected = document.activeElement === element && element.selectionEnd - element.selectionStart === element.value.length;
    own.set.call(this, value);
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
