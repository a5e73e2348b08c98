/** One axis of a plan: a parameter, and from where to where in which steps, or a list of its values. */

import { fill, h, setText } from "../shared/dom.js";
import { bounds, numberOf, parameterSelect, wrong } from "./fields.js";

const NUMBERS = ["integer", "number"];
const STEPS = 5;

/**
 * @param {object[]} declarations The experiment's parameters.
 * @param {object} given What the axis is at first.
 * @param {{changed: () => void, remove: () => void}} on
 */
export function axisRow(declarations, given, on) {
  const known = new Map(declarations.map((declaration) => [declaration.name, declaration]));
  const element = h("div", { class: "axis", role: "group" });
  const words = h("p", { class: "hint" });
  const axis = { element, name: known.has(given.name) ? given.name : declarations[0].name };
  let place = 0;
  let removable = true;
  let form = given.values ? "list" : "range";
  let inputs = null;

  function draw(values) {
    const declaration = known.get(axis.name);
    const numerical = NUMBERS.includes(declaration.kind);
    if (!numerical) form = "list";
    inputs = !numerical && declaration.choices.length + (declaration.kind === "boolean") > 0 ? choiceInputs(declaration, values, on.changed) : form === "range" ? rangeInputs(declaration, values, on.changed) : listInput(declaration, values, on.changed);
    const choose = parameterSelect("Varied parameter", declarations, axis.name, (name) => {
      axis.name = name;
      form = "range";
      draw({});
      on.changed();
    });
    choose.dataset.field = `axes.${place}.name`;
    const shape = (name, text) =>
      h(
        "button",
        {
          type: "button",
          "aria-pressed": String(form === name),
          on: {
            click: () => {
              if (form === name) return;
              form = name;
              draw(inputs.read());
              on.changed();
            },
          },
        },
        text,
      );
    fill(
      element,
      h("div", { class: "axis-head" }, choose, numerical && h("span", { class: "segments" }, shape("range", "Range"), shape("list", "List")), removable && h("button", { type: "button", class: "quiet", on: { click: on.remove } }, "Remove")),
      inputs.element,
      wrong(),
      words,
    );
    setText(words, [declaration.description, bounds(declaration) && `Allowed ${bounds(declaration)}.`].filter(Boolean).join(" "));
    for (const [name, input] of Object.entries(inputs.fields)) input.dataset.field = `axes.${place}.${name}`;
  }

  axis.read = () => ({ name: axis.name, ...inputs.read() });
  axis.number = (index, canGo) => {
    const same = index === place && canGo === removable && inputs !== null;
    [place, removable] = [index, canGo];
    element.dataset.field = `axes.${index}`;
    element.setAttribute("aria-label", `Axis ${index + 1}`);
    if (!same) draw(inputs === null ? given : inputs.read());
  };
  axis.preview = (estimate) => {
    const found = estimate?.axes[place];
    if (!found || found.name !== axis.name) return;
    const unit = known.get(axis.name).unit;
    const shown = found.first.slice(0, 12).join(", ");
    setText(words, `${found.count} ${found.count === 1 ? "value" : "values"}: ${shown}${found.count > 12 ? ", …" : ""}${unit ? ` ${unit}` : ""}. ${bounds(known.get(axis.name)) ? `Allowed ${bounds(known.get(axis.name))}.` : ""}`);
  };
  return axis;
}

function rangeInputs(declaration, given, changed) {
  const { minimum, maximum, step, unit } = declaration;
  const numbers = (given.values ?? []).filter((value) => typeof value === "number");
  const start = given.start ?? numbers[0] ?? declaration.default;
  const by = given.step ?? (numbers.length > 1 ? Number((numbers[1] - numbers[0]).toPrecision(6)) : step ?? 1);
  const stop = given.stop ?? numbers.at(-1) ?? Math.min(maximum ?? Infinity, Number((start + (STEPS - 1) * by).toPrecision(10)));
  const input = (label, value) => h("input", { type: "number", value, min: label === "Step" ? null : minimum, max: label === "Step" ? null : maximum, step: "any", "aria-label": label, on: { input: changed } });
  const fields = { start: input("From", start), stop: input("To", stop), step: input("Step", by) };
  return {
    element: h("div", { class: "axis-values" }, "from ", fields.start, " to ", fields.stop, " in steps of ", fields.step, unit),
    fields,
    read: () => ({ start: numberOf(fields.start), stop: numberOf(fields.stop), step: numberOf(fields.step) }),
  };
}

function listInput(declaration, given, changed) {
  const numerical = NUMBERS.includes(declaration.kind);
  const values = given.values ?? series(given) ?? [declaration.default];
  const input = h("input", { type: "text", value: values.join(", "), "aria-label": "Values, separated by commas", inputmode: numerical ? "decimal" : null, on: { input: changed } });
  const one = (text) => (numerical && Number.isFinite(Number(text)) ? Number(text) : text);
  const read = () => input.value.split(/[,;\s]+/).filter(Boolean).map(one);
  return { element: h("div", { class: "axis-values" }, input, declaration.unit), fields: { values: input }, read: () => ({ values: read() }) };
}

function choiceInputs(declaration, given, changed) {
  const boolean = declaration.kind === "boolean";
  const options = boolean ? ["false", "true"] : declaration.choices;
  const chosen = (given.values ?? options).map(String);
  const boxes = options.map((value) => h("input", { type: "checkbox", value, checked: chosen.includes(value), on: { change: changed } }));
  const element = h("div", { class: "axis-values" }, boxes.map((box) => h("label", {}, box, box.value)));
  const read = () => boxes.filter((box) => box.checked).map((box) => (boolean ? box.value === "true" : box.value));
  return { element, fields: { values: element }, read: () => ({ values: read() }) };
}

/** The values of a short range, to go on editing as a list. */
function series({ start, stop, step }) {
  if (![start, stop, step].every(Number.isFinite) || step === 0) return null;
  const count = Math.floor((stop - start) / step + 1e-9) + 1;
  if (count < 1 || count > 100) return null;
  return Array.from({ length: count }, (_, index) => Number((start + index * step).toPrecision(10)));
}
