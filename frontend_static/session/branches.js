/** Branches: the legend of the plots, which switches between them, and the dialog that makes a new one. */

import { openDialog } from "../shared/dialog.js";
import { fill, h } from "../shared/dom.js";
import { coalesce } from "../shared/timing.js";
import { makeControl } from "./panel/control.js";

/** @import { Value } from "../shared/format.js" */
/** @import { SessionPublic } from "../shared/messages.js" */

/**
 * @param {HTMLElement} root
 * @param {import("./mount.js").Mounted} view
 */
export function branchLegend(root, { store, commands, signal }) {
  let shown = "";
  const draw = coalesce(() => {
    const { session } = store;
    if (session === null) return;
    const { branches } = session;
    const now = JSON.stringify([session.branch, branches]);
    if (now === shown) return;
    shown = now;
    root.hidden = branches.length < 2;
    fill(
      root,
      branches.map((branch) => {
        const swatch = h("span", { class: "swatch" });
        swatch.style.background = branch.colour;
        const active = branch.id === session.branch;
        const title = branch.parent ? `Branched from frame ${branch.frame}` : "The run as it began";
        const content = [swatch, h("span", {}, branch.title)];
        if (store.isReadOnly) return h("span", { class: "chip", title, "aria-current": active ? "true" : null }, content);
        const activate = () => active || commands.activate(branch.id);
        return h("button", { type: "button", class: "chip", "aria-pressed": String(active), title, on: { click: activate } }, content);
      }),
    );
  }, signal);
  store.on(["branch", "branches"], draw);
}

/**
 * Ask from which frame to go on, with which tracker and which parameters.
 *
 * @param {import("./mount.js").Mounted} view
 * @param {string|undefined} preferred The tracker to offer first, unless it is the one in charge.
 */
export function branchDialog({ store, commands, steering }, preferred) {
  const { session } = store;
  if (session === null) return;
  steering.pause();
  // After the last frame of a run there is nothing more to compute.
  const last = Math.min(session.computed, session.frames - 2);
  if (last < 0) return;
  const others = session.trackers.filter((tracker) => tracker.id !== session.tracker);
  const other = others.find((tracker) => tracker.id === preferred) ?? others[0] ?? session.trackers[0];
  /** @type {Record<string, Value>} What was changed. */
  const values = {};
  openDialog("Branch", (close) => {
    const frame = h("input", { id: "branch-frame", type: "number", min: 0, max: last, step: 1, required: true, value: Math.min(session.position, last) });
    const tracker = h(
      "select",
      { id: "branch-tracker", autofocus: true },
      session.trackers.map(({ id, title }) => h("option", { value: id, selected: id === other.id }, id === session.tracker ? `${title} (as now)` : title)),
    );
    const title = h("input", { id: "branch-title", type: "text", maxlength: 60, placeholder: "default: tracker and frame" });
    const go = h("button", { type: "submit", class: "primary" }, "Branch here");
    tracker.addEventListener("keydown", (event) => {
      // A list that has the focus keeps this key to itself, where a field would send the form off.
      if (event.key !== "Enter" || isOpen(tracker)) return;
      event.preventDefault();
      tracker.form?.requestSubmit(go);
    });
    const submit = async (/** @type {Event} */ event) => {
      event.preventDefault();
      go.disabled = true;
      const name = title.value.trim();
      const wanted = { frame: frame.valueAsNumber, values: { ...values, tracker: tracker.value }, ...(name && { title: name }) };
      const made = await commands.branch(wanted);
      go.disabled = false;
      if (made) close();
    };
    return [
      h(
        "form",
        { method: "dialog", on: { submit } },
        h("p", {}, "The branch shares all frames up to this one. From the next frame on it is computed separately, with the same random numbers."),
        h("label", { for: "branch-frame" }, `From frame (0 to ${last})`),
        frame,
        h("label", { for: "branch-tracker" }, "Tracker"),
        tracker,
        parameters(session, values),
        h("label", { for: "branch-title" }, "Name (optional)"),
        title,
        h("footer", {}, h("button", { type: "button", on: { click: close } }, "Cancel"), go),
      ),
    ];
  });
}

/**
 * The parameters that may change within a run: those that it is about, and folded all others.
 *
 * @param {SessionPublic} session
 * @param {Record<string, Value>} values Takes what is changed.
 */
function parameters(session, values) {
  const made = session.declarations.flatMap((declaration) => {
    const { name, live, kind } = declaration;
    if (!(name in session.parameters) || !live || kind === "file") return [];
    const control = makeControl(declaration, session.parameters[name], (value) => (values[name] = value));
    control.show(session.parameters[name]);
    return [{ name, element: control.element }];
  });
  const [first, rest] = [true, false].map((isFirst) => made.filter(({ name }) => session.about.includes(name) === isFirst).map(({ element }) => element));
  const more = rest.length > 0 && h("details", {}, h("summary", {}, first.length > 0 ? "More parameters" : "Parameters"), rest);
  return h("div", { class: "branch-parameters", role: "group", "aria-label": "Parameters from the next frame on" }, first, more);
}

/**
 * Whether the choices of a list are shown, so that Enter takes one of them.
 *
 * @param {HTMLSelectElement} list
 */
function isOpen(list) {
  return CSS.supports("selector(:open)") && list.matches(":open");
}
