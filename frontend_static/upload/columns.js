/** A table of boxes whose columns have names of its own: which of them is what. */

import { h } from "../shared/dom.js";

/**
 * @typedef {object} Answer
 * @property {(columns: Record<string, number>) => void} chosen
 * @property {() => void} cancelled
 */

/**
 * The form that asks, with the first lines of the table above it.
 *
 * @param {string} name Of the file.
 * @param {import("../shared/messages.js").Preview} table
 * @param {string} refusal Why it was not understood.
 * @param {Answer} on
 */
export function columnsForm(name, table, refusal, on) {
  const choices = table.meanings.map((meaning) => {
    const id = `column-${meaning.name}`;
    const guessed = table.guess[meaning.name] ?? -1;
    const none = h("option", { value: "" }, "none");
    const options = table.header.map((title, place) => h("option", { value: place, selected: place === guessed }, title || `column ${place + 1}`));
    const select = h("select", { id }, none, options);
    return { name: meaning.name, select, row: h("div", {}, h("label", { for: id }, meaning.title), select) };
  });
  const submit = (/** @type {Event} */ event) => {
    event.preventDefault();
    const said = choices.filter(({ select }) => select.value !== "");
    on.chosen(Object.fromEntries(said.map(({ name: what, select }) => [what, Number(select.value)])));
  };
  return h(
    "form",
    { class: "columns", "aria-label": "Columns of the table", on: { submit } },
    h("p", { class: "drop-words" }, h("strong", {}, `What are the columns of ${name}?`)),
    h("p", { class: "hint" }, "Say where the frame is, and of the box two edges or its middle, and its size or the other edges."),
    h("details", {}, h("summary", {}, "Why is this asked?"), h("p", { class: "hint" }, refusal)),
    h(
      "div",
      { class: "columns-rows", tabindex: 0, role: "region", "aria-label": "First lines" },
      h(
        "table",
        {},
        h("thead", {}, h("tr", {}, table.header.map((title) => h("th", { scope: "col" }, title)))),
        h("tbody", {}, table.rows.map((row) => h("tr", {}, row.map((cell) => h("td", {}, cell))))),
      ),
    ),
    h("div", { class: "columns-choices" }, choices.map(({ row }) => row)),
    h(
      "footer",
      {},
      h("button", { type: "button", on: { click: on.cancelled } }, "Cancel"),
      h("button", { type: "submit", class: "primary" }, "Open it"),
    ),
  );
}
