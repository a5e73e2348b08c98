/**
 * Files: a button with lists of those that the run, or the frame that is shown, can be taken away as, and of those that can be
 * brought in as the value of a parameter.
 */

import { api } from "../shared/api.js";
import { fill, h } from "../shared/dom.js";
import { exportLists } from "../shared/exports.js";
import { icon } from "../shared/icons.js";
import { attempt, toast } from "../shared/toast.js";
import { popover } from "./popover.js";
import { truthRow } from "./truth/truth_row.js";

/** @import { Declaration } from "../shared/messages.js" */

/** Bytes of a file that is not even sent: the server says what is wrong with smaller ones. */
const LARGEST = 500_000;

/** @param {import("./mount.js").Mounted} view */
export function fileMenu(view) {
  const { store } = view;
  const label = h("span", { class: "wide-only" }, "Files");
  const button = h("button", { type: "button", title: "Export or import files", "aria-label": "Files" }, icon("files"), label);
  const away = exportLists((name, plot) => api.exportSession(store.known.id, name, plot));
  const into = h("div", {});
  const root = popover(button, h("section", {}, h("h2", {}, "Take away"), away.element), into);
  root.hidden = true;
  let shown = "";
  let look = () => {};
  // Truth may have been given meanwhile, here or elsewhere. The event does not bubble.
  root.addEventListener("toggle", () => look(), { capture: true });
  const draw = () => {
    const { session } = store;
    if (session === null) return;
    const { id, exports, parameters, plots } = session;
    const files = session.declarations.filter(({ kind }) => kind === "file");
    const used = files.map(({ name }) => parameters[name] !== "");
    const now = JSON.stringify([id, exports, files, used]);
    if (now === shown) return;
    shown = now;
    const takesTruth = session.upload !== null && session.truth_columns.length > 0;
    root.hidden = exports.length + files.length === 0;
    away.draw(exports, plots);
    const truth = takesTruth ? truthRow(view) : null;
    const brought = [...(truth ? [truth.element] : []), ...files.map((one, place) => bringIn(id, one, used[place]))];
    look = () => truth?.look();
    fill(into, brought.length > 0 && part(brought));
  };
  store.on(["parameters"], draw);
  return root;
}

/** @param {HTMLElement[]} files */
function part(files) {
  return h("section", {}, h("h2", {}, "Bring in"), h("ul", { class: "menu-list" }, files));
}

/**
 * @param {string} session
 * @param {Declaration} declaration
 * @param {boolean} used Whether there is such a file already.
 */
function bringIn(session, { name, title, description, accept }, used) {
  const use = async (/** @type {string} */ text, /** @type {string} */ words) => {
    await api.command(session, { kind: "change", values: { [name]: text } });
    const run = () => attempt(() => api.command(session, { kind: "restart" }));
    toast(`${words} from the next frame on`, { action: { label: "Begin again", run } });
  };
  const send = async () => {
    const file = input.files?.[0];
    input.value = "";
    if (!file) return;
    if (file.size > LARGEST) {
      toast(`${file.name} is too large for this kind of file`, { kind: "error" });
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
  const without = `Stop using this file: ${title}`;
  const remove = used && h("button", { type: "button", class: "quiet", title: without, data: { drop: name }, on: { click: drop } }, "Remove");
  return h("li", {}, choose, remove);
}
