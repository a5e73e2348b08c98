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

/** How long a file is kept for the browser to save it. */
const KEPT_MS = 60_000;

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
    const { id, exports, parameters } = session;
    const files = session.declarations.filter(({ kind }) => kind === "file");
    const used = files.map(({ name }) => parameters[name] !== "");
    const now = JSON.stringify([id, exports, files, used]);
    if (now === shown) return;
    shown = now;
    root.hidden = exports.length + files.length === 0;
    fill(
      lists,
      part("Take away", exports.map((one) => away(id, one))),
      part("Bring in", files.map((one, place) => into(id, one, used[place]))),
    );
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
  const take = (/** @type {Event} */ event) => {
    event.preventDefault();
    // A browser that is sent there keeps to itself why a file cannot be made of this frame.
    attempt(async () => save(await api.exported(session, name)));
  };
  return h("li", {}, h("a", { class: "button quiet grow", href, download: "", data: { export: name }, on: { click: take } }, title));
}

/** @param {{name: string, content: Blob}} file */
function save({ name, content }) {
  const href = URL.createObjectURL(content);
  h("a", { href, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(href), KEPT_MS);
}

/**
 * @param {string} session
 * @param {Declaration} declaration
 * @param {boolean} used Whether there is such a file already.
 */
function into(session, { name, title, description, accept }, used) {
  const use = async (/** @type {string} */ text, /** @type {string} */ words) => {
    await api.parameters(session, { [name]: text });
    const run = () => attempt(() => api.transport(session, "restart"));
    toast(`${words} from the next frame on`, { action: { label: "Begin again", run } });
  };
  const send = async () => {
    const file = input.files?.[0];
    input.value = "";
    if (!file) return;
    if (file.size > LARGEST) {
      toast(`${file.name} is too large to be such a file`, { kind: "error" });
      return;
    }
    const text = await file.text();
    if (text.trim() === "") {
      toast(`${file.name} is empty`, { kind: "error" }); // which as a value would mean that there is no file
      return;
    }
    await attempt(async () => use(text, `${file.name} is used`));
  };
  const drop = () => attempt(() => use("", "The file is no longer used"));
  /** @type {HTMLInputElement} */
  const input = h("input", { type: "file", accept, class: "visually-hidden", "aria-label": title, data: { file: name }, on: { change: send } });
  const choose = h("label", { class: "button quiet grow", title: description }, `${title}…`, used && h("span", { class: "hint" }, "in use"), input);
  const without = `Go on without this file: ${title}`;
  const remove = used && h("button", { type: "button", class: "quiet", title: without, data: { drop: name }, on: { click: drop } }, "Remove");
  return h("li", {}, choose, remove);
}
