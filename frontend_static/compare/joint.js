/**
 * Runs in step on a page: a session each, and one transport, one scrubber and one set of plots for all of them.
 * Sessions made here belong to the page: they begin and end with it.
 */

import { keepUp } from "../session/clock.js";
import { Overlay } from "../session/flat/drawing.js";
import { Mounted } from "../session/mount.js";
import { OVERLAID } from "../session/plots/kinds.js";
import { plots } from "../session/plots/plots.js";
import { scrubber } from "../session/scrubber.js";
import { listen } from "../session/keys.js";
import { arrange, SessionStart } from "../session/session_start.js";
import { Steering } from "../session/steering.js";
import { transport } from "../session/transport.js";
import { build } from "../shared/dom.js";
import { signal } from "../vendor/preact.js";
import { JointStore } from "./joint_store.js";

/** @import { ViewKind } from "../session/scene.js" */
/** @import { Actions } from "../session/keys.js" */
/** @import { NewSession } from "../shared/share_link.js" */
/** @import { Child } from "../vendor/preact.js" */
/** @import { Run } from "./joint_store.js" */

/**
 * One of the runs on a page.
 *
 * @typedef {Run & {label: string, recipe?: NewSession, session?: string}} Member `label` names its place for screen readers. `recipe`
 *     makes its session; without one, `session` exists already.
 */

const PARTS = /** @type {const} */ (["scene", "readout"]);

/** The places of the runs, and their shared parts. */
export class JointView {
  #end = new AbortController();
  #starts;
  /** @type {Awaited<ReturnType<typeof plots>>|null} */
  #plots = null;
  /** Ids of the sessions, once all have started. */
  sessions = signal(/** @type {string[]} */ ([]));

  /**
   * @param {readonly Member[]} members
   * @param {{kind: string, readOnly?: boolean}} options `kind` is the CSS class of the places; with `readOnly` the runs cannot be moved
   here. */
  constructor(members, { kind, readOnly = false }) {
    /** Elements for the pictures and the numbers of the runs. */
    this.places = members.map(({ label }) => build("div", { class: kind, data: { within: label } }));
    /** Painting of each flat view when the views lie over each other. */
    this.overlays = members.map(({ first }) => new Overlay(first));
    this.#starts = members.map(({ recipe, session }, index) => {
      const look = { parts: PARTS, view: /** @type {const} */ ("flat"), overlay: this.overlays[index], isBare: true };
      return new SessionStart(this.places[index], { session, recipe, isOwn: recipe !== undefined, ...look });
    });
    // The leader is a run whose own first frame is the first common one.
    const lead = Math.max(0, members.findIndex(({ first }) => first === 0));
    const leader = new Mounted(this.#starts[lead], { keys: null, readOnly });
    this.views = this.#starts.map((start, place) => {
      return place === lead ? leader : new Mounted(start, { steering: leader.steering, keys: null, readOnly });
    });
    const runs = members.map(({ name, colour, first }, place) => ({ name, colour, first, store: this.views[place].store }));
    this.store = new JointStore(runs, lead, readOnly);
    this.steering = new Steering(this.store, this.signal);
    for (const { store, first } of runs) {
      if (store !== leader.store) keepUp({ store, steering: new Steering(store, this.signal), first }, leader.store, this.signal);
    }
    /** Resolves when all sessions have started, without a time limit, or rejects. */
    this.begun = this.#all();
    this.begun.catch(() => {});
  }

  get signal() {
    return this.#end.signal;
  }

  scene = null;

  /** Ids of the plots that all runs share and that can be laid over each other. */
  get plots() {
    const [first, ...others] = this.views.map(({ store }) => store.session?.plots ?? []);
    const key = (/** @type {{id: string, kind: string}} */ { id, kind }) => `${kind} ${id}`;
    const isShared = (/** @type {string} */ wanted) => others.every((each) => each.some((plot) => key(plot) === wanted));
    return first.filter((plot) => OVERLAID.includes(plot.kind) && isShared(key(plot))).map(({ id }) => id);
  }

  /** Title of the success measure, if all runs have the same one; empty until the sessions are known. */
  get measure() {
    const sessions = this.views.map(({ store }) => store.session);
    if (sessions.some((session) => session === null)) return "";
    const titles = new Set(sessions.map((session) => session?.measures.find(({ name }) => name === session.success_measure)?.title));
    return (titles.size === 1 && [...titles][0]) || "Successful";
  }

  /** The shown frame, counted in the common frames. */
  get position() {
    return this.store.session?.position ?? 0;
  }

  /** The transport and the scrubber; only the scrubber if the runs cannot be moved.
   *
   * @param {string} kind Class of the element.
   * @param {Child} extra A further control, at the right of the transport.
   */
  deck(kind, extra) {
    const place = build("div", { class: kind });
    const places = arrange(place, this.store.isReadOnly ? ["scrubber"] : ["transport", "scrubber"]);
    if (places.transport) transport(places.transport, this, extra);
    if (places.scrubber) scrubber(places.scrubber, this);
    return place;
  }

  /** The plots, all runs in each. */
  plotted() {
    const place = build("div", { class: "plots" });
    plots(place, this).then((made) => (this.#plots = made));
    return place;
  }

  /** Let the keys of the page move all runs.
   *
   * @param {Partial<Actions>} more Further actions of keys.
   */
  listen(more) {
    listen(document.body, this, { zoom: (factor) => this.#plots?.zoom(factor), ...more });
  }

  /**
   * Show all runs flat or in three dimensions.
   *
   * @param {ViewKind} kind
   */
  show(kind) {
    for (const { scene } of this.views) scene?.show(kind);
  }

  /** End everything made here, also on the server and when the page is being left. */
  end() {
    if (this.signal.aborted) return;
    this.#end.abort();
    for (const view of this.views) view.dispose();
  }

  async #all() {
    // It waits for all, so that their places are free for another attempt.
    await Promise.allSettled(this.#starts.map(({ begun }) => begun));
    const begun = await Promise.all(this.#starts.map((start) => start.begun));
    this.sessions.value = begun.map(({ session }) => session.id);
  }
}
