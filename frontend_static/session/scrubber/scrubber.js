/**
 * The scrubber: the memory of the run, and the way back into it. Dragging shows the frame under the finger; letting go
 * stays there.
 */

import { fill, h } from "../../shared/dom.js";
import { quantity, smallestSpan, unitOf } from "../../shared/format.js";
import { curve } from "../history.js";
import { coalesce, throttle } from "../../shared/timing.js";
import { Axis, HEIGHT, ROWS, paint, playhead } from "./paint.js";
import { onTheme, tokens } from "../../shared/theme.js";
import { marks, thresholds } from "../timeline.js";

const REPAINT_MS = 100;
const SETTLE_MS = 1000;
const NEAR_PX = 7;
const INKS = ["ink", "muted", "well", "surface", "accent", "ramp", "hidden", "lost", "prediction", "observation"];

/**
 * @param {HTMLElement} root
 * @param {import("../store.js").Store} store
 * @param {import("../commands.js").Commands} commands
 */
export function scrubber(root, store, commands) {
  const canvas = h("canvas", { class: "scrubber-canvas" });
  const tip = h("div", { class: "tip", hidden: true });
  const slider = h(
    "div",
    { class: "scrubber", role: "slider", tabindex: 0, "aria-label": "Position in the run", "aria-valuemin": 0 },
    canvas,
    tip,
  );
  fill(root, slider);
  const still = document.createElement("canvas");
  let ink = tokens(...INKS);
  let axis = new Axis(600, 2);
  let dragged = null;
  let settling = null;
  let diamonds = [];

  const top = coalesce(() => {
    const session = store.session;
    if (session === null) return;
    const context = canvas.getContext("2d");
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.drawImage(still, 0, 0);
    const ratio = canvas.width / (slider.clientWidth || 1);
    context.scale(ratio, ratio);
    const position = dragged ?? settling ?? session.position;
    playhead(context, axis, position, session.head, ink);
    slider.setAttribute("aria-valuemax", String(session.frames - 1));
    slider.setAttribute("aria-valuenow", String(position));
    slider.setAttribute("aria-valuetext", words(store, position).join(", "));
  });

  const repaint = throttle(() => {
    const session = store.session;
    const width = slider.clientWidth;
    if (session === null || width === 0) return;
    const ratio = globalThis.devicePixelRatio || 1;
    for (const one of [canvas, still]) {
      if (one.width !== Math.round(width * ratio)) one.width = Math.round(width * ratio);
      if (one.height !== Math.round(HEIGHT * ratio)) one.height = Math.round(HEIGHT * ratio);
    }
    axis = new Axis(width, session.frames);
    diamonds = marks(session);
    const context = still.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    paint(
      context,
      axis,
      {
        lines: store.branches.map((branch) => ({
          history: store.historyOf(branch.id),
          colour: branch.colour,
          active: branch.id === session.branch,
        })),
        thresholds: thresholds(session),
        bookmarks: (session.bookmarks ?? []).filter((mark) => !mark.branch || mark.branch === session.branch),
        marks: diamonds,
        smallest: smallestSpan(unitOf(session)),
        mixture: mixtureOf(session),
      },
      ink,
    );
    top();
  }, REPAINT_MS);

  store.on("position", () => {
    if (store.session.position === settling) settling = null;
    top();
  });
  store.on("session history branches bookmarks", repaint);
  new ResizeObserver(repaint).observe(slider);
  onTheme(() => {
    ink = tokens(...INKS);
    repaint();
  });

  const at = (event) => {
    const box = slider.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const drag = (event) => {
    const frame = axis.frame(at(event)[0]);
    if (frame === dragged) return;
    dragged = frame;
    commands.seek(frame);
    top();
  };
  slider.addEventListener("pointerdown", (event) => {
    if (event.button !== 0 || !commands.able) return;
    slider.setPointerCapture(event.pointerId);
    drag(event);
  });
  slider.addEventListener("pointermove", (event) => {
    if (dragged !== null) drag(event);
    hint(...at(event));
  });
  for (const end of ["pointerup", "pointercancel"]) {
    slider.addEventListener(end, () => {
      if (dragged === null) return;
      // Until the server is there the playhead stays where it was let go.
      settling = dragged;
      dragged = null;
      commands.seek(settling).finally(() => setTimeout(() => ((settling = null), top()), SETTLE_MS));
      top();
    });
  }
  slider.addEventListener("pointerleave", () => {
    tip.hidden = true;
  });

  function hint(x, y) {
    const session = store.session;
    if (session === null || x < axis.left - NEAR_PX) {
      tip.hidden = true;
      return;
    }
    const near = (frame) => Math.abs(axis.x(frame) - x) <= NEAR_PX;
    const change = y >= ROWS.changes[1] ? diamonds.find((mark) => near(mark.frame)) : undefined;
    const bookmark = y <= ROWS.flags[2] ? (session.bookmarks ?? []).find((mark) => near(mark.frame)) : undefined;
    const lines = change
      ? [`from frame ${change.frame}`, ...change.lines]
      : bookmark
        ? [`frame ${bookmark.frame}`, bookmark.note || "bookmark"]
        : [words(store, axis.frame(x)).join(" · ")];
    fill(tip, lines.map((line) => h("div", {}, line)));
    tip.hidden = false;
    const width = tip.offsetWidth;
    tip.style.left = `${Math.min(Math.max(4, x - width / 2), slider.clientWidth - width - 4)}px`;
  }
}

/** Which share of the particles is painted in the colour of the observation: as the experiment's plots have it. */
function mixtureOf(session) {
  const features = session.plots.find(({ kind }) => kind === "features");
  if (features === undefined) return { label: "proposal", share: (row) => ratio(curve.observation(row), curve.prediction(row)) };
  return { label: features.id, share: (row) => mean(row?.series?.[features.series[0]]) };
}

function ratio(one, other) {
  return one + other > 0 ? one / (one + other) : null;
}

function mean(values) {
  const known = values?.filter(Number.isFinite) ?? [];
  return known.length > 0 ? known.reduce((sum, value) => sum + value, 0) / known.length : null;
}

function words(store, frame) {
  const row = store.history.at(frame);
  const unit = unitOf(store.session);
  if (!row) return [`frame ${frame}`, "not computed yet"];
  const told = [`frame ${frame}`];
  if (curve.error(row) !== null) told.push(`error ${quantity(curve.error(row), unit)} ${unit}`.trim());
  if (curve.sigma(row) !== null) told.push(`sigma ${quantity(curve.sigma(row), unit)} ${unit}`.trim());
  if (row.searching) told.push(`no ${store.session.target}`);
  else if (row.lost) told.push("lost");
  else if (row.hidden) told.push("hidden");
  return told;
}
