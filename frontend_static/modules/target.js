/** After an upload: which frame to begin with, what to follow, and how. */

import { api } from "./api.js";
import { BoxEditor } from "./box.js";
import { fill, h, setText } from "./dom.js";
import { count } from "./format.js";
import { throttle } from "./pace.js";

const PICTURE_EVERY_MS = 80;

/**
 * @param {HTMLElement} root
 * @param {object} upload
 * @param {object[]} experiments
 * @param {() => void} cancel
 */
export function targetForm(root, upload, experiments, cancel) {
  const able = experiments.filter((experiment) => experiment.accepts_video);
  const go = h("button", { type: "submit", class: "primary", disabled: true }, "Track it");
  const wrong = h("p", { class: "wrong", role: "alert", hidden: true });
  const experiment = h("select", { id: "target-experiment" }, able.map(({ id, title }) => h("option", { value: id }, title)));
  const tracker = h("select", { id: "target-tracker" });
  const about = h("p", { class: "hint" });
  const at = h("output", {}, "0");
  const start = h("input", { type: "range", min: 0, max: Math.max(0, upload.frames - 1), value: 0, step: 1, id: "target-start" });
  const stage = h("div", { class: "target-stage" });

  const editor = new BoxEditor(stage, (box) => {
    go.disabled = box === null;
    wrong.hidden = true;
  });
  const picture = throttle(() => {
    setText(at, `${start.value} / ${upload.frames}`);
    editor.show(api.pictureAddress(upload.id, Number(start.value)), upload.width, upload.height);
  }, PICTURE_EVERY_MS);
  start.addEventListener("input", picture);

  const chosen = () => able.find(({ id }) => id === experiment.value);
  const describe = () => setText(about, chosen()?.trackers.find(({ id }) => id === tracker.value)?.description ?? "");
  const list = () => {
    const { trackers, default_tracker: preferred } = chosen();
    fill(tracker, trackers.map(({ id, title }) => h("option", { value: id, selected: id === preferred }, title)));
    describe();
  };
  experiment.addEventListener("change", list);
  tracker.addEventListener("change", describe);

  const submit = async (event) => {
    event.preventDefault();
    go.disabled = true;
    try {
      const session = await api.start({
        experiment: experiment.value,
        tracker: tracker.value,
        upload: upload.id,
        box: editor.box,
        start: Number(start.value),
      });
      location.assign(session.page);
    } catch (error) {
      setText(wrong, error.message);
      wrong.hidden = false;
      go.disabled = false;
    }
  };

  fill(
    root,
    h(
      "form",
      { class: "target", on: { submit } },
      h(
        "header",
        {},
        h("h2", {}, "What shall be followed?"),
        h("p", { class: "hint" }, `${upload.name}, ${count(upload.frames, "frame")} of ${upload.width} × ${upload.height} px at ${Number(upload.frame_rate_hz.toPrecision(4))} Hz`),
        (upload.warnings ?? []).map((warning) => h("p", { class: "note" }, warning)),
      ),
      stage,
      h(
        "div",
        { class: "target-choices" },
        h("label", { for: "target-start" }, "Start at frame ", at),
        start,
        able.length > 1 && [h("label", { for: "target-experiment" }, "Experiment"), experiment],
        h("label", { for: "target-tracker" }, "Tracker"),
        tracker,
        about,
        wrong,
        h("footer", {}, h("button", { type: "button", on: { click: cancel } }, "Cancel"), go),
      ),
    ),
  );
  if (able.length > 0) list();
  picture();
  editor.focus();
}
