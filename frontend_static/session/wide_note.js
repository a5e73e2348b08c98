/** The line that says of a narrow screen that a wider one shows more: whoever has put it away does not see it again. */

import { iconButton } from "../shared/icons.js";

const KEY = "pftrack-wide-note";

/** @param {HTMLElement} element */
export function wideNote(element) {
  element.hidden = isAway();
  element.append(
    iconButton("close", "Put away", () => {
      element.hidden = true;
      remember();
    }),
  );
}

function isAway() {
  try {
    return localStorage.getItem(KEY) !== null;
  } catch {
    return false; // a browser may be told to keep nothing
  }
}

function remember() {
  try {
    localStorage.setItem(KEY, "away");
  } catch {
    // It is away until the page is left.
  }
}
