/** The button that opens the editor, where the server was started with a filter of this experiment that pages may write. */

import { api } from "../../shared/api.js";
import { h, part } from "../../shared/dom.js";
import { icon } from "../../shared/icons.js";
import { attempt } from "../../shared/toast.js";

/** @import { Editor } from "./editor.js" */
/** @import { Store } from "../store.js" */

const TITLE = "Write your filter beside the scene";

/**
 * @param {Store} store
 * @returns {HTMLElement} A place that stays empty where there is nothing to edit.
 */
export function editorButton(store) {
  const element = part("editor");
  /** @type {Editor|null} */
  let editor = null;
  const toggle = () =>
    attempt(async () => {
      element.hidden = editor !== null && !element.hidden;
      button.setAttribute("aria-pressed", String(!element.hidden));
      if (editor !== null) {
        editor.focus();
        return;
      }
      const [file] = await offered(store);
      // The editor is large, and few pages need it.
      const { Editor: Made } = await import("./editor.js");
      editor = new Made(element, store, file, toggle);
    });
  const properties = { type: "button", class: "tool", title: TITLE, "aria-pressed": "false", hidden: true, on: { click: toggle } };
  const button = h("button", properties, icon("code"), h("span", { class: "wide-only" }, "Code"));
  let isAsked = false;
  store.on(["session"], async () => {
    if (isAsked) return;
    isAsked = true;
    button.hidden = (await offered(store).catch(() => [])).length === 0;
  });
  return button;
}

/** @param {Store} store */
async function offered(store) {
  const { experiment } = store.known.recipe;
  return (await api.filters()).filter((file) => file.editable && file.experiment === experiment);
}
