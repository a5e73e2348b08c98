/** Lectures in the server's REST interface. */

import { ROOT, pathOf, request } from "../shared/api.js";

/** @import * as Messages from "../shared/messages.js" */

const one = pathOf("lectures");

export const lectures = {
  /** @returns {Promise<Messages.LectureSummary[]>} */
  all: () => request("GET", "lectures"),

  /** @type {(id: string) => Promise<Messages.LecturePublic>} */
  get: (id) => request("GET", one(id)),

  /** @type {(body: Messages.LectureUpdate) => Promise<Messages.LecturePublic>} */
  add: (body) => request("POST", "lectures", body),

  /** @type {(id: string, body: Messages.LectureUpdate) => Promise<Messages.LecturePublic>} */
  change: (id, body) => request("PUT", one(id), body),

  /** @type {(id: string) => Promise<null>} */
  remove: (id) => request("DELETE", one(id)),

  /** @type {(file: Blob) => Promise<Messages.LecturePublic>} */
  bringIn: (file) => request("POST", "lectures/import", new Blob([file], { type: "text/markdown" })),

  fileAddress: (/** @type {string} */ id) => `${ROOT}${one(id, "file")}`,
};
