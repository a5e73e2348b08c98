/**
 * The class that follows this page, as its lecturer sees it. It belongs to the tab: whoever goes on to another page leads
 * there, too. What leads to the next page of a lecture takes the class along; elsewhere the lecturer decides whether it
 * shall see that page.
 */

import { statusOf } from "../shared/api.js";
import { NewestRequest } from "../shared/newest_request.js";
import { classOfLink, isParticipant } from "../shared/participant.js";
import { socketAddress } from "../shared/socket.js";
import { Stream } from "../shared/stream.js";
import { attempt, toast } from "../shared/toast.js";
import { Topics } from "../shared/topics.js";
import { follows } from "./api.js";

/** @import { FollowOwned, FollowUpdate, PollCreateRequest, OwnedNews } from "../shared/messages.js" */

/**
 * What a page has to show to a class.
 *
 * @typedef {object} Shown
 * @property {string} title
 * @property {string[]} sessions
 * @property {string|null} lesson
 * @property {Record<string, unknown>} [arrangement]
 */

const KEY = "pftrack-class";
const NOT_FOUND = 404;
const GONE = 410;

/** @extends {Topics<"follow">} */
export class ClassControl extends Topics {
  /**
   * As the server describes it; null while nobody is led from this tab.
   *
   * @type {FollowOwned|null}
   */
  follow = null;
  /** Whether the class sees this page and no other. */
  isHere = false;
  #shown;
  #signal;
  #tellClass;
  /** @type {Stream<OwnedNews>|null} */
  #stream = null;

  /**
   * @param {() => Shown|null} shown What this page has to show; null as long as that is not known.
   * @param {AbortSignal} signal
   */
  constructor(shown, signal) {
    super();
    this.#shown = shown;
    this.#signal = signal;
    this.#tellClass = new NewestRequest(() => this.#compared(), {}, signal);
  }

  /** Whether there is something to be shown. */
  get isReady() {
    return this.#shown() !== null;
  }

  /** Whether a class may be begun here: a link has the rights over one, and is worth nothing after its end. */
  get mayBegin() {
    return this.isReady && !isParticipant;
  }

  /** Find the class that this tab leads, if it leads one. */
  async find() {
    // On another device of the lecturer's the link itself says which one.
    const known = classOfLink === null ? remembered() : { id: classOfLink, page: location.pathname };
    try {
      const follow = known && (await follows.get(known.id));
      if (follow === null || this.#signal.aborted) return;
      if (known?.page === null) this.#take(follow);
      else {
        this.isHere = known?.page === location.pathname;
        this.#lead(follow);
      }
    } catch (error) {
      if ([NOT_FOUND, GONE].includes(statusOf(error) ?? 0)) remember(null);
    } finally {
      this.update();
    }
  }

  /**
   * Begin a class.
   *
   * @param {number} mostFollowers
   */
  async begin(mostFollowers) {
    const shown = this.#shown();
    if (shown === null) return;
    const follow = await attempt(() => follows.begin({ ...shown, most_followers: mostFollowers }));
    if (follow !== undefined) this.#take(follow);
  }

  /**
   * Show this page to a class.
   *
   * @param {FollowOwned} follow
   */
  async show(follow) {
    const shown = this.#shown();
    if (shown === null) return;
    const changed = await attempt(() => follows.change(follow.id, whole(shown)));
    if (changed !== undefined) this.#take(changed);
  }

  /** Which lesson the page shows, if it shows one. */
  get lesson() {
    return this.#shown()?.lesson ?? null;
  }

  /** Have the class come along to the page that is opened next, if it sees this one. */
  takeAlong() {
    if (this.isHere && this.follow !== null) remember(this.follow.id, null);
  }

  /** Take note that this page shows something else by now, and tell the class, if it sees this page. */
  update() {
    this.tell("follow");
    this.#tellClass.ask(null);
  }

  /** @param {FollowUpdate} update */
  change(update) {
    return this.#done((id) => follows.change(id, update));
  }

  /**
   * Ask the class.
   *
   * @param {PollCreateRequest} poll
   * @returns {Promise<boolean>} Whether it is asked.
   */
  ask(poll) {
    return this.#done((id) => follows.ask(id, poll, this.#signal));
  }

  /** Show the answers to all. */
  reveal() {
    return this.#done((id) => follows.reveal(id));
  }

  /** Ask no more; answers that were revealed are kept, others forgotten. */
  withdraw() {
    return this.#done((id) => follows.withdraw(id));
  }

  /** End it for all. */
  async end() {
    if (await this.#done((id) => follows.end(id))) this.#left();
  }

  /**
   * @param {(id: string) => Promise<unknown>} work
   * @returns {Promise<boolean>} Whether it went well.
   */
  async #done(work) {
    const { follow } = this;
    return follow !== null && (await attempt(() => work(follow.id))) !== undefined;
  }

  async #compared() {
    const shown = this.#shown();
    const { follow } = this;
    if (!this.isHere || follow === null || shown === null || isSame(follow, shown)) return;
    const changed = await attempt(() => follows.change(follow.id, whole(shown)));
    if (changed !== undefined && this.follow?.id === changed.id) this.follow = changed;
  }

  /** @param {FollowOwned} follow */
  #take(follow) {
    this.isHere = true;
    remember(follow.id);
    this.#lead(follow);
  }

  /** @param {FollowOwned} follow */
  #lead(follow) {
    const isNew = this.follow?.id !== follow.id;
    this.follow = follow;
    if (isNew) this.#listen(follow.id);
    this.tell("follow");
  }

  /** @param {string} id */
  #listen(id) {
    this.#stream?.stop();
    this.#stream = new Stream(
      {
        message: ({ follow }) => {
          this.follow = follow;
          this.tell("follow");
        },
        lost: () => {},
        gone: () => {
          toast("The class has ended");
          this.#left();
        },
      },
      { address: () => socketAddress(follows.stream(id)), look: () => follows.get(id), signal: this.#signal },
    );
  }

  #left() {
    this.#stream?.stop();
    this.#stream = null;
    remember(null);
    this.follow = null;
    this.isHere = false;
    this.tell("follow");
  }
}

/**
 * What replaces all that a class saw before.
 *
 * @param {Shown} shown
 * @returns {FollowUpdate}
 */
function whole({ title, sessions, lesson, arrangement = {} }) {
  return { title, sessions, lesson, arrangement };
}

/**
 * @param {FollowOwned} follow
 * @param {Shown} shown
 */
function isSame({ title, sessions, lesson, arrangement }, shown) {
  return JSON.stringify(whole(shown)) === JSON.stringify({ title, sessions: sessions.map(({ id }) => id), lesson, arrangement });
}

/** Have the class that this tab leads come along to the page that is opened next, whatever it sees now. */
export function takeClassAlong() {
  const known = remembered();
  if (known !== null) remember(known.id, null);
}

/** @returns {{id: string, page: string|null}|null} Which class this tab leads, and which page it sees; null for the next one. */
function remembered() {
  try {
    return JSON.parse(sessionStorage.getItem(KEY) ?? "null");
  } catch {
    return null;
  }
}

/**
 * @param {string|null} id
 * @param {string|null} page
 */
function remember(id, page = location.pathname) {
  try {
    if (id === null) sessionStorage.removeItem(KEY);
    else sessionStorage.setItem(KEY, JSON.stringify({ id, page }));
  } catch {
    // Without storage it is led from this page alone.
  }
}
