/** What the stream of a session tells: a greeting, and what changes after it. */

const SESSION = {
  id: "s", state: "ready", branch: "b0", branches: [{ id: "b0", parent: null, frame: 0 }], position: 0, computed: 0, goal: null, frames: 50,
  playing: false, speed: 1, speeds: [0.5, 1, 0], timeline: [], thresholds: [], parameters: { n: 1 }, tracker: "a", trackers: [], bookmarks: [], recipe: {},
};

export const hello = (more = {}, diagnostics = { frame: [0], error: [1], estimate: [[0]] }) => (
  { type: "hello", diagnostics, session: { ...SESSION, ...more } });

export const changes = (session, rows = []) => ({ type: "changes", session, rows });
