/**
 * What the panel proposes: the newest value of each parameter, one request at a time. Until the last of them has been
 * answered and the session's own word has come, what is proposed is not torn out of the hand.
 */

import { api } from "../shared/api.js";
import { attempt } from "../shared/dom.js";
import { later, NewestRequest } from "../shared/timing.js";
import { signal } from "../vendor/preact.js";

/** @import { Value } from "../shared/format.js" */

/** The session's word comes by the stream, mostly before the answer to the request, sometimes a little after it. */
const REST_MS = 300;


/** @typedef {Record<string, Value>} Values By the names of the parameters. */

/**
 * Change values of a session; a seed among them starts the run again.
 *
 * @param {string} id
 * @param {Values} values
 * @returns {Promise<boolean>} Whether they were accepted.
 */
export async function sendValues(id, { seed, ...values }) {
  const accepted = await attempt(async () => {
    if (Object.keys(values).length > 0) await api.command(id, { kind: "change", values });
    if (seed !== undefined) await api.command(id, { kind: "restart", seed: Number(seed) });
    return true;
  });
  return accepted === true;
}

export class Proposals {
  /** @type {NewestRequest<Values, boolean>} */
  #requests;
  #end;
  #held = signal(/** @type {Values} */ ({}));
  #stopRest = () => {};

  /**
   * @param {(values: Values) => Promise<boolean>} send Tells whether the values were accepted.
   * @param {AbortSignal} end
   */
  constructor(send, end) {
    const join = (/** @type {Values} */ waiting, /** @type {Values} */ newer) => ({ ...waiting, ...newer });
    this.#requests = new NewestRequest(send, { answer: (isAccepted, _, isNewest) => isNewest && this.#rest(isAccepted), join }, end);
    this.#end = end;
  }

  /** What is proposed and not yet answered; components that read it follow it. */
  get held() {
    return this.#held.value;
  }

  /**
   * Whether a value of this parameter is on its way.
   *
   * @param {string} name
   */
  holds(name) {
    return name in this.held;
  }

  /**
   * @param {string} name
   * @param {Value} value
   */
  propose(name, value) {
    this.#held.value = { ...this.#held.peek(), [name]: value };
    this.#stopRest();
    this.#requests.ask({ [name]: value });
  }

  /** @param {boolean} isAccepted What is refused is let go at once. */
  #rest(isAccepted) {
    const settle = () => (this.#held.value = {});
    if (isAccepted) this.#stopRest = later(settle, REST_MS, this.#end);
    else settle();
  }
}
