/** The page of a new sweep: a form that is filled in with what the address says, or with the experiment's example. */

import { api, messageOf } from "../shared/api.js";
import { fill, h, part } from "../shared/dom.js";
import { navigation } from "../shared/navigation.js";
import { notice } from "../shared/notice.js";
import { decode } from "../shared/share_link.js";
import { themeButton } from "../shared/theme.js";
import { later } from "../shared/timing.js";
import { sweeps } from "./api.js";
import { PlanForm } from "./plan_form.js";

/** @import { ExperimentDetail, ExperimentPublic, SweepCreate, UploadPublic } from "../shared/messages.js" */

const SKELETON_AFTER_MS = 200;
const OTHER_SEEDS = 20;
const root = part("plan");

navigation(null);
part("tools").append(themeButton());
begin();

async function begin() {
  const bones = h("div", { class: "plan-part" }, h("div", { class: "bone shimmer" }), h("div", { class: "bone short shimmer" }));
  const there = later(() => fill(root, bones), SKELETON_AFTER_MS);
  try {
    const experiments = await api.experiments();
    const given = planOfAddress();
    const chosen = experiments.find(({ id }) => id === given?.experiment) ?? experiments[0];
    const upload = given?.upload ? await api.upload(given.upload) : null;
    // On a recording the example's scene does not exist: what is asked first is what other seeds come to.
    const start = upload ? { trials: OTHER_SEEDS, ...given, axes: given?.axes ?? [] } : given;
    const plan = start?.axes ? { ...start, experiment: chosen.id, axes: start.axes } : exampleWith(await sweeps.example(chosen.id), start);
    const experiment = await api.experiment(chosen.id, upload?.kind);
    there();
    show(experiments, experiment, plan, upload);
  } catch (error) {
    there();
    fill(root, notice("The form could not be prepared", messageOf(error), { label: "Try again", run: begin }));
  }
}

/**
 * The form of one experiment; choosing another one brings another form.
 *
 * @param {ExperimentPublic[]} experiments
 * @param {ExperimentDetail} experiment
 * @param {SweepCreate} plan
 * @param {UploadPublic|null} [upload] The recording on which all runs are, if there is one.
 */
function show(experiments, experiment, plan, upload = null) {
  let wanted = experiment.id;
  const form = new PlanForm(upload ? [experiment] : experiments, experiment, plan, upload, async (id) => {
    wanted = id;
    const [other, example] = await Promise.all([api.experiment(id), sweeps.example(id)]);
    // Of two that were chosen quickly the answers may come in the other order.
    if (wanted !== id) return;
    form.leave();
    show(experiments, other, example);
    root.querySelector("select")?.focus();
  });
  fill(root, form.elements);
}

/**
 * The example's axes with the tracker and the values of a run.
 *
 * @param {SweepCreate} example
 * @param {Partial<SweepCreate>|null} given
 * @returns {SweepCreate}
 */
function exampleWith(example, given) {
  const varied = new Set(example.axes.map(({ name }) => name));
  const kept = Object.entries(given?.parameters ?? {}).filter(([name]) => !varied.has(name));
  return { ...example, trackers: given?.trackers ?? example.trackers, parameters: { ...example.parameters, ...Object.fromEntries(kept) } };
}

/** @returns {Partial<SweepCreate>|null} A link may name the experiment alone. */
function planOfAddress() {
  try {
    return decode(location.hash);
  } catch {
    return null;
  }
}
