/**
 * Recording a clip with the camera: it is turned on by a button, shows what it sees, counts down, records, and goes off.
 * What was recorded is played, and kept or taken again. Leaving at any moment turns the camera off.
 */

import { messageOf } from "../../shared/api.js";
import { openDialog } from "../../shared/dialog.js";
import { fill, h, setText } from "../../shared/dom.js";
import { bytes } from "../../shared/format.js";
import { icon } from "../../shared/icons.js";
import { after } from "../../shared/timing.js";
import { Camera, obstacle, refusalOf } from "./camera.js";

/** @import { Child } from "../../shared/elements.js" */

const SHORTEST_S = 10;
const LONGEST_S = 30;
const COUNT_FROM = 3;
const SECOND_MS = 1000;

/**
 * Ask for a clip from the camera.
 *
 * @param {(clip: File) => void} take What is done with it.
 */
export function recordClip(take) {
  const dialog = new CameraDialog(take);
  dialog.open();
}

class CameraDialog {
  #take;
  #left = new AbortController();
  /** @type {Camera|null} */
  #camera = null;
  #close = () => {};
  /** @type {HTMLVideoElement} */
  #video = h("video", { playsinline: true, muted: true });
  #count = h("p", { class: "camera-count", "aria-hidden": "true", hidden: true });
  #stage = h("div", { class: "camera-stage", hidden: true }, this.#video, this.#count);
  #words = h("p", { role: "status" });
  #body = h("div", { class: "camera-body" });
  #buttons = h("footer");
  /** @type {HTMLInputElement} */
  #length = h("input", { type: "range", id: "camera-length", min: SHORTEST_S, max: LONGEST_S, step: 1, value: SHORTEST_S });
  #seconds = h("output", { for: "camera-length" });

  /** @param {(clip: File) => void} take */
  constructor(take) {
    this.#take = take;
    this.#length.addEventListener("input", () => this.#tellLength());
    this.#tellLength();
    // As an attribute it would not count for an element that a script has made.
    this.#video.muted = true;
  }

  open() {
    const element = openDialog(
      "Use the camera",
      (close) => {
        this.#close = close;
        return [h("div", { class: "camera" }, this.#stage, this.#words, this.#body, this.#buttons)];
      },
      { wide: true },
    );
    element.addEventListener("close", () => this.#leave());
    addEventListener("pagehide", () => this.#close(), { signal: this.#left.signal });
    const refused = obstacle();
    if (refused === null) this.#introduce();
    else this.#refuse(refused, false);
  }

  get #hasLeft() {
    return this.#left.signal.aborted;
  }

  #leave() {
    this.#left.abort();
    this.#turnOff();
    this.#show(null);
  }

  #turnOff() {
    this.#camera?.off();
    this.#camera = null;
  }

  /** @param {MediaStream|File|null} shown What the stage shows. */
  #show(shown) {
    const video = this.#video;
    if (video.src) URL.revokeObjectURL(video.src);
    video.removeAttribute("src");
    video.srcObject = shown instanceof MediaStream ? shown : null;
    if (shown instanceof File) video.src = URL.createObjectURL(shown);
    video.controls = video.loop = shown instanceof File;
    video.setAttribute("aria-label", shown instanceof File ? "The recorded clip" : "What the camera sees");
    this.#stage.hidden = shown === null;
    // It may be taken away before it plays.
    if (shown) video.play().catch(() => {});
  }

