/** The link of a class: short enough to be typed, as a QR code, to be copied, and large enough for the back of a room. */

import { copyButton } from "../shared/copy.js";
import { openDialog } from "../shared/dialog.js";
import { h } from "../shared/dom.js";
import { follows } from "./api.js";

/** @import { FollowOwned } from "../shared/messages.js" */

/** @param {FollowOwned} follow */
export function linkPart(follow) {
  const [{ address }, ...others] = follow.links;
  const enlarge = { click: () => large(follow) };
  return h(
    "section",
    { class: "class-link", "aria-label": "The link" },
    h("button", { type: "button", class: "class-qr", title: "Show enlarged", on: enlarge }, code(follow)),
    h(
      "div",
      { class: "class-address" },
      h("output", { "aria-label": "Link", data: { role: "class-link" } }, inParts(address)),
      h(
        "div",
        { class: "poll-line" },
        copyButton("Copy the link", address, "of the class"),
        h("button", { type: "button", on: enlarge }, "Show enlarged"),
      ),
      follow.notice && h("p", { class: "note", data: { role: "reach" } }, withCode(follow.notice)),
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
  openDialog(follow.title, () => [h("div", { class: "class-large" }, code(follow), h("p", {}, inParts(follow.links[0].address)))]).classList.add("large");
}

/**
 * A sentence in which what is to be typed stands between backquotes.
 *
 * @param {string} sentence
 */
function withCode(sentence) {
  return sentence.split("`").map((text, place) => (place % 2 === 0 ? text : h("code", {}, text)));
}

/**
 * An address as it is read and typed: without what all begin with, and broken nowhere but before the name of the class.
 *
 * @param {string} address
 */
function inParts(address) {
  const { host, pathname } = new URL(address);
  return [host, pathname].map((text) => h("span", {}, text));
}
