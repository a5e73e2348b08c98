/** The keys of a comparison. */

import { openDialog } from "../shared/dialog.js";
import { h } from "../shared/dom.js";

/** @type {readonly [keys: string, what: string][]} */
const KEYS = [
  ["space", "Play or pause all runs"],
  ["← →", "One frame back or forward"],
  ["shift ← →", "Ten frames back or forward"],
  ["home end", "First frame, newest frame"],
  ["D", "Go to the first frame in which two runs differ"],
  ["L", "Go to before the first loss"],
  ["E", "Go to the next event of any run, such as an identity switch; with shift, to the one before"],
  ["[ ]", "Slower, faster"],
  ["F", "Present in large type; escape ends it"],
  ["pageup pagedown", "In a lecture: the item before, the next one"],
  ["?", "This help"],
];

export function help() {
  openDialog("Keys", () => [
    h("dl", { class: "keys" }, KEYS.map(([keys, what]) => [h("dt", {}, keys.split(" ").map((key) => h("kbd", {}, key))), h("dd", {}, what)])),
  ]);
}