  /**
   * Say what is going on, with what can be done; the last button is the one that leads on.
   *
   * @param {string} words
   * @param {HTMLButtonElement[]} buttons
   * @param {...Child} body
   */
  #tell(words, buttons, ...body) {
    setText(this.#words, words);
    this.#words.className = "";
    fill(this.#body, ...body);
    fill(this.#buttons, ...buttons);
    buttons.at(-1)?.focus();
  }

  #introduce() {
    this.#tell(
      `Record ${SHORTEST_S} to ${LONGEST_S} s, without sound, and track something in it.`,
      [this.#button("Cancel", () => this.#close()), this.#button("Turn on the camera", () => this.#turnOn(), "primary")],
      h(
        "p",
        { class: "hint" },
        "The clip stays in this browser until you press ",
        h("strong", {}, "Use this clip"),
        ". Then this server keeps it with the uploads, which whoever may use the server can see, until somebody deletes it under My work.",
      ),
    );
  }

  /** @param {string} [id] Which camera. */
  async #turnOn(id) {
    this.#turnOff();
    this.#show(null);
    this.#tell("Waiting for the camera. The browser may ask whether this page may use it.", [this.#button("Cancel", () => this.#close())]);
    try {
      const camera = await Camera.on(id);
      if (this.#hasLeft) {
        camera.off();
        return;
      }
      this.#camera = camera;
      const cameras = await Camera.all();
      if (!this.#hasLeft) this.#preview(camera, cameras);
    } catch (error) {
      if (!this.#hasLeft) this.#refuse(refusalOf(error), true);
    }
  }

  /**
   * @param {Camera} camera
   * @param {MediaDeviceInfo[]} cameras
   */
  #preview(camera, cameras) {
    this.#show(camera.stream);
    /** @type {HTMLSelectElement} */
    const choice = h(
      "select",
      { id: "camera-choice" },
      cameras.map(({ deviceId, label }, index) => h("option", { value: deviceId, selected: deviceId === camera.id }, label || `Camera ${index + 1}`)),
    );
    choice.addEventListener("change", () => this.#turnOn(choice.value));
    this.#tell(
      "This is what will be recorded. Keep the camera still, and the whole target in the picture.",
      [this.#button("Cancel", () => this.#close()), this.#button("Record", () => this.#record(camera), "primary")],
      cameras.length > 1 && [h("label", { for: "camera-choice" }, "Camera"), choice],
      h("label", { for: "camera-length" }, "Length ", this.#seconds),
      this.#length,
    );
  }

  /** @param {Camera} camera */
  async #record(camera) {
    const given = new AbortController();
    const signal = AbortSignal.any([given.signal, this.#left.signal]);
    const back = async () => {
      given.abort();
      this.#count.hidden = true;
      this.#preview(camera, await Camera.all());
    };
    this.#tell("Recording begins in a moment", [this.#button("Stop", back)]);
    this.#count.hidden = false;
    for (let left = COUNT_FROM; left > 0; left -= 1) {
      setText(this.#count, String(left));
      await after(SECOND_MS, signal);
    }
    this.#count.hidden = true;
    const seconds = Number(this.#length.value);
    const meter = h("progress", { max: seconds, value: 0, "aria-label": "Recorded" });
    const elapsed = h("output", { class: "camera-elapsed" }, `0.0 of ${seconds} s`);
    try {
      const recording = camera.record(seconds, (now) => {
        meter.value = now;
        setText(elapsed, `${Math.min(now, seconds).toFixed(1)} of ${seconds} s`);
      });
      this.#tell("Recording", [this.#button("Stop", recording.stop)], h("p", { class: "camera-recording" }, meter, elapsed));
      const clip = await recording.done;
      if (this.#hasLeft) return;
      this.#turnOff();
      this.#review(clip);
    } catch (error) {
      this.#turnOff();
      if (!this.#hasLeft) this.#refuse(messageOf(error), true);
    }
  }

  /** @param {File} clip */
  #review(clip) {
    this.#show(clip);
    this.#tell(`The camera is off. The clip has ${bytes(clip.size)}, and is only in this browser yet.`, [
      this.#button("Cancel", () => this.#close()),
      this.#button("Record again", () => this.#turnOn()),
      this.#button(
        "Use this clip",
        () => {
          this.#close();
          this.#take(clip);
        },
        "primary",
      ),
    ]);
  }

  /**
   * @param {string} message
   * @param {boolean} again Whether it may go better another time.
   */
  #refuse(message, again) {
    this.#show(null);
    this.#tell(message, [
      this.#button("Close", () => this.#close()),
      ...(again ? [this.#button("Try again", () => this.#turnOn(), "primary")] : []),
    ]);
    this.#words.className = "wrong";
  }

  #tellLength() {
    setText(this.#seconds, `${this.#length.value} s`);
  }

  /**
   * @param {string} words
   * @param {() => void} run
   * @param {string} [kind]
   */
  #button(words, run, kind) {
    return h("button", { type: "button", class: kind, on: { click: run } }, words);
  }
}

/** What leads to it. */
export function cameraButton(/** @type {(clip: File) => void} */ take) {
  return h("button", { type: "button", data: { role: "camera" }, on: { click: () => recordClip(take) } }, icon("camera"), "Use the camera");
}
