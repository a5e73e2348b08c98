/** A table of what is truly so in an upload: given by a file, checked by the server, and kept until it is removed. */

import { api } from "./api.js";
import { fill, h } from "./dom.js";
import { count } from "./format.js";

/**
 * @param {HTMLElement} root
 * @param {object} upload
 * @param {object} experiment
 * @param {(busy: boolean) => void} changed
 */
export async function truthField(root, upload, experiment, changed) {
  const columns = `With the columns ${experiment.truth_columns.join(", ")}; frames count from 0`;

  const label = () => h("label", { for: "target-truth" }, "Truth (CSV, optional)");

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
    fill(root, label(), picker, words);
    changed(false);
  }

  function tell(truth) {
    fill(
      root,
      label(),
      h(
        "p",
        { class: "truth-kept", id: "target-truth" },
        `Truth of ${count(truth.frames, "frame")}, ${truth.first} to ${truth.last}`,
        h("button", { type: "button", on: { click: remove } }, "Remove"),
      ),
      truth.warnings.map((warning) => h("p", { class: "note" }, warning)),
    );
    changed(false);
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

  ask();
  try {
    const kept = await api.truth(upload.id, experiment.id);
    if (kept && root.querySelector("#target-truth")?.files?.length === 0) tell(kept);
  } catch {
    // Then it can be given anew.
  }
}
