/**
 * The class that follows this page, as its lecturer sees it. It belongs to the tab: the next page of the tab leads it, too.
 * The lecture's Next takes the class along; elsewhere the lecturer decides whether the class sees the new page. The chip in the header,
 "Follow me" or the number of followers, starts a class. The rest of the code (`leading.js`) is loaded only in a tab that leads a class or
 presents a lecture. */

import { request, statusOf } from "../shared/api.js";
import { attempt, Icon, toast } from "../shared/dom.js";
import { socketAddress, Stream } from "../shared/stream.js";
import { after, follow as whenChanged, NewestRequest } from "../shared/timing.js";
import { classOfLink, isParticipant, keptInTab } from "../shared/visitor.js";
import { batch, computed, h, html, signal, useEffect } from "../vendor/preact.js";

/** @import { FollowOwned, FollowUpdate, OwnedNews, PollCreateRequest } from "../shared/messages.js" */

/** A page's content for a class. Its keys keep this order, because it is compared as text.
 *
 * @typedef {object} Shown
 * @property {string} title
 * @property {string[]} sessions
 * @property {string|null} lesson
 * @property {Record<string, unknown>} arrangement
 */

const NOT_FOUND = 404;
const GONE = 410;
const AGAIN_MS = 300;
/** The class that this tab leads, and the page that the class sees; null for the next one. */
const led = /** @type {import("../shared/visitor.js").KeptInTab<{id: string, page: string|null}>} */ (keptInTab("pftrack-class"));

/** This tab's walk through a lecture. */
export const walkOfTab = /** @type {import("../shared/visitor.js").KeptInTab<import("./walk.js").Walk>} */ (keptInTab("pftrack-walk"));

export class ClassControl {
  /** The class as the server describes it; null while this tab leads none. */
  follow = signal(/** @type {FollowOwned|null} */ (null));
  /** Whether the class sees this page. */
  isHere = signal(false);
  /** Whether a class may be started here; not with an owner's link, which gives rights over one class only. */
  mayBegin = computed(() => this.shown.value !== null && !isParticipant);
  #end;
  /** @type {Stream<OwnedNews>|null} */
  #stream = null;

  /**
   * @param {() => Shown|null} look Returns this page's content by reading signals; null while unknown.
   * @param {AbortSignal} [end] Signal of the end; by default that of the page.
   */
  constructor(look, end = new AbortController().signal) {
    this.#end = end;
    this.shown = computed(look);
    const teller = new NewestRequest(() => this.#compare(), {}, end);
    whenChanged(() => this.shown.value && this.isHere.value, () => teller.ask(null), end);
  }

  /** Find the class that this tab leads, if it leads one. */
  async find() {
    // On another device of the lecturer, the link itself names the class.
    const known = classOfLink === null ? led.get() : { id: classOfLink, page: location.pathname };
    try {
      const follow = known && (await request("GET follows/{follow}", { follow: known.id }));
      if (follow !== null && !this.#end.aborted) this.#lead(follow, known?.page ?? null);
    } catch (error) {
      if ([NOT_FOUND, GONE].includes(statusOf(error) ?? 0)) led.set(null);
    }
  }

  /**
   * Show this page to a class.
   *
   * @param {FollowOwned} [follow] A new class if not given.
   */
  async show(follow) {
    const shown = this.shown.peek();
    if (shown === null) return;
    const taken = await attempt(() => (follow ? changed(follow.id, shown) : request("POST follows", { body: shown })));
    if (taken !== undefined) this.#lead(taken, null);
  }

  /** Take the class along to the next page, if it sees this one. */
  takeAlong() {
    if (this.isHere.value) takeClassAlong();
  }

  /** @param {FollowUpdate} update */
  change(update) {
    return this.#done((id) => changed(id, update));
  }

  /**
   * Ask the class.
   *
   * @param {PollCreateRequest} poll
   */
  ask(poll) {
    return this.#done((id) => asked(id, poll, this.#end));
  }

  /** Show the answers to all. */
  reveal() {
    return this.#done((follow) => request("POST follows/{follow}/poll/reveal", { follow }));
  }

  /** Close the poll; revealed answers are kept, others deleted. */
  withdraw() {
    return this.#done((follow) => request("DELETE follows/{follow}/poll", { follow }));
  }

  /** End the class for everybody. */
  async end() {
    if (await this.#done((follow) => request("DELETE follows/{follow}", { follow }))) this.#leave();
  }

  /**
   * @param {(id: string) => Promise<unknown>} work
   * @returns {Promise<boolean>} Whether the request succeeded.
   */
  async #done(work) {
    const follow = this.follow.peek();
    return follow !== null && (await attempt(() => work(follow.id))) !== undefined;
  }

  async #compare() {
    const [shown, follow] = [this.shown.peek(), this.follow.peek()];
    if (!this.isHere.peek() || follow === null || shown === null || isSame(follow, shown)) return;
    const taken = await attempt(() => changed(follow.id, shown));
    if (taken !== undefined && this.follow.value?.id === taken.id) this.follow.value = taken;
  }

  /**
   * @param {FollowOwned} follow
   * @param {string|null} page The page that it sees; null for this one.
   */
  #lead(follow, page) {
    if (page === null) led.set({ id: follow.id, page: location.pathname });
    if (this.follow.value?.id !== follow.id) this.#listen(follow.id);
    batch(() => {
      this.follow.value = follow;
      this.isHere.value = page === null || page === location.pathname;
    });
  }

