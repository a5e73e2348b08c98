/** The gallery of failures: by kind, each with its number, and with the errors of both runs as soon as they are computed. */

import { api, messageOf } from "../shared/api.js";
import { whenCompiled } from "../shared/compiling.js";
import { fill, h, part } from "../shared/dom.js";
import { navigation } from "../shared/navigation.js";
import { notice } from "../shared/notice.js";
import { presentationButton } from "../shared/presentation.js";
import { themeButton } from "../shared/theme.js";
import { later } from "../shared/timing.js";
import { curve } from "./curve.js";
import { differences } from "./difference_text.js";

/** @import { FailurePublic } from "../shared/messages.js" */

const SKELETON_AFTER_MS = 200;
const EMPTY = "None of the installed experiments declares a failure.";
const root = part("failures");
/** Ends what waits when the page is left. */
const end = new AbortController();

navigation("failures");
part("tools").append(themeButton(), presentationButton());
addEventListener("pagehide", () => end.abort());
addEventListener("pageshow", (event) => event.persisted && location.reload());
load();

async function load() {
  const there = later(() => fill(root, h("div", { class: "failure-cards" }, bone(), bone(), bone())), SKELETON_AFTER_MS);
  try {
    const failures = await api.failures();
    there();
    const drawn = failures.map((failure) => ({ failure, place: h("div", { class: "curve-place" }, h("div", { class: "shimmer" })) }));
    const kinds = [...new Set(failures.map(({ kind_title: kind }) => kind))];
    fill(
      root,
      failures.length === 0 && h("p", { class: "empty" }, EMPTY),
      kinds.map((kind) =>
        h(
          "section",
          { "aria-label": kind },
          h("h2", {}, kind),
          h("div", { class: "failure-cards" }, drawn.filter(({ failure }) => failure.kind_title === kind).map(({ failure, place }) => card(failure, place))),
        ),
      ),
    );
    // One after the other: each is computed once, and somebody may be tracking meanwhile.
    for (const { failure, place } of drawn) await draw(failure, place);
  } catch (error) {
    there();
    fill(root, notice("The failures could not be listed", messageOf(error), { label: "Try again", run: load }, { inline: true }));
  }
}

/**
 * @param {FailurePublic} failure
 * @param {HTMLElement} place
 */
async function draw(failure, place) {
  const tell = (/** @type {string} */ sentence) => fill(place, h("p", { class: "hint", role: "status" }, sentence));
  try {
    const course = await whenCompiled(failure.experiment, () => api.course(failure.id, end.signal), tell, end.signal);
    fill(place, curve(course, failure.frame, end.signal));
  } catch (error) {
    tell(messageOf(error));
  }
}

/**
 * @param {FailurePublic} failure
 * @param {HTMLElement} place
 */
function card(failure, place) {
  return h(
    "article",
    { class: "failure-card", data: { failure: failure.id } },
    h("h3", {}, h("a", { href: failure.page }, h("span", { class: "failure-number" }, `${failure.number}`), failure.title)),
    place,
    h("p", {}, failure.diagnosis),
    h("p", { class: "hint" }, `${failure.experiment_title} · ${differences(failure)}`),
  );
}

function bone() {
  const lines = ["bone short shimmer", "curve-place shimmer", "bone shimmer"].map((shape) => h("div", { class: shape }));
  return h("div", { class: "failure-card", "aria-hidden": "true" }, lines);
}
