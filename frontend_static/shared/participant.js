/** Who opened this page by the link of a class: a follower, or the lecturer on another device. */

import { START } from "./address.js";
import { h } from "./dom.js";

const { role = "", class: name = null } = globalThis.document?.documentElement.dataset ?? {};

/** Whether the page is open to a participant of a class, who may see nothing else of the server. */
export const isParticipant = role !== "";

/** Whether that is one who follows, and tries something alone. */
export const isFollower = role === "follower";

/** The class of the link, if the page was opened by one. */
export const classOfLink = name;

/** The first thing in the header: the way to the start page, for followers the way back to the class. */
export function brand() {
  if (isFollower) return h("a", { class: "button", href: START, data: { role: "back" } }, "Back to the class");
  return isParticipant ? h("span", { class: "brand" }, "pftrack") : h("a", { class: "brand", href: START }, "pftrack");
}
