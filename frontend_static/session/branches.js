/** Branches: the legend of the plots, which switches between them, and the dialog that makes a new one. */

import { openDialog } from "../shared/dialog.js";
import { fill, h } from "../shared/dom.js";
import { coalesce } from "../shared/timing.js";

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
 * Ask with which tracker to go on from the frame that is shown.
 *
 * @param {import("./mount.js").Mounted} view
 * @param {string|undefined} preferred The tracker to offer first, unless it is the one in charge.
 */
export function branchDialog({ store, commands, steering }, preferred) {
  const { session } = store;
  if (session === null) return;
  steering.pause();
  // Nothing follows the last frame.
  const frame = session.branch_point ?? session.position;
  const others = session.trackers.filter((tracker) => tracker.id !== session.tracker);
  const other = others.find((tracker) => tracker.id === preferred) ?? others[0] ?? session.trackers[0];
  openDialog(`Branch from frame ${frame}`, (close) => {
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
    return [
      h(
        "form",
        {
          method: "dialog",
          on: {
            submit: async (event) => {
              event.preventDefault();
              go.disabled = true;
              const made = await commands.branch({ frame, tracker: tracker.value, ...(title.value.trim() && { title: title.value.trim() }) });
              go.disabled = false;
              if (made) close();
            },
          },
        },
        h("p", {}, "The branch shares all frames up to this one. From the next frame on it is computed separately, with the same random numbers."),
        h("label", { for: "branch-tracker" }, "Tracker"),
        tracker,
        h("label", { for: "branch-title" }, "Name (optional)"),
        title,
        h("footer", {}, h("button", { type: "button", on: { click: close } }, "Cancel"), go),
      ),
    ];
  });
}

/**
 * Whether the choices of a list are shown, so that Enter takes one of them.
 *
 * @param {HTMLSelectElement} list
 */
function isOpen(list) {
  return CSS.supports("selector(:open)") && list.matches(":open");
}
