/** Dialogs, on the browser's own `<dialog>`: it keeps the focus, closes on Escape and gives the focus back. */

import { h, html, render } from "../vendor/preact.js";
import { build, IconButton } from "./dom.js";

/** @import { Child } from "../vendor/preact.js" */

/** The value of the confirming button. */
const DONE = "done";

/**
 * Open a dialog.
 *
 * @param {string} title
 * @param {(close: () => void) => Child} content Content of the dialog.
 * @param {""|"wide"|"large"} [size]
 * @returns {HTMLDialogElement}
 */
export function openDialog(title, content, size = "") {
  const element = build("dialog", { class: `dialog ${size}`, "aria-label": title });
  const close = () => element.close();
  const head = html`<header><h2>${title}</h2>${h(IconButton, { name: "close", title: "Close", run: close })}</header>`;
  render([head, content(close)], element);
  element.addEventListener("close", () => {
    // Its messages stay on the page.
    const said = element.querySelector(".toasts");
    if (said) document.body.append(said);
    render(null, element);
    element.remove();
  });
  element.addEventListener("pointerdown", (event) => {
    if (event.target === element) close();
  });
  document.body.append(element);
  element.showModal();
  return element;
}

/** Ask a question.
 *
 * @param {string} title
 * @param {Child} content Content with buttons that close it.
 * @returns {Promise<string>} The value of the button that was pressed; empty for none.
 */
export function ask(title, content) {
  return new Promise((resolve) => {
    const element = openDialog(title, () => html`<form method="dialog">${content}</form>`);
    element.addEventListener("close", () => resolve(element.returnValue));
  });
}

/** @typedef {{title: string, text: string, action: string}} Question What would be lost, and the word for doing it. */

/** Ask for confirmation before a permanent loss.
 *
 * @param {Question} question
 * @returns {Promise<boolean>} Whether the person confirmed.
 */
export async function confirmLoss({ title, text, action }) {
  const buttons = html`<footer><button autofocus>Keep</button><button value=${DONE} class="danger">${action}</button></footer>`;
  return (await ask(title, html`<p>${text}</p>${buttons}`)) === DONE;
}

/** Ask for a name.
 *
 * @param {string} title
 * @param {string} name The present name.
 * @param {string} [action] Label of the button.
 * @returns {Promise<string|null>} Null if it stays the same.
 */
export function askName(title, name, action = "Rename") {
  return new Promise((resolve) => {
    let given = "";
    const take = (/** @type {SubmitEvent & {currentTarget: HTMLFormElement}} */ { currentTarget }) =>
      (given = String(new FormData(currentTarget).get("name")).trim());
    const element = openDialog(title, (close) => html`<form method="dialog" onSubmit=${take}>
      <label for="new-name">Name</label>
      <input type="text" id="new-name" name="name" defaultValue=${name} maxlength="200" autofocus />
      <footer><button type="button" onClick=${close}>Cancel</button><button type="submit" class="primary">${action}</button></footer>
    </form>`);
    element.querySelector("input")?.select();
    element.addEventListener("close", () => resolve(given || null));
  });
}

/** Show the list of keys.
 *
 * @param {readonly (readonly [keys: string, what: string])[]} keys
 * @param {Child} [more]
 */
export function openKeys(keys, more = null) {
  const lines = keys.map(([each, what]) => html`<dt>${each.split(" ").map((key) => html`<kbd>${key}</kbd>`)}</dt><dd>${what}</dd>`);
  openDialog("Keys", () => [html`<dl class="keys">${lines}</dl>`, more]);
}

/** Whether keys belong to a dialog now. */
export function dialogIsOpen() {
  return document.querySelector("dialog[open]") !== null;
}
