/** Short messages at the lower edge. News goes away by itself; what went wrong stays until it is read. */

import { messageOf } from "./api.js";
import { fill, h } from "./dom.js";
import { icon } from "./icons.js";

const NEWS_MS = 5000;

/** Where they lie one above the other: within a dialog, where one is open, since all else is dim and out of reach then. */
function stackOfPage() {
  const stack = document.querySelector(".toasts") ?? h("div", { class: "toasts", role: "status", "aria-live": "polite" });
  const place = document.querySelector("dialog[open]") ?? document.body;
  if (stack.parentElement !== place) place.append(stack);
  return stack;
}

/**
 * @param {string} message
 * @param {{kind?: "news"|"error", action?: {label: string, href?: string, run?: () => void}}} [options]
 */
export function toast(message, { kind = "news", action } = {}) {
  const stack = stackOfPage();
  for (const shown of stack.querySelectorAll(".toast")) if (shown instanceof HTMLElement && shown.dataset.message === message) shown.remove();
  const element = h("div", { class: `toast ${kind}`, role: kind === "error" ? "alert" : null });
  element.dataset.message = message;
  const close = () => element.remove();
  const run = () => {
    close();
    action?.run?.();
  };
  fill(
    element,
    h("span", { class: "toast-text" }, message),
    action?.href && h("a", { class: "button quiet", href: action.href, on: { click: close } }, action.label),
    action?.run && h("button", { class: "quiet", type: "button", on: { click: run } }, action.label),
    h("button", { class: "quiet icon-only", type: "button", "aria-label": "Close this message", on: { click: close } }, icon("close")),
  );
  stack.append(element);
  while (stack.children.length > 3) stack.firstElementChild?.remove();
  if (kind === "news") setTimeout(close, NEWS_MS);
}

/**
 * Run something that talks to the server; an error is shown once, here.
 *
 * @template T
 * @param {() => Promise<T>} work
 * @returns {Promise<T|undefined>}
 */
export async function attempt(work) {
  try {
    return await work();
  } catch (error) {
    toast(messageOf(error), { kind: "error" });
    return undefined;
  }
}
