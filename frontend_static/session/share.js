/**
 * Links that hold a whole run: experiment, seed, tracker and timeline travel in the fragment, which no server logs. Who
 * opens one gets the same numbers.
 */

import { api } from "../shared/api.js";
import { linkTo } from "../shared/share_link.js";
import { openCode } from "../shared/source_code.js";

/** @import { SessionPublic } from "../shared/messages.js" */

/**
 * Show the link of a session, ready to be copied.
 *
 * @param {SessionPublic} session
 */
export function shareDialog({ id, branch, recipe, computed, position, upload }) {
  const words = [
    `The link holds the experiment, seed, tracker, all changes of parameters, and frame ${position}. ` +
      "It gives the same numbers to everyone who can reach this server.",
    upload ? "The video itself stays on this server." : "",
  ];
  openCode("Share this run", words, () => api.sourceCode([{ reference: `${id}:${branch}` }], computed + 1), linkTo({ recipe, upload, position }));
}
