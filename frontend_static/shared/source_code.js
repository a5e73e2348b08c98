/** What computes something again, to be copied as Python or as a command. */

import { messageOf } from "./api.js";
import { copyButton } from "./copy.js";
import { openDialog } from "./dialog.js";
import { fill, h } from "./dom.js";
import { icon } from "./icons.js";

/** @import { SourceCode } from "./messages.js" */

/**
 * The lines, asked for when they are looked at.
 *
 * @param {() => Promise<SourceCode>} ask
 */
export function sourceCode(ask) {
  const place = h("div", { class: "source-code" });
  const show = async () => {
    try {
      const { python, command } = await ask();
      fill(place, lines("Python", python), lines("command", command));
    } catch (error) {
      fill(place, h("p", { class: "hint", role: "alert" }, messageOf(error)));
    }
  };
  show();
  return place;
}

/**
 * A button that shows the lines in a dialog.
 *
 * @param {() => Promise<SourceCode>} ask
 */
export function sourceCodeButton(ask) {
  const open = () =>
    openDialog("The same in code", (close) => [
      h("p", {}, "These lines compute the same numbers where pftrack is installed."),
      sourceCode(ask),
      h("footer", {}, h("button", { type: "button", on: { click: close } }, "Close")),
    ], { wide: true });
  const title = "Copy as Python or as a command";
  return h("button", { type: "button", class: "tool", title, "aria-label": title, data: { role: "code" }, on: { click: open } }, icon("code"));
}

/**
 * @param {string} what
 * @param {string} text
 */
function lines(what, text) {
  return h(
    "details",
    { open: text.length < 400 },
    h("summary", {}, `As ${what}`, copyButton(`Copy as ${what}`, text, "the lines")),
    h("pre", { tabindex: 0, "aria-label": `Lines of ${what}` }, text),
  );
}