  /** @param {string} id */
  #listen(id) {
    this.#stream?.stop();
    this.#stream = new Stream(
      {
        message: ({ follow }) => (this.follow.value = follow),
        lost: () => {},
        gone: () => {
          toast("The class has ended");
          this.#leave();
        },
      },
      {
        address: () => socketAddress("WS follows/{follow}/stream", { follow: id }),
        look: () => request("GET follows/{follow}", { follow: id }),
        signal: this.#end,
      },
    );
  }

  #leave() {
    this.#stream?.stop();
    this.#stream = null;
    led.set(null);
    batch(() => {
      this.follow.value = null;
      this.isHere.value = false;
    });
  }
}

/**
 * @param {FollowOwned} follow
 * @param {Shown} shown
 */
function isSame({ title, sessions, lesson, arrangement }, shown) {
  return JSON.stringify(shown) === JSON.stringify({ title, sessions: sessions.map(({ id }) => id), lesson, arrangement });
}

/** Take the class of this tab along to the next page, whatever it sees now. */
export function takeClassAlong() {
  const known = led.get();
  if (known !== null) led.set({ ...known, page: null });
}

/**
 * "1 follows", "23 follow".
 *
 * @param {number} followers
 */
export function following(followers) {
  return followers === 1 ? "1 follows" : `${followers} follow`;
}

/** @param {{control: ClassControl}} props The chip, and the page's parts of a class or a lecture, if there is one. */
export function FollowChip({ control }) {
  const isLed = control.follow.value !== null || (!isParticipant && walkOfTab.get()?.ended === null);
  useEffect(() => {
    const end = new AbortController();
    const begin = async () => {
      const { lead } = await import("./leading.js");
      if (!end.signal.aborted) lead(control, end.signal);
    };
    if (isLed) attempt(begin);
    return () => end.abort();
  }, [isLed]);
  const [follow, isHere] = [control.follow.value, control.isHere.value];
  const [words, title] = wordsOf(follow, isHere);
  const open = () => attempt(async () => (await import("./leading.js")).openClassDialog(control));
  return html`<button
    type="button" class="follow-chip" aria-haspopup="dialog" title=${title} disabled=${follow === null && !control.mayBegin.value}
    data-leads=${follow !== null || null} data-elsewhere=${(follow !== null && !isHere) || null} onClick=${open}
  >
    ${h(Icon, { name: "class" })}<span class=${follow === null ? "wide-only" : ""}>${words}</span>
  </button>`;
}

/**
 * @param {FollowOwned|null} follow
 * @param {boolean} isHere
 */
function wordsOf(follow, isHere) {
  if (follow === null) return ["Follow me", "Show this page to a class by a short link, or add it to a lecture"];
  const { followers, title } = follow;
  if (isHere) return [following(followers), "The class sees this page"];
  return [followers === 1 ? "1 sees another page" : `${followers} see another page`, `The class sees another page: ${title}`];
}

/**
 * @param {string} follow
 * @param {FollowUpdate} body
 */
function changed(follow, body) {
  return request("PATCH follows/{follow}", { follow, body });
}

/** Ask a class a question; wait for the run behind its answers, if there is one.
 *
 * @param {string} follow
 * @param {PollCreateRequest} body
 * @param {AbortSignal} end
 */
async function asked(follow, body, end) {
  for (;;) {
    const said = await request("PUT follows/{follow}/poll", { follow, body });
    if (!("total" in said)) return said;
    await after(AGAIN_MS, end);
  }
}
