/**
 * Links that hold a whole run: experiment, seed, tracker and timeline travel in the fragment, which no server logs. Who
 * opens one gets the same numbers.
 */

import { absolute } from "../shared/address.js";
import { api } from "../shared/api.js";
import { openDialog } from "../shared/dialog.js";
import { h } from "../shared/dom.js";
import { toast } from "../shared/toast.js";
import { linkTo } from "../shared/share_link.js";
import { sourceCode } from "../shared/source_code.js";

/** @import { SessionPublic } from "../shared/messages.js" */

/**
 * What makes this session again, up to the frame that is shown.
 *
 * @param {SessionPublic} session
 */
export function bodyOf(session) {
  const { recipe, upload, position } = session;
  return { recipe, upload, position };
}

/**
 * Show the link of a session, ready to be copied.
 *
 * @param {SessionPublic} session
 */
export function shareDialog(session) {
  const address = absolute(linkTo(bodyOf(session)));
  openDialog("Share this run", (close) => {
    const field = h("input", { type: "text", readonly: true, value: address, "aria-label": "Link", "data-role": "share-link", autofocus: true });
    field.addEventListener("focus", () => field.select());
    const copy = async () => {
      try {
        await navigator.clipboard.writeText(address);
        toast("Link copied");
        close();
      } catch {
        field.focus();
        field.select();
        toast("The browser does not let this page copy; the link is selected, copy it with the keyboard", { kind: "error" });
      }
    };
    return [
      h(
        "p",
        {},
        `The link holds the experiment, seed, tracker, all changes of parameters, and frame ${session.position}. `,
        "It gives the same numbers to everyone who can reach this server.",
      ),
      session.upload && h("p", { class: "hint" }, "The video itself stays on this server."),
      field,
      sourceCode(() => api.sourceCode([{ reference: `${session.id}:${session.branch}` }], session.computed + 1)),
      h(
        "footer",
        {},
        h("button", { type: "button", on: { click: close } }, "Close"),
        h("button", { type: "button", class: "primary", on: { click: copy } }, "Copy link"),
      ),
    ];
  }, { wide: true });
}
