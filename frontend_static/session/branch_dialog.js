/** The dialog that makes a branch: from which frame to go on, with which tracker and which parameters. */

import { openDialog } from "../shared/dialog.js";
import { elementOf } from "../shared/dom.js";
import { h, html, useSignal } from "../vendor/preact.js";
import { DeclaredControl } from "./panel/control.js";

/** @import { SessionPublic } from "../shared/messages.js" */
/** @import { Mounted } from "./mount.js" */
/** @import { Values } from "./panel/proposals.js" */

/**
 * @param {Mounted} view
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
  openDialog("Branch", (close) => [elementOf(h(Branch, { session, commands, last, first: other.id, close }))]);
}

/** @param {{session: SessionPublic, commands: Mounted["commands"], last: number, first: string, close: () => void}} props `first` is a tracker. */
function Branch({ session, commands, last, first, close }) {
  const changed = useSignal(/** @type {Values} */ ({}));
  const isSending = useSignal(false);
  const submit = async (/** @type {Event & {currentTarget: HTMLFormElement}} */ event) => {
    event.preventDefault();
    const { frame, tracker, title } = /** @type {Record<string, string>} */ (Object.fromEntries(new FormData(event.currentTarget)));
    isSending.value = true;
    const values = { ...changed.value, tracker };
    const made = await commands.branch({ frame: Number(frame), values, ...(title.trim() && { title: title.trim() }) });
    isSending.value = false;
    if (made) close();
  };
  // A list that has the focus keeps Enter to itself, where a field would send the form off; unless it is open.
  const press = (/** @type {KeyboardEvent & {currentTarget: HTMLSelectElement}} */ event) => {
    const list = event.currentTarget;
    if (event.key !== "Enter" || (CSS.supports("selector(:open)") && list.matches(":open"))) return;
    event.preventDefault();
    list.form?.requestSubmit();
  };
  const turned = session.declarations.filter(({ name, live, kind }) => name in session.parameters && live && kind !== "file");
  const controls = (/** @type {boolean} */ isFirst) =>
    turned
      .filter(({ name }) => session.about.includes(name) === isFirst)
      .map((declaration) => {
        const { name } = declaration;
        const propose = (/** @type {Values[string]} */ value) => (changed.value = { ...changed.value, [name]: value });
        return h(DeclaredControl, { key: name, declaration, value: changed.value[name] ?? session.parameters[name], propose });
      });
  const [about, rest] = [controls(true), controls(false)];
  const trackers = session.trackers.map(({ id, title }) => {
    return html`<option value=${id} selected=${id === first}>${id === session.tracker ? `${title} (as now)` : title}</option>`;
  });
  return html`<form method="dialog" onSubmit=${submit}>
    <p>The branch shares all frames up to this one. From the next frame on it is computed separately, with the same random numbers.</p>
    <label for="branch-frame">From frame (0 to ${last})</label>
    <input id="branch-frame" name="frame" type="number" min="0" max=${last} step="1" required defaultValue=${Math.min(session.position, last)} />
    <label for="branch-tracker">Tracker</label>
    <select id="branch-tracker" name="tracker" autofocus onKeyDown=${press}>${trackers}</select>
    <div class="branch-parameters" role="group" aria-label="Parameters from the next frame on">
      ${about}
      ${rest.length > 0 && html`<details><summary>${about.length > 0 ? "More" : "Parameters"}</summary>${rest}</details>`}
    </div>
    <label for="branch-title">Name (optional)</label>
    <input id="branch-title" name="title" type="text" maxlength="60" placeholder="default: tracker and frame" />
    <footer>
      <button type="button" onClick=${close}>Cancel</button>
      <button type="submit" class="primary" disabled=${isSending.value}>Branch here</button>
    </footer>
  </form>`;
}
