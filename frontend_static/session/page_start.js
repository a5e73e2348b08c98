/** The first script of a session's page: it finds or starts the session and shows its picture while the rest of the page is still loading.
 */

import { lastOfAddress, part } from "../shared/dom.js";
import { decode } from "../shared/share_link.js";
import { SessionStart } from "./session_start.js";

const NEW = "new";
const id = lastOfAddress();

export const start = new SessionStart(part("session"), id === NEW ? { recipe: readRecipe() } : { session: id });
if (id === NEW) start.begun.then(({ session }) => history.replaceState(null, "", session.page + location.search), () => {});

/** @returns {Promise<import("../shared/share_link.js").NewSession>} */
async function readRecipe() {
  try {
    return decode(location.hash);
  } catch {
    throw new Error("The link is incomplete; it must hold an experiment after the # sign");
  }
}
