/**
 * Files: a button with a list of those that can be made of the frame that is shown, and of those that can be brought in as the
 * value of a parameter.
 */

import { api } from "../shared/api.js";
import { fill, h } from "../shared/dom.js";
import { icon } from "../shared/icons.js";
import { attempt, toast } from "../shared/toast.js";
import { popover } from "./popover.js";

/** @import { Declaration, ExportPublic } from "../shared/messages.js" */

/** Bytes of a file that is not even sent: the server says what is wrong with smaller ones. */
const LARGEST = 500_000;

/** @param {import("./mount.js").Mounted} view */
export function fileMenu({ store }) {
  const label = h("span", { class: "wide-only" }, "Files");
  const button = h("button", { type: "button", title: "Take files away, or bring some in", "aria-label": "Files" }, icon("save"), label);
  const lists = h("div", {});
  const root = popover(button, lists);
  root.hidden = true;
  let shown = "";
  const draw = () => {
    const { session } = store;
    if (session === null) return;
    const { id, exports } = session;
    const files = session.declarations.filter(({ kind }) => kind === "file");
    const now = JSON.stringify([id, exports, files]);
    if (now === shown) return;
    shown = now;
    root.hidden = exports.length + files.length === 0;
    fill(lists, part("Take away", exports.map((one) => away(id, one))), part("Bring in", files.map((one) => into(id, one))));
  };
  store.on(["session"], draw);
  return root;
}

/**
 * @param {string} title
 * @param {HTMLElement[]} files Without any there is nothing.
 */
function part(title, files) {
  return files.length > 0 && h("section", {}, h("h2", {}, title), h("ul", { class: "menu-list" }, files));
}

/**
 * @param {string} session
 * @param {ExportPublic} offered
 */
function away(session, { name, title }) {
  const href = api.exportAddress(session, name);
  return h("li", {}, h("a", { class: "button quiet grow", href, download: "", data: { export: name } }, title));
}

/**
 * @param {string} session
 * @param {Declaration} declaration
 */
function into(session, { name, title, description, accept }) {
  const send = async () => {
    const file = input.files?.[0];
    input.value = "";
    if (!file) return;
    if (file.size > LARGEST) {
      toast(`${file.name} is too large to be such a file`, { kind: "error" });
      return;
    }
    await attempt(async () => {
      await api.parameters(session, { [name]: await file.text() });
      toast(`${file.name} is used from the next frame on`);
    });
  };
  /** @type {HTMLInputElement} */
  const input = h("input", { type: "file", accept, class: "visually-hidden", "aria-label": title, data: { file: name }, on: { change: send } });
  return h("li", {}, h("label", { class: "button quiet grow", title: description }, `${title}…`, input));
}
