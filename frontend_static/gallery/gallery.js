/** The start page: where to begin, a place for one's own video, and the experiments by family. */

import { ahead } from "./prefetch.js";
import { api, messageOf } from "../shared/api.js";
import { REFERENCES } from "../shared/citations.js";
import { families, skeletonCard } from "./cards.js";
import { compilationMeter, followCompiling, inSentenceCase } from "../shared/compiling.js";
import { fill, h, part } from "../shared/dom.js";
import { navigation } from "../shared/navigation.js";
import { offerOwnFilter } from "./own_filter.js";
import { pluginProblems } from "./plugins.js";
import { offer } from "./tour_offer.js";
import { TargetForm } from "../upload/target.js";
import { GLOSSARY } from "../shared/terms.js";
import { themeButton } from "../shared/theme.js";
import { attempt, toast } from "../shared/toast.js";
import { DropZone } from "../upload/upload.js";

const SKELETON_AFTER_MS = 200;
const UPLOAD = /^#upload\/(.+)$/;
/** Where the saved runs stood before. */
const RUN = /^#run-\w+$/;

/** @type {import("../shared/messages.js").ExperimentPublic[]|null} */
let experiments = null;
/** @type {TargetForm|null} */
let form = null;

if (RUN.test(location.hash)) location.replace(`work?show=runs${location.hash}`);
navigation("experiments");
part("tools").append(h("a", { class: "link", href: GLOSSARY }, "Glossary"), h("a", { class: "link", href: REFERENCES }, "References"), themeButton());
new DropZone(part("drop"), {
  uploaded: (upload) => {
    location.hash = `upload/${encodeURIComponent(upload.id)}`;
  },
  imported: async (run) => {
    toast(`${run.title} is in My work, under saved runs`);
    const session = await attempt(() => api.open(run.id));
    if (session) location.assign(session.page);
  },
});
offerOwnFilter(part("own-filter"));
addEventListener("hashchange", target);
followCompiling(compiling).catch(() => (part("compiling").hidden = true));
// A page that comes back from the browser's cache shows what was; ask again.
addEventListener("pageshow", (event) => event.persisted && load());
load();

async function load() {
  const cards = part("experiments");
  const slow = setTimeout(() => experiments === null && fill(cards, skeletonCard(), skeletonCard()), SKELETON_AFTER_MS);
  try {
    experiments = await api.experiments();
    fill(cards, families(experiments));
    offer(part("tour"), experiments);
  } catch (error) {
    fill(cards, failure("The experiments could not be listed", messageOf(error)));
    return;
  } finally {
    clearTimeout(slow);
  }
  await Promise.all([problems(), target()]);
  await ahead();
}

/**
 * Say how far compiling is, and on each card whether it has to wait for that; all of it goes away by itself.
 *
 * @param {import("../shared/messages.js").CompilationPublic} compilation
 */
function compiling(compilation) {
  const { finished, sentence, usable, ready } = compilation;
  const place = part("compiling");
  fill(place, !finished && [`${inSentenceCase(sentence)}. `, compilationMeter(compilation)]);
  place.hidden = finished;
  for (const card of part("experiments").querySelectorAll("article")) {
    const { experiment = "" } = card.dataset;
    card.classList.toggle("waits", !finished && !usable.includes(experiment));
    if (card.dataset.drawn === undefined && (finished || ready.includes(experiment))) {
      card.dataset.drawn = "";
      card.querySelectorAll("img").forEach(again);
    }
  }
}

/** @param {HTMLImageElement} image A picture, which is asked for again if it could not be drawn before. */
function again(image) {
  if (!image.classList.contains("missing")) return;
  image.classList.remove("missing");
  const address = image.src;
  image.src = address;
}

async function problems() {
  try {
    await pluginProblems(part("plugins"));
  } catch (error) {
    part("plugins").hidden = false;
    fill(part("plugins"), failure("The experiments of other packages could not be listed", messageOf(error)));
  }
}

/** With an upload in the address, ask what shall be followed in it; so a reload keeps the place. */
async function target() {
  const id = uploadOfAddress();
  const place = part("target");
  leaveForm();
  if (!id) {
    show(false);
    fill(place);
    return;
  }
  try {
    const upload = await api.upload(decodeURIComponent(id));
    if (id !== uploadOfAddress() || experiments === null) return;
    leaveForm();
    form = new TargetForm(place, upload, experiments, leave);
    show(true);
  } catch (error) {
    if (id !== uploadOfAddress()) return;
    toast(messageOf(error), { kind: "error" });
    leave();
  }
}

/** Whoever goes back leaves a form that may still search thousands of pictures. */
function leaveForm() {
  form?.leave();
  form = null;
}

/** The upload that the address names, as it stands there. */
function uploadOfAddress() {
  return UPLOAD.exec(location.hash)?.[1];
}

function leave() {
  history.replaceState(null, "", location.pathname);
  target();
}

/** @param {boolean} asking */
function show(asking) {
  part("target").hidden = !asking;
  for (const name of ["welcome", "browse"]) part(name).hidden = asking;
}

/**
 * @param {string} title
 * @param {string} message
 */
function failure(title, message) {
  return h(
    "div",
    { class: "notice inline", role: "alert" },
    h("h2", {}, title),
    h("p", {}, message),
    h("button", { type: "button", class: "primary", on: { click: load } }, "Try again"),
  );
}
