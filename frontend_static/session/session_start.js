/**
 * The first thing that runs on a session's page: it finds or starts the session and has its picture shown, before the
 * rest of the page is there. Hence few imports, all of them named in `session.html` so that they come at once.
 */

import { api } from "../shared/api.js";
import { Scene } from "./scene.js";
import { decode } from "../shared/share_link.js";

const NEW = "new";
const id = decodeURIComponent(location.pathname.split("/").filter(Boolean).at(-1));

export const isNew = id === NEW;
export const scene = new Scene(document.querySelector('[data-part="scene"]'));

/** The session, and the wish that it was started with, if this page started it. */
export const begun = isNew ? start() : find();
// Whoever waits for it says what was wrong; until somebody does, it is no accident.
begun.catch(() => {});

async function start() {
  const wish = readWish();
  const { play, ...rest } = wish;
  const session = await api.start(rest);
  history.replaceState(null, "", session.page);
  scene.open(session.id, !wish.position);
  return { session, wish };
}

async function find() {
  scene.open(id, false);
  return { session: await api.session(id), wish: null };
}

function readWish() {
  try {
    return decode(location.hash);
  } catch {
    throw new Error("The link is incomplete; it must hold an experiment after the # sign");
  }
}
