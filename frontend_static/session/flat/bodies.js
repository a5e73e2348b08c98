/** Painting what has a direction or a spread: arrows, and ellipsoids by their outlines. */

import { css, placed } from "./pixels.js";

/** @import { Arrows, Ellipsoids } from "./decode.js" */
/** @import { Surface } from "./paint.js" */

const CORNERS = 72;
const OUTLINE_PX = 1;
/** Length of an arrow's head: in widths of its line, but at most this share of the arrow. */
const HEAD_WIDTHS = 6;
const HEAD_SHARE = 0.35;
const HALF_ANGLE = (24 * Math.PI) / 180;

/**
 * Paint the heads of arrows; their lines are painted like any others.
 *
 * @param {Surface} surface
 * @param {Arrows} item
 */
export function paintHeads({ context, scale }, { segments, colour, width }) {
  context.fillStyle = css(colour);
  for (let at = 0; at < segments.length; at += 6) {
    const [x, y] = [segments[at + 3], segments[at + 4]];
    const [dx, dy] = [x - segments[at], y - segments[at + 1]];
    const length = Math.hypot(dx, dy);
    if (!Number.isFinite(length) || length === 0) continue;
    const head = Math.min(HEAD_SHARE * length, HEAD_WIDTHS * width) / length;
    const aside = head * Math.tan(HALF_ANGLE);
    fillCorners(context, scale, [
      [x, y],
      [x - head * dx - aside * dy, y - head * dy + aside * dx],
      [x - head * dx + aside * dy, y - head * dy - aside * dx],
    ]);
  }
}

/**
 * @param {Surface} surface
 * @param {Ellipsoids} item
 */
export function paintEllipsoids({ context, scale, density }, { centres, covariances, colours, opacity, sigmas }) {
  context.lineWidth = Math.max(density, OUTLINE_PX * scale);
  for (let number = 0; 3 * number < centres.length; number += 1) {
    const [x, y] = [centres[3 * number], centres[3 * number + 1]];
    const [across, slope, rest] = root(covariances[9 * number], covariances[9 * number + 3], covariances[9 * number + 4]);
    if (!Number.isFinite(x + y + across + slope + rest)) continue;
    const corners = Array.from({ length: CORNERS }, (_, corner) => {
      const angle = (2 * Math.PI * corner) / CORNERS;
      const [cos, sin] = [sigmas * Math.cos(angle), sigmas * Math.sin(angle)];
      return [x + across * cos, y + slope * cos + rest * sin];
    });
    context.fillStyle = context.strokeStyle = css(colours.subarray(3 * number, 3 * number + 3));
    context.globalAlpha = opacity;
    fillCorners(context, scale, corners);
    context.globalAlpha = 1;
    context.stroke();
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {number} scale
 * @param {readonly number[][]} corners
 */
function fillCorners(context, scale, corners) {
  context.beginPath();
  for (const [x, y] of corners) context.lineTo(placed(x, scale), placed(y, scale));
  context.closePath();
  context.fill();
}

/**
 * The lower triangular root of a covariance in the picture, which may be flat.
 *
 * @param {number} first Variance along x.
 * @param {number} both Covariance.
 * @param {number} second Variance along y.
 */
function root(first, both, second) {
  const across = Math.sqrt(Math.max(first, 0));
  const slope = across > 0 ? both / across : 0;
  return [across, slope, Math.sqrt(Math.max(second - slope * slope, 0))];
}
