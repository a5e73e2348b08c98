/** What stands on a page becomes an item of a lecture, without leaving the page. */

import { absolute } from "../shared/address.js";
import { api } from "../shared/api.js";
import { savedOf } from "../shared/comparison_link.js";
import { fill, h } from "../shared/dom.js";
import { attempt, toast } from "../shared/toast.js";
import { itemOfLink } from "./item_of_link.js";
import { lectures } from "./lectures_api.js";

const NEW = { id: "", title: "a new lecture" };

/** @returns {HTMLElement} A choice of lectures, and the button that adds to one. */
export function addToLecture() {
  const choice = h("select", { "aria-label": "Lecture" }, h("option", { value: NEW.id }, NEW.title));
  const add = h("button", { type: "button", data: { role: "add-to-lecture" }, on: { click: () => attempt(addHere) } }, "Add");
  const addHere = async () => {
    add.disabled = true;
    try {
      const item = await itemHere();
      const { id, title, items } = await put(choice.value, item);
      toast(`Item ${items.length} of ${title}`, { action: { label: "Open the lecture", href: `lectures/${encodeURIComponent(id)}` } });
      await list(choice, id);
    } finally {
      add.disabled = false;
    }
  };
  list(choice, "").catch(() => {});
  return h("section", { class: "class-lecture", "aria-label": "Add to a lecture" }, h("span", {}, "Add this page to"), choice, add);
}

/**
 * @param {HTMLSelectElement} choice
 * @param {string} chosen
 */
async function list(choice, chosen) {
  const all = await lectures.all();
  const newest = chosen || (all[0]?.id ?? NEW.id);
  fill(choice, [...all, NEW].map(({ id, title }) => h("option", { value: id, selected: id === newest }, title)));
}

/** @returns {Promise<Record<string, unknown>>} What the address says is shown, as a lecture's file has it. */
async function itemHere() {
  const isComparison = location.pathname === new URL(absolute("compare")).pathname;
  const saved = isComparison ? savedOf(location) : null;
  if (saved !== null) {
    const { runs, position, arrangement } = await api.savedComparison(saved);
    return { comparison: { runs, position, arrangement } };
  }
  const found = itemOfLink(location.href, document.baseURI);
  if ("item" in found) return found.item;
  const { recipe, upload, position, name } = await api.session(found.session);
  return { session: { recipe, upload, position }, title: name };
}

/**
 * @param {string} id Empty for a new one.
 * @param {Record<string, unknown>} item
 */
async function put(id, item) {
  if (id === NEW.id) return lectures.add({ title: "My lecture", notes: "", items: [item] });
  const { title, notes, items } = await lectures.get(id);
  return lectures.change(id, { title, notes, items: [...items.map((each) => each.item), item] });
}
