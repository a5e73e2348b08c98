/** The form of a new sweep: what is varied, by whom, how often; with the size and the time before anything starts. */

import { api } from "../shared/api.js";
import { fill, h, part } from "../shared/dom.js";
import { after } from "../shared/timing.js";
import { sweeps } from "./api.js";
import { axisRow } from "./axis.js";
import { field, parameterSelect, showError, valueInput, wrong } from "./fields.js";
import { sizeCard } from "./size.js";
import { themeButton } from "../shared/theme.js";
import { decode } from "../shared/share_link.js";

const SKELETON_AFTER_MS = 200;
const root = part("plan");
part("tools").append(themeButton());
begin();

async function begin() {
  let there = false;
  after(SKELETON_AFTER_MS).then(() => there || fill(root, h("div", { class: "plan-part" }, h("div", { class: "bone shimmer" }), h("div", { class: "bone short shimmer" }))));
  try {
    const experiments = await api.experiments();
    const given = wishOfAddress();
    const chosen = experiments.find(({ id }) => id === given?.experiment) ?? experiments[0];
    const complete = given?.axes ? given : await sweeps.example(chosen.id);
    const form = await planForm(experiments, { ...complete, experiment: chosen.id });
    there = true;
    fill(root, form);
  } catch (error) {
    there = true;
    fill(root, h("div", { class: "notice", role: "alert" }, h("h2", {}, "The form could not be prepared"), h("p", {}, error.message), h("button", { type: "button", class: "primary", on: { click: begin } }, "Try again")));
  }
}

function wishOfAddress() {
  try {
    return decode(location.hash);
  } catch {
    return null;
  }
}

