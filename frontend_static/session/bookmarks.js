/** Bookmarks: a button with a list under it; each entry goes to its frame. */

import { api } from "../shared/api.js";
import { fill, h, setText } from "../shared/dom.js";
import { icon } from "../shared/icons.js";
import { attempt } from "../shared/toast.js";
import { popover } from "./popover.js";

/** @import { Bookmark } from "../shared/messages.js" */
/** @import { Mounted } from "./mount.js" */

/** @param {Mounted} view */
export function bookmarkMenu(view) {
  const { store, commands } = view;
  const label = h("span", { class: "wide-only" }, "Bookmarks");
  const amount = h("span", { class: "amount" });
  const list = h("ul", { class: "menu-list" });
  const note = h("input", { type: "text", maxlength: 200, placeholder: "Note for this frame", "aria-label": "Note" });
  const form = h(
    "form",
    {
      class: "menu-form",
      on: {
        submit: (event) => {
          event.preventDefault();
          commands.bookmark(note.value.trim());
          note.value = "";
        },
      },
    },
    note,
    h("button", { type: "submit", title: "Bookmark this frame (B)" }, "Add"),
  );
  const button = h("button", { type: "button", title: "Bookmarks (B adds one)", "aria-label": "Bookmarks" }, icon("bookmark"), label, amount);
  const draw = () => {
    const marks = store.session?.bookmarks ?? [];
    setText(amount, marks.length > 0 ? String(marks.length) : "");
    fill(
      list,
      marks.length === 0 && h("li", { class: "hint" }, "None yet. B marks the frame that is shown."),
      [...marks].sort((a, b) => a.frame - b.frame).map((mark) => entry(mark, view)),
    );
  };
  store.on(["bookmarks"], draw);
  return popover(button, form, list);
}

/**
 * @param {Bookmark} mark
 * @param {Mounted} view
 */
function entry(mark, { store, commands, steering }) {
  const go = async () => {
    if (mark.branch && mark.branch !== store.known.branch) await commands.activate(mark.branch);
    await steering.seek(mark.frame);
  };
  const remove = () => attempt(() => api.unbookmark(store.known.id, mark.id));
  return h(
    "li",
    {},
    h("button", { type: "button", class: "quiet grow", on: { click: go } }, `frame ${mark.frame}`, mark.note && h("span", { class: "hint" }, mark.note)),
    h("button", { type: "button", class: "quiet icon-only", "aria-label": `Remove the bookmark at frame ${mark.frame}`, on: { click: remove } }, icon("trash")),
  );
}
