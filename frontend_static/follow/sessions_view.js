/** The sessions that a class follows: one with its plots, its numbers and its parameters, or several side by side. */

import { mount } from "../session/mount.js";
import { SessionStart } from "../session/session_start.js";
import { sessionTitle } from "../session/timeline.js";
import { fill, h, setText } from "../shared/dom.js";
import { coalesce } from "../shared/timing.js";
import { ofSession, showParameters } from "./parameter_list.js";

/** @import { Mounted } from "../session/mount.js" */
/** @import { FollowedPublic, SessionPublic } from "../shared/messages.js" */

/** What of the lecturer's page is passed on: some of the plots, and layers that are shown beside those declared so. */
/** @typedef {{plots?: string[], layers?: string[]}} Arrangement */

/**
 * @param {HTMLElement} place
 * @param {readonly FollowedPublic[]} sessions
 * @param {Arrangement} arrangement
 * @returns {Mounted[]}
 */
export function showSessions(place, sessions, { plots = [], layers = [] }) {
  if (sessions.length === 1) return [whole(place, sessions[0].id, plots, layers)];
  const several = sessions.map((session) => beside(session, layers));
  fill(place, h("div", { class: "follow-several", data: { count: sessions.length } }, several.map(({ element }) => element)));
  return several.map(({ view }) => view);
}

/**
 * @param {HTMLElement} place
 * @param {string} session
 * @param {string[]} plots
 * @param {string[]} layers
 */
function whole(place, session, plots, layers) {
  const element = h("div", { class: "follow-one" });
  fill(place, element);
  const start = new SessionStart(element, { session, layers, parts: ["scene", "branches", "plots", "readout"], view: "flat" });
  const view = mount(element, { start, plots, readOnly: true });
  const inForce = h("section", { class: "in-force", "aria-label": "Parameters in force" });
  start.places.readout?.after(inForce);
  const draw = coalesce(() => view.store.session !== null && showParameters(inForce, ofSession(view.store.session)), view.signal);
  view.store.on(["parameters", "tracker", "recipe"], draw);
  return view;
}

/**
 * @param {FollowedPublic} session
 * @param {string[]} layers
 */
function beside({ id, title }, layers) {
  const caption = h("figcaption", {}, title);
  const place = h("div", { class: "follow-view" });
  const element = h("figure", {}, caption, place);
  const start = new SessionStart(place, { session: id, layers, parts: ["scene", "readout"], view: "flat" });
  const view = mount(place, { start, readOnly: true });
  const { store } = view;
  store.on(["tracker", "recipe"], () => {
    if (store.session !== null) setText(caption, sessionTitle(store.session));
  });
  return { element, view };
}
