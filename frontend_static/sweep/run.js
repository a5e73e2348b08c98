/** Opens a run of a sweep as a session, and goes there. A page of its own, so that a plain link can open it in a tab. */

import { messageOf } from "../shared/api.js";
import { fill, h, lastOfAddress, part } from "../shared/dom.js";
import { navigation } from "../shared/navigation.js";
import { sweeps } from "./api.js";

const [sweep, run] = [lastOfAddress(2), lastOfAddress()];
const root = part("wait");

navigation(null);
fill(
  root,
  h(
    "div",
    { class: "notice", role: "status" },
    h("h2", {}, `Opening run ${run}`),
    h("p", {}, "It is computed up to ten frames before the target is lost."),
    h("div", { class: "bone shimmer" }),
  ),
);
try {
  const session = await sweeps.open(sweep, run, new URLSearchParams(location.search).get("tracker"));
  location.replace(session.page);
} catch (error) {
  fill(
    root,
    h(
      "div",
      { class: "notice", role: "alert" },
      h("h2", {}, "This run could not be opened"),
      h("p", {}, messageOf(error)),
      h("button", { type: "button", class: "primary", on: { click: () => location.reload() } }, "Try again"),
      h("a", { href: `sweep/${encodeURIComponent(sweep)}` }, "Back to the sweep"),
    ),
  );
}
