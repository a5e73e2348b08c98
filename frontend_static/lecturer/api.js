/** Classes, their polls, and lectures in the server's REST interface: what a lecturer does, and what a follower does. */

import { api, pathOf, query, request, ROOT, START } from "../shared/api.js";
import { savedOf, wantedOf } from "../shared/comparison.js";
import { attempt } from "../shared/dom.js";
import { decode } from "../shared/share_link.js";
import { after } from "../shared/timing.js";

/** @import * as Messages from "../shared/messages.js" */
/** @import { SessionPublic } from "../shared/messages.js" */

// What can be an item of a lecture: what a link of this site shows.

/** @typedef {Record<string, unknown>} Item As a lecture's file has it. */
/** @typedef {{item: Item}|{session: string}|{saved: string}} Linked What is linked; a session or saved comparison of this server by its id. */

/**
 * What makes a session again, up to the frame that is shown.
 *
 * @param {SessionPublic} session
 * @returns {Item}
 */
export function itemOfSession({ recipe, upload, position, name }) {
  return { session: { recipe, upload, position }, title: name };
}

/**
 * The item that a link is, once this server has told what it does not hold itself.
 *
 * @param {string} text
 * @returns {Promise<Item>}
 */
export async function itemOfAddress(text) {
  const found = itemOfLink(text, document.baseURI);
  if ("item" in found) return found.item;
  if ("session" in found) return itemOfSession(await api.session(found.session));
  const { runs, position, arrangement, title } = await api.savedComparison(found.saved);
  return { comparison: { runs, position, arrangement }, title };
}

/**
 * @param {string} text
 * @param {string} base Address of the server.
 * @returns {Linked}
 * @throws {Error} A sentence: a lecture cannot show what the link leads to.
 */
export function itemOfLink(text, base) {
  const { pathname, search, hash } = parsed(text, base);
  const [kind, name = ""] = pathname.split("/").slice(-2);
  if (name === "compare") {
    const saved = savedOf({ search, hash });
    if (saved !== null) return { saved };
    const wanted = wantedOf({ search, hash });
    if (wanted !== null) return { item: { comparison: wanted } };
  }
  if (kind === "session" && name === "new" && hash.length > 1) return { item: { session: sessionOf(hash) } };
  if (kind === "session" && name !== "new" && name !== "") return { session: decodeURIComponent(name) };
  if (kind === "learn" && name !== "") return { item: { lesson: decodeURIComponent(name) } };
  if (kind === "failures" && name !== "") return { item: { failure: decodeURIComponent(name) } };
  throw new Error("This link leads to something that a lecture cannot show. Copy the link of a lesson, a failure, a session or a comparison.");
}

/** @param {string} hash */
function sessionOf(hash) {
  try {
    const { recipe, upload, position } = decode(hash);
    return { recipe, ...(upload && { upload }), ...(position && { position }) };
  } catch {
    throw new Error("The link is damaged: a part of it is missing after the # sign, or was changed. Copy the whole link again.");
  }
}

/**
 * @param {string} text
 * @param {string} base
 */
function parsed(text, base) {
  try {
    return new URL(text.trim(), base);
  } catch {
    throw new Error("This is not a link.");
  }
}

const one = pathOf("follows");
const lecture = pathOf("lectures");
const AGAIN_MS = 300;

/** With the lecturer's rights. */
export const follows = {
  /** @returns {Promise<Messages.FollowOwned[]>} */
  all: () => request("GET", "follows"),

  /** @type {(id: string) => Promise<Messages.FollowOwned>} */
  get: (id) => request("GET", one(id)),

  /** @type {(body: Messages.FollowCreate) => Promise<Messages.FollowOwned>} */
  begin: (body) => request("POST", "follows", body),

  /** @type {(id: string, body: Messages.FollowUpdate) => Promise<Messages.FollowOwned>} */
  change: (id, body) => request("PATCH", one(id), body),

  /** @type {(id: string) => Promise<null>} */
  end: (id) => request("DELETE", one(id)),

  /**
   * A run that the answers come from is waited for.
   *
   * @type {(id: string, body: Messages.PollCreateRequest, signal: AbortSignal) => Promise<Messages.FollowOwned>}
   */
  async ask(id, body, signal) {
    for (;;) {
      /** @type {Messages.FollowOwned|Messages.ComputingPublic} */
      const said = await request("PUT", one(id, "poll"), body);
      if (!("total" in said)) return said;
      await after(AGAIN_MS, signal);
    }
  },

  /** @type {(id: string) => Promise<unknown>} */
  reveal: (id) => request("POST", one(id, "poll/reveal")),

  /** @type {(id: string) => Promise<null>} */
  withdraw: (id) => request("DELETE", one(id, "poll")),

  /** @type {(id: string, wanted: Messages.FigureRequest, signal?: AbortSignal) => Promise<Messages.FigurePublic>} */
  figure: (id, wanted, signal) => request("POST", one(id, "figure"), wanted, signal),

  /** Where the QR code of one of its links is. */
  qrAddress: (/** @type {string} */ id, link = 0) => `${ROOT}${one(id, `qr.svg?link=${link}`)}`,

  stream: (/** @type {string} */ id) => one(id, "stream"),
};

/** With the rights of somebody who follows: the page's address says whom. */
export const followed = {
  /** @returns {Promise<Messages.FollowPublic>} */
  get: () => request("GET", "follow"),

  /** @type {(body: Messages.Vote) => Promise<Messages.Vote>} */
  vote: (body) => request("PUT", "follow/vote", body),

  /** @type {(body: Messages.ForkCreate) => Promise<Messages.ForkPublic>} */
  fork: (body) => request("POST", "follow/fork", body),

  /** @returns {Promise<null>} */
  giveBack: () => request("DELETE", "follow/fork"),

  stream: "follow/stream",
};

export const END_FORK = "End your copy and free its place";

/** End what a follower tries alone, and go back to the class. */
export async function endFork() {
  if ((await attempt(followed.giveBack)) !== undefined) location.assign(START);
}

/** What classes have answered. */
export const polls = {
  /** @type {(id?: string) => Promise<Messages.PollKept[]>} Of one lecture, or all */
  all: (id) => request("GET", `polls${of(id)}`),

  /** @type {(id: string) => Promise<null>} */
  remove: (id) => request("DELETE", pathOf("polls")(id)),

  /** Where they are as a table. */
  csvAddress: (/** @type {string} */ id = "") => `${ROOT}polls/answers.csv${of(id)}`,
};

export const lectures = {
  /** @returns {Promise<Messages.LectureSummary[]>} */
  all: () => request("GET", "lectures"),

  /** @type {(id: string) => Promise<Messages.LecturePublic>} */
  get: (id) => request("GET", lecture(id)),

  /** @type {(body: Messages.LectureUpdate) => Promise<Messages.LecturePublic>} */
  add: (body) => request("POST", "lectures", body),

  /** @type {(id: string, body: Messages.LectureUpdate) => Promise<Messages.LecturePublic>} */
  change: (id, body) => request("PUT", lecture(id), body),

  /** @type {(id: string) => Promise<null>} */
  remove: (id) => request("DELETE", lecture(id)),

  /** @type {(file: Blob) => Promise<Messages.LecturePublic>} */
  bringIn: (file) => request("POST", "lectures/import", new Blob([file], { type: "text/markdown" })),

  fileAddress: (/** @type {string} */ id) => `${ROOT}${lecture(id, "file")}`,
};

/** @param {string} [id] Of a lecture. */
function of(id) {
  return id ? `?${query({ lecture: id })}` : "";
}
