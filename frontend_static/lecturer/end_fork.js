/** The way back from what a follower tries alone: it ends, and its place is free for others. */

import { START } from "../shared/address.js";
import { attempt } from "../shared/toast.js";
import { followed } from "./api.js";

export const END_FORK = "End your copy and free its place";

export async function endFork() {
  if ((await attempt(() => followed.giveBack())) !== undefined) location.assign(START);
}
