/** The lessons of the server's REST interface. */

import { ROOT, pathOf, request } from "../shared/api.js";

/** @import * as Messages from "../shared/messages.js" */

const one = pathOf("lessons");

/** What pages ask of lessons; each answer is JSON of the server's. */
export const lessons = {
  /** @returns {Promise<Messages.LessonsPublic>} */
  all: () => request("GET", "lessons"),

  /** @type {(id: string) => Promise<Messages.LessonDetail>} */
  get: (id) => request("GET", one(id)),

  /** @type {(id: string, wanted: Messages.FigureRequest, signal?: AbortSignal) => Promise<Messages.FigurePublic>} */
  figure: (id, wanted, signal) => request("POST", one(id, "figure"), wanted, signal),

  /** @type {(id: string, answer: number|string) => Promise<Messages.VerdictPublic|Messages.ComputingPublic>} */
  answer: (id, answer) => request("POST", one(id, "answer"), { answer }),

  /** @type {(id: string) => Promise<Messages.ChecksPublic>} */
  checks: (id) => request("GET", one(id, "checks")),

  notebook: (/** @type {string} */ id) => `${ROOT}${one(id, "notebook.ipynb")}`,
};
