/**
 * How a colour with a meaning is drawn: a line has its own width and dashes, a point its own shape, so that they are told
 * apart without colours, too.
 */

/** @import { Trace } from "./traces.js" */

/** @typedef {Trace["ink"]} Ink */
/** @typedef {"disc"|"ring"|"triangle"|"diamond"|"cross"|"square"} Shape */

/**
 * @typedef {object} Look
 * @property {number} width Of a line, in px at letters of 16 px.
 * @property {number[]} dash Likewise.
 * @property {Shape} shape Of a point.
 */

/** @type {Record<Ink, Look>} */
export const LOOKS = {
  estimate: { width: 2.5, dash: [], shape: "disc" },
  truth: { width: 1.75, dash: [], shape: "ring" },
  prediction: { width: 2.5, dash: [11, 4], shape: "triangle" },
  observation: { width: 3, dash: [11, 4, 3, 4], shape: "diamond" },
  lost: { width: 2.5, dash: [3, 3], shape: "cross" },
  second: { width: 2.5, dash: [18, 4], shape: "square" },
  hidden: { width: 1.5, dash: [], shape: "disc" },
};

/** Of what is said to be dashed, whatever its colour. */
export const DASHED = [5, 4];

/** @type {Ink[]} */
export const INKS = ["estimate", "truth", "prediction", "observation", "lost", "second", "hidden"];
