/** A class that follows, in the server's REST interface: what a lecturer does with it, and what somebody who follows. */

import { ROOT, pathOf, request } from "../shared/api.js";

/** @import * as Messages from "../shared/messages.js" */

const one = pathOf("follows");

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

  /** @type {(id: string, body: Messages.PollCreate) => Promise<unknown>} */
  ask: (id, body) => request("PUT", one(id, "poll"), body),

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

  /** @type {(body: Messages.VoteRequest) => Promise<Messages.VotePublic>} */
  vote: (body) => request("PUT", "follow/vote", body),

  /** @type {(body: Messages.ForkCreate) => Promise<Messages.ForkPublic>} */
  fork: (body) => request("POST", "follow/fork", body),

  /** @returns {Promise<null>} */
  giveBack: () => request("DELETE", "follow/fork"),

  stream: "follow/stream",
};
