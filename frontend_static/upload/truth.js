/** A table of what is truly so in an upload: given by a file, checked by the server, and kept until it is removed. */

import { api } from "../shared/api.js";
import { fill, h } from "../shared/dom.js";
import { count } from "../shared/format.js";

/**
 * @param {HTMLElement} root
 * @param {object} upload
 * @param {object} experiment
 * @param {(busy: boolean) => void} changed
 */
export async function truthField(root, upload, experiment, changed) {
  const columns = `With the columns ${experiment.truth_columns.join(", ")}; frames count from 0`;

  const title = "Truth (CSV, optional)";
  // Once the field of another experiment has taken its place, nobody sees any more what becomes of this one.
  const field = h("div", { class: "target-truth" });
  fill(root, field);
  const done = () => field.isConnected && changed(false);

  function ask(refused) {
    const picker = h("input", {
      type: "file",
      id: "target-truth",
      accept: ".csv,text/csv",
      "aria-describedby": "target-truth-words",
      "aria-invalid": String(Boolean(refused)),
      on: { change: () => picker.files.length > 0 && give([...picker.files]) },
    });
    const words = refused ? h("p", { class: "wrong", role: "alert", id: "target-truth-words" }, refused) : h("p", { class: "hint", id: "target-truth-words" }, columns);
    fill(field, h("label", { for: "target-truth" }, title), picker, words);
    done();
    return picker;
  }

  function tell(truth) {
    fill(
      field,
      h("p", { class: "truth-title" }, title),
      h(
        "p",
        { class: "truth-kept" },
        `Truth of ${count(truth.frames, "frame")}, ${truth.first} to ${truth.last}`,
        h("button", { type: "button", "aria-label": "Remove the truth", on: { click: remove } }, "Remove"),
      ),
      truth.warnings.map((warning) => h("p", { class: "note" }, warning)),
    );
    done();
  }

  async function give(files) {
    changed(true);
    try {
      tell(await api.giveTruth(upload.id, experiment.id, files));
    } catch (error) {
      ask(error.message);
    }
  }

  async function remove() {
    changed(true);
    try {
      await api.removeTruth(upload.id, experiment.id);
      ask();
    } catch (error) {
      ask(error.message);
    }
  }

  const picker = ask();
  try {
    const kept = await api.truth(upload.id, experiment.id);
    if (kept && picker.isConnected && picker.files.length === 0) tell(kept);
  } catch {
    // Then it can be given again.
  }
}
