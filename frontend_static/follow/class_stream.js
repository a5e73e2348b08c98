/** What a class follows, as one of those who follow knows it. */

import { socketAddress } from "../shared/socket.js";
import { Stream } from "../shared/stream.js";
import { attempt } from "../shared/toast.js";
import { Topics } from "../shared/topics.js";
import { followed } from "../lecturer/api.js";

/** @import { FigureShown, FollowNews, FollowPublic, MinePublic } from "../shared/messages.js" */

/**
 * How it stands between this page and the class: it may be full, and it ends for good.
 *
 * @typedef {"connecting"|"open"|"lost"|"full"|"over"} State
 */

const OVER = 4404;
const FULL = 4429;

/** @extends {Topics<"follow"|"figure"|"state">} */
export class ClassStream extends Topics {
  /** @type {FollowPublic|null} */
  follow = null;
  /** @type {MinePublic} */
  mine = { fork: null, vote: null };
  /**
   * The figure of the lesson that is shown.
   *
   * @type {FigureShown|null}
   */
  figure = null;
  /** @type {State} */
  state = "connecting";
  /** Why it is full or over. */
  sentence = "";
  #stream;

  /** @param {AbortSignal} signal */
  constructor(signal) {
    super();
    this.#stream = new Stream(
      {
        message: (/** @type {FollowNews|FigureShown} */ message) => this.#receive(message),
        // A class that is full may have room by the next try.
        lost: () => this.state !== "full" && this.#become("lost"),
        closed: ({ code, reason }) => this.#sentAway(code, reason),
        gone: (error) => this.#become("over", error.message),
      },
      { address: () => socketAddress(followed.stream), look: followed.get, signal },
    );
  }

  /** The poll that is asked, if there is one. */
  get poll() {
    return this.follow?.poll ?? null;
  }

  /** Which answer was given to it, if any. */
  get answered() {
    const { vote } = this.mine;
    return vote !== null && vote.poll === this.poll?.id ? vote.answer : null;
  }

  /**
   * Answer the poll.
   *
   * @param {number} answer
   */
  async vote(answer) {
    const { poll } = this;
    if (poll === null || poll.revealed || answer >= poll.answers.length || this.state !== "open") return;
    const vote = await attempt(() => followed.vote({ poll: poll.id, answer }));
    if (vote === undefined) return;
    this.mine = { ...this.mine, vote };
    this.tell("follow");
  }

  /** @param {FollowNews|FigureShown} message */
  #receive(message) {
    if (message.type === "figure") {
      this.figure = message;
      this.tell("figure");
      return;
    }
    this.follow = message.follow;
    // What is told to all says nothing of one.
    this.mine = message.follow.mine ?? this.mine;
    if (message.type === "hello") this.#become("open");
    this.tell("follow");
  }

  /**
   * @param {number} code
   * @param {string} reason
   */
  #sentAway(code, reason) {
    if (code === FULL) this.#become("full", reason);
    if (code !== OVER) return;
    this.#stream.stop();
    this.#become("over", reason);
  }

  /**
   * @param {State} state
   * @param {string} [sentence]
   */
  #become(state, sentence = "") {
    this.state = state;
    this.sentence = sentence;
    this.tell("state");
  }
}
