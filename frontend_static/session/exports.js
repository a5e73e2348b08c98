/** Exports: a button with a list of the files that can be made of the frame that is shown. */

import { api } from "../shared/api.js";
import { fill, h } from "../shared/dom.js";
import { icon } from "../shared/icons.js";
import { popover } from "./popover.js";

/** @param {import("./mount.js").Mounted} view */
export function exportMenu({ store }) {
  const label = h("span", { class: "wide-only" }, "Export");
  const button = h("button", { type: "button", title: "Files of the frame that is shown", "aria-label": "Export" }, icon("save"), label);
  const list = h("ul", { class: "menu-list" });
  const root = popover(button, list);
  root.hidden = true;
  let shown = "";
  const draw = () => {
    const { session } = store;
    const exports = session?.exports ?? [];
    const now = JSON.stringify([session?.id, exports]);
    if (session === null || now === shown) return;
    shown = now;
    root.hidden = exports.length === 0;
    fill(
      list,
      exports.map(({ name, title }) =>
        h("li", {}, h("a", { class: "button quiet grow", href: api.exportAddress(session.id, name), download: "", data: { export: name } }, title)),
      ),
    );
  };
  store.on(["session"], draw);
  return root;
}
