/** The link of a class: short enough to be typed, as a QR code, to be copied, and large enough for the back of a room. */

import { copyButton } from "../../shared/copy.js";
import { openDialog } from "../../shared/dialog.js";
import { h } from "../../shared/dom.js";
import { follows } from "../api.js";

/** @import { FollowOwned } from "../../shared/messages.js" */

/** @param {FollowOwned} follow */
export function linkPart(follow) {
  const [{ address }, ...others] = follow.links;
  const enlarge = { click: () => large(follow) };
  return h(
    "section",
    { class: "class-link", "aria-label": "The link" },
    h("button", { type: "button", class: "class-qr", title: "Show it large", on: enlarge }, code(follow)),
    h(
      "div",
      { class: "class-address" },
      h("output", { "aria-label": "Link", data: { role: "class-link" } }, address),
      h(
        "div",
        { class: "poll-line" },
        copyButton("Copy the link", address, "of the class"),
        h("button", { type: "button", on: enlarge }, "Show it large"),
      ),
      follow.notice && h("p", { class: "note", data: { role: "reach" } }, follow.notice),
      others.length > 0 && h("details", {}, h("summary", {}, "Other addresses"), h("ul", {}, others.map((other) => h("li", {}, other.address)))),
    ),
  );
}

/** @param {FollowOwned} follow */
function code({ id, links: [{ address }] }) {
  return h("img", { src: follows.qrAddress(id), alt: `QR code of ${address}`, width: 200, height: 200 });
}

/** @param {FollowOwned} follow */
function large(follow) {
  const [{ address }] = follow.links;
  // Without what every address begins with it is read and typed more easily.
  const short = address.replace(/^https?:\/\//, "");
  openDialog(follow.title, () => [h("div", { class: "class-large" }, code(follow), h("p", {}, short))]).classList.add("large");
}