/** The form for one experiment, filled in with a wish; choosing another experiment makes another form. */
async function planForm(experiments, wish) {
  const experiment = await api.experiment(wish.experiment);
  const known = new Map(experiment.declarations.map((declaration) => [declaration.name, declaration]));
  const changed = () => size.changed();
  const used = () => new Set([...axes.map((axis) => axis.name), ...fixed.map((one) => one.name)]);
  const unused = (preferred) => experiment.declarations.find(({ kind, name }) => preferred.includes(kind) && !used().has(name))?.name ?? experiment.declarations[0].name;

  let axes = [];
  const axisList = h("div", { class: "axes" });
  const addAxis = (given) => {
    const axis = axisRow(experiment.declarations, given, { changed, remove: () => drop(axes, axis, (rest) => (axes = rest)) });
    axes.push(axis);
    axisList.append(axis.element);
    number();
  };
  const number = () => axes.forEach((axis, index) => axis.number(index, axes.length > 1));

  let fixed = [];
  const fixedList = h("div", {});
  const addFixed = (name, value) => {
    const one = fixedRow(experiment.declarations, known, name, value, { changed, remove: () => drop(fixed, one, (rest) => (fixed = rest)) });
    fixed.push(one);
    fixedList.append(one.element);
  };
  const drop = (list, one, keep) => {
    keep(list.filter((other) => other !== one));
    one.element.remove();
    number();
    changed();
  };

  const methods = experiment.trackers.map(({ id, title, description }) => {
    const box = h("input", { type: "checkbox", value: id, checked: wish.trackers.includes(id), on: { change: changed } });
    return { box, label: h("label", { title: description }, box, title) };
  });
  const amounts = {
    trials: amount("Trials in each cell", wish.trials, 1, changed),
    frames: amount("Frames of a run", wish.frames ?? experiment.frames, 1, changed),
    seed: amount("Seed", wish.seed ?? 0, 0, changed),
  };
  const title = h("input", { type: "text", value: wish.title ?? "", maxlength: 200, placeholder: "Made up from the plan", "aria-label": "Title" });
  const chooser = h("select", { "aria-label": "Experiment", data: { field: "experiment" } }, experiments.map((each) => h("option", { value: each.id, selected: each.id === experiment.id }, each.title)));
  chooser.addEventListener("change", async () => {
    try {
      fill(root, await planForm(experiments, { ...(await sweeps.example(chooser.value)), experiment: chooser.value }));
      root.querySelector("select")?.focus();
    } catch (error) {
      showError(form, error);
    }
  });

  const read = () => ({
    ...(title.value.trim() === "" ? {} : { title: title.value.trim() }),
    experiment: experiment.id,
    axes: axes.map((axis) => axis.read()),
    trackers: methods.filter(({ box }) => box.checked).map(({ box }) => box.value),
    trials: amounts.trials.read(),
    frames: amounts.frames.read(),
    seed: amounts.seed.read(),
    parameters: Object.fromEntries(fixed.map((one) => [one.name, one.read()])),
  });

  const form = h(
    "form",
    { class: "plan-form", novalidate: true },
    h("section", { class: "plan-part" }, h("h2", {}, "Experiment"), chooser, h("p", { class: "hint" }, experiment.question, " ", experiment.description)),
    h(
      "section",
      { class: "plan-part", data: { field: "axes" } },
      h("h2", {}, "What is varied"),
      axisList,
      wrong(),
      h("div", {}, h("button", { type: "button", data: { role: "add-axis" }, on: { click: () => (addAxis({ name: unused(["integer", "number"]) }), changed()) } }, "Add an axis")),
      h("p", { class: "hint" }, "Axes multiply. A map shows two of them; further ones are pooled, and you can choose which."),
    ),
    h("section", { class: "plan-part", data: { field: "trackers" } }, h("h2", {}, "Methods"), h("div", { class: "methods" }, methods.map(({ label }) => label)), wrong(), h("p", { class: "hint" }, "All methods meet the same scenes and seeds.")),
    h("section", { class: "plan-part" }, h("h2", {}, "Runs"), h("div", { class: "plan-fields" }, Object.entries(amounts).map(([name, one]) => field(name, one.title, one.input)), h("div", { class: "grow" }, field("title", "Title, if you like", title)))),
    h(
      "section",
      { class: "plan-part", data: { field: "parameters" } },
      h("h2", {}, "Fixed parameters"),
      h("p", { class: "hint" }, "Everything that is not named here or varied has the experiment's own value."),
      fixedList,
      wrong(),
      h("div", {}, h("button", { type: "button", data: { role: "add-fixed" }, on: { click: () => (addFixed(unused(["integer", "number", "choice"])), changed()) } }, "Fix a parameter")),
    ),
  );
  const size = sizeCard(form, read, { sized: (estimate) => axes.forEach((axis) => axis.preview(estimate)) });
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    size.start();
  });
  wish.axes.forEach(addAxis);
  for (const [name, value] of Object.entries(wish.parameters ?? {})) addFixed(name, value);
  size.changed();
  return [form, size.element];
}

function amount(title, value, least, changed) {
  const input = h("input", { type: "number", value, min: least, step: 1, on: { input: changed } });
  return { title, input, read: () => (input.value.trim() === "" ? null : Number(input.value)) };
}

/** One parameter that has the same value in all runs. */
function fixedRow(declarations, known, name, value, { changed, remove }) {
  const element = h("div", { class: "fixed" });
  const one = { element, name: known.has(name) ? name : declarations[0].name };
  let input;
  const draw = (given) => {
    element.dataset.field = `parameters.${one.name}`;
    input = valueInput(known.get(one.name), given, changed);
    const choose = parameterSelect("Fixed parameter", declarations, one.name, (chosen) => {
      one.name = chosen;
      draw();
      changed();
    });
    fill(element, h("div", { class: "fixed-line" }, choose, input.element, h("button", { type: "button", class: "quiet", on: { click: remove } }, "Remove")), h("p", { class: "hint" }, known.get(one.name).description), wrong());
  };
  one.read = () => input.read();
  draw(value);
  return one;
}
