/** Classes, their polls, and lectures in the server's REST interface: what a lecturer does, and what a follower does. */

import { pathOf, query, request, ROOT, START } from "../shared/api.js";
import { attempt } from "../shared/dom.js";
import { after } from "../shared/timing.js";

/** @import * as Messages from "../shared/messages.js" */

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
