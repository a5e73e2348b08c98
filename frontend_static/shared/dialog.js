/** Dialogs, on the browser's own `<dialog>`: it keeps the focus, closes on Escape and gives the focus back. */

import { build, fill, icon } from "./dom.js";

/** @import { Child } from "./elements.js" */

/** The value of the button that does it. */
const DONE = "done";

/**
 * Open a dialog.
 *
 * @param {string} title
 * @param {(close: () => void) => Child[]} body What is in it.
 * @param {{wide?: boolean}} [options]
 * @returns {HTMLDialogElement}
 */
export function openDialog(title, body, { wide = false } = {}) {
  const element = build("dialog", { class: wide ? "dialog wide" : "dialog", "aria-label": title });
  const close = () => element.close();
  fill(
    element,
    build(
      "header",
      {},
      build("h2", {}, title),
      build("button", { class: "quiet icon-only", type: "button", "aria-label": "Close", on: { click: close } }, icon("close")),
    ),
    body(close),
  );
  element.addEventListener("close", () => {
    // Its messages stay on the page.
    const said = element.querySelector(".toasts");
    if (said) document.body.append(said);
    element.remove();
  });
  element.addEventListener("pointerdown", (event) => {
    if (event.target === element) close();
  });
  document.body.append(element);
  element.showModal();
  return element;
}

/** @typedef {{title: string, text: string, action: string}} Question What would be lost, and the word for doing it. */

/**
 * Ask before something is lost for good.
 *
 * @param {Question} question
 * @returns {Promise<boolean>} Whether it shall be done.
 */
export function confirmLoss({ title, text, action }) {
  return new Promise((resolve) => {
    const element = openDialog(title, () => [
      build("p", {}, text),
      build(
        "form",
        { method: "dialog" },
        build("footer", {}, build("button", { autofocus: true }, "Keep"), build("button", { value: DONE, class: "danger" }, action)),
      ),
    ]);
    element.addEventListener("close", () => resolve(element.returnValue === DONE));
  });
}

/**
 * Ask what something is to be called.
 *
 * @param {string} title
 * @param {string} name As it is called now.
 * @param {string} [action] What the button says.
 * @returns {Promise<string|null>} Null if it is to stay.
 */
export function askName(title, name, action = "Rename") {
  return new Promise((resolve) => {
    /** @type {HTMLInputElement} */
    const field = build("input", { type: "text", id: "new-name", value: name, maxlength: 200, autofocus: true });
    const element = openDialog(title, (close) => {
      const cancel = build("button", { type: "button", on: { click: close } }, "Cancel");
      const buttons = build("footer", {}, cancel, build("button", { type: "submit", value: DONE, class: "primary" }, action));
      return [build("form", { method: "dialog" }, build("label", { for: "new-name" }, "Name"), field, buttons)];
    });
    field.select();
    element.addEventListener("close", () => resolve((element.returnValue === DONE && field.value.trim()) || null));
  });
}

/**
 * Show which keys there are.
 *
 * @param {readonly (readonly [keys: string, what: string])[]} keys
 * @param {...Child} more
 */
export function openKeys(keys, ...more) {
  const lines = keys.map(([each, what]) => [build("dt", {}, each.split(" ").map((key) => build("kbd", {}, key))), build("dd", {}, what)]);
  openDialog("Keys", () => [build("dl", { class: "keys" }, lines), ...more]);
}

/** Whether keys belong to a dialog now. */
export function dialogIsOpen() {
  return document.querySelector("dialog[open]") !== null;
}
