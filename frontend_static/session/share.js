/**
 * Links that hold a whole run: experiment, seed, tracker and timeline travel in the fragment, which no server logs. Who
 * opens one gets the same numbers.
 */

import { api } from "../shared/api.js";
import { linkTo } from "../shared/share_link.js";
import { openCode } from "../shared/source_code.js";

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
  const { id, branch, computed, position, upload } = session;
  const words = [
    `The link holds the experiment, seed, tracker, all changes of parameters, and frame ${position}. ` +
      "It gives the same numbers to everyone who can reach this server.",
    upload ? "The video itself stays on this server." : "",
  ];
  openCode("Share this run", words, () => api.sourceCode([{ reference: `${id}:${branch}` }], computed + 1), linkTo(bodyOf(session)));
}
