/**
 * The class that follows this page, as its lecturer sees it. It belongs to the tab: the next page of the tab leads it, too.
 * What leads to the next page of a lecture takes the class along; elsewhere the lecturer decides whether it shall see that page.
 * The chip in the header, "Follow me" or how many follow, has it begin. What a class needs more (`leading.js`) is loaded for a tab
 * that leads one, or that holds a lecture.
 */

import { request, statusOf } from "../shared/api.js";
import { attempt, Icon, toast } from "../shared/dom.js";
import { socketAddress, Stream } from "../shared/stream.js";
import { after, follow as whenChanged, NewestRequest } from "../shared/timing.js";
import { classOfLink, isParticipant, keptInTab } from "../shared/visitor.js";
import { batch, computed, h, html, signal, useEffect } from "../vendor/preact.js";

/** @import { FollowOwned, FollowUpdate, OwnedNews, PollCreateRequest } from "../shared/messages.js" */

/**
 * What a page has to show to a class. Its keys keep this order, because it is compared as text.
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
/** Which class this tab leads, and which page it sees; null for the next one. */
const led = /** @type {import("../shared/visitor.js").KeptInTab<{id: string, page: string|null}>} */ (keptInTab("pftrack-class"));

/** The walk through a lecture of this tab. */
export const walkOfTab = /** @type {import("../shared/visitor.js").KeptInTab<import("./walk.js").Walk>} */ (keptInTab("pftrack-walk"));

export class ClassControl {
  /** As the server describes it; null while nobody is led from this tab. */
  follow = signal(/** @type {FollowOwned|null} */ (null));
  /** Whether the class sees this page and no other. */
  isHere = signal(false);
  /** Whether a class may be begun here: a link has the rights over one, and is worth nothing after its end. */
  mayBegin = computed(() => this.shown.value !== null && !isParticipant);
  #end;
  /** @type {Stream<OwnedNews>|null} */
  #stream = null;

  /**
   * @param {() => Shown|null} look Returns what this page has to show, by reading signals; null while unknown.
   * @param {AbortSignal} [end] The page itself, if not given.
   */
  constructor(look, end = new AbortController().signal) {
    this.#end = end;
    this.shown = computed(look);
    const teller = new NewestRequest(() => this.#compare(), {}, end);
    whenChanged(() => this.shown.value && this.isHere.value, () => teller.ask(null), end);
  }

  /** Find the class that this tab leads, if it leads one. */
  async find() {
    // On another device of the lecturer's the link itself says which one.
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
   * @param {FollowOwned} [follow] A new one if not given.
   */
  async show(follow) {
    const shown = this.shown.peek();
    if (shown === null) return;
    const taken = await attempt(() => (follow ? changed(follow.id, shown) : request("POST follows", { body: shown })));
    if (taken !== undefined) this.#lead(taken, null);
  }

  /** Have the class come along to the page that is opened next, if it sees this one. */
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

  /** Ask no more; answers that were revealed are kept, others forgotten. */
  withdraw() {
    return this.#done((follow) => request("DELETE follows/{follow}/poll", { follow }));
  }

  /** End it for all. */
  async end() {
    if (await this.#done((follow) => request("DELETE follows/{follow}", { follow }))) this.#leave();
  }

  /**
   * @param {(id: string) => Promise<unknown>} work
   * @returns {Promise<boolean>} Whether it went well.
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
   * @param {string|null} page Which page it sees; null for this one, from now on.
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

/** Have the class that this tab leads come along to the page that is opened next, whatever it sees now. */
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

/** @param {{control: ClassControl}} props The chip, and what a class or a lecture has on the page, once there is one. */
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
  if (follow === null) return ["Follow me", "Show this page to a class, which opens a short link; or add it to a lecture"];
  const { followers, title } = follow;
  if (isHere) return [following(followers), "The class sees this page"];
  return [followers === 1 ? "1 sees another page" : `${followers} see another page`, `The class sees something else: ${title}`];
}

/**
 * @param {string} follow
 * @param {FollowUpdate} body
 */
function changed(follow, body) {
  return request("PATCH follows/{follow}", { follow, body });
}

/**
 * Ask a class; a run that the answers come from is waited for.
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
