/**
 * The stream of a session: what it tells comes into the store, and what is seen of it into the flat view, in one order.
 *
 * The head of a drawing holds all messages up to it. The page applies them when it can paint the drawing's pictures, and
 * later messages wait until then: so all numbers beside a picture belong to that picture. The page reports what it has
 * painted, because the server sends the newest drawing when the last but one is painted. Beside a 3-D scene messages wait
 * until the scene shows their frame.
 */

import { api } from "../shared/api.js";
import { socketAddress } from "../shared/socket.js";
import { Stream } from "../shared/stream.js";

/** @import { SessionMessage } from "../shared/messages.js" */
/** @import { Listener } from "../shared/stream.js" */

export class SessionStream {
  #store;
  #scene;
  #signal;
  #stream;
  /** Of one connection: how many drawings came, and how many of them were painted. */
  #known = { came: 0, painted: 0 };
  /** Settled when all that came has been taken over. */
  #line = Promise.resolve();

  /**
   * @param {string} id The session.
   * @param {import("./store.js").Store} store
   * @param {import("./scene.js").Scene|null} scene
   * @param {Pick<Listener<SessionMessage>, "lost"|"gone">} on
   * @param {AbortSignal} signal
   */
  constructor(id, store, scene, on, signal) {
    this.#store = store;
    this.#scene = scene;
    this.#signal = signal;
    const hears = {
      opened: () => (this.#known = { came: 0, painted: 0 }),
      message: (/** @type {SessionMessage} */ message) => this.#take(this.#seen(message)),
      drawing: (/** @type {ArrayBuffer} */ data) => this.#receive(data),
      ...on,
    };
    /** @type {Stream<SessionMessage>} */
    this.#stream = new Stream(hears, { address: () => this.#address(id), look: () => api.session(id), signal });
    scene?.onView(() => this.#stream.again());
  }

  /** @param {string} id */
  #address(id) {
    const path = socketAddress(`sessions/${encodeURIComponent(id)}/stream`);
    const flat = this.#scene?.flat ?? null;
    return flat === null ? path : `${path}?paints=true&has_picture=${flat.hasPicture}`;
  }

  /**
   * What is told without a drawing waits for the scene that has one of its own.
   *
   * @param {SessionMessage} message
   */
  async #seen(message) {
    await this.#scene?.comesTo("session" in message ? message.session.position : undefined);
    return { messages: [message] };
  }

  /** @param {ArrayBuffer} data */
  #receive(data) {
    const known = this.#known;
    known.came += 1;
    const count = known.came;
    const painted = () => {
      if (known !== this.#known || count <= known.painted) return;
      known.painted = count;
      this.#stream.send({ type: "painted", count });
    };
    const prepared = this.#scene?.flat?.prepare(data, painted);
    if (prepared !== undefined) this.#take(prepared);
  }

  /**
   * Take something over when it is ready, and all before it has been taken over.
   *
   * @param {Promise<{messages: SessionMessage[], show?: () => void}>} prepared
   */
  #take(prepared) {
    const known = this.#known;
    const take = async () => {
      const { messages, show } = await prepared;
      if (known !== this.#known || this.#signal.aborted) return;
      for (const message of messages) this.#store.receive(message);
      show?.();
    };
    this.#line = this.#line.then(take).catch((error) => globalThis.reportError(error));
  }
}
