/** After an upload: which frame to begin with, what to follow, and how. */

import { api } from "../shared/api.js";
import { fill, h, setText } from "../shared/dom.js";
import { count } from "../shared/format.js";
import { throttle } from "../shared/timing.js";
import { BoxTarget } from "./marks/target_box.js";
import { PointsTarget } from "./marks/target_points.js";
import { truthField } from "./truth.js";

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
  const truth = h("div");

  let target = null;
  let busy = false;
  let settled = false;

  const check = () => {
    go.disabled = busy || !target?.footage;
    wrong.hidden = true;
  };
  const tellFrame = () => setText(at, `${start.value} / ${upload.frames}`);
  const show = throttle(() => {
    tellFrame();
    target.show(Number(start.value));
    if (settled) target.find({ alone: true });
    settled = false;
  }, PICTURE_EVERY_MS);
  start.addEventListener("input", show);
  start.addEventListener("change", () => {
    settled = true;
    show();
  });

  const chosen = () => able.find(({ id }) => id === experiment.value);
  const describe = () => setText(about, chosen()?.trackers.find(({ id }) => id === tracker.value)?.description ?? "");
  const list = () => {
    const { trackers, default_tracker: preferred } = chosen();
    fill(tracker, trackers.map(({ id, title }) => h("option", { value: id, selected: id === preferred }, title)));
    describe();
  };
  const follow = () => {
    const on = {
      changed: check,
      moved: (frame) => {
        start.value = frame;
        tellFrame();
      },
    };
    target?.leave();
    target = chosen().finds ? new PointsTarget(stage, upload, chosen(), on) : new BoxTarget(stage, upload, on);
    tellFrame();
    target.show(Number(start.value));
    check();
    target.find();
    truthField(truth, upload, chosen(), (isBusy) => {
      busy = isBusy;
      check();
    });
  };
  experiment.addEventListener("change", () => {
    list();
    follow();
  });
  tracker.addEventListener("change", describe);

  const submit = async (event) => {
    event.preventDefault();
    go.disabled = true;
    try {
      const recipe = { experiment: experiment.value, tracker: tracker.value, footage: target.footage };
      const session = await api.start({ recipe, upload: upload.id });
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
        able.length > 1 && [h("label", { for: "target-experiment" }, "Experiment"), experiment],
        h("label", { for: "target-start" }, "Start at frame ", at),
        start,
        h("label", { for: "target-tracker" }, "Tracker"),
        tracker,
        about,
        truth,
        wrong,
        h("footer", {}, h("button", { type: "button", on: { click: () => (target?.leave(), cancel()) } }, "Cancel"), go),
      ),
    ),
  );
  if (able.length === 0) return;
  list();
  follow();
  target.focus();
}
