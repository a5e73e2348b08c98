/**
 * The camera of this computer while it is on, and the clip that it records. Nothing here sends anything; what is recorded
 * is a file like any other, which the upload takes.
 */

import { later } from "../../shared/timing.js";

/** What is asked of a camera: as many pixels as trackers need, so that half a minute is a few megabytes. */
const WANTED = { width: { ideal: 640 }, height: { ideal: 480 }, frameRate: { ideal: 30 } };
const BITS_PER_SECOND = 4_000_000;
/** What browsers record, the one that is decoded fastest first; Safari has the last alone. */
const FORMATS = ["video/webm;codecs=vp8", "video/webm", "video/mp4"];
const TELL_EVERY_MS = 100;

/** Why a browser does not give a camera, by the name of its error. */
const REFUSALS = new Map([
  ["NotAllowedError", "The browser does not let this page use the camera. Allow it beside the address of this page, then try again."],
  ["NotFoundError", "No camera was found. Connect one, then try again."],
  ["NotReadableError", "The camera does not start; another program may use it. Close that program, then try again."],
]);

/** @typedef {{done: Promise<File>, stop: () => void}} Recording */

/** What keeps this page from using any camera, in a sentence; null if nothing does. */
export function obstacle() {
  if (!isSecureContext) {
    return (
      "Browsers give the camera only to pages that come over https, or from this computer itself (http://localhost). " +
      `This page comes over http from ${location.host}. Whoever runs the server can put it behind https.`
    );
  }
  if (!navigator.mediaDevices || !globalThis.MediaRecorder) return "This browser cannot record from a camera.";
  return null;
}

/**
 * Why the camera does not start, in a sentence.
 *
 * @param {unknown} error
 */
export function refusalOf(error) {
  const name = error instanceof DOMException ? error.name : "";
  return REFUSALS.get(name) ?? `The camera does not start (${error instanceof Error ? error.message || error.name : error}).`;
}

export class Camera {
  /** @param {MediaStream} stream */
  constructor(stream) {
    this.stream = stream;
  }

  /**
   * Turn a camera on; the browser asks for leave, and its light is on until `off`.
   *
   * @param {string} [id] Which; without one the browser chooses, on a phone the one that looks away.
   */
  static async on(id) {
    const which = id === undefined ? { facingMode: { ideal: "environment" } } : { deviceId: { exact: id } };
    return new Camera(await navigator.mediaDevices.getUserMedia({ video: { ...WANTED, ...which }, audio: false }));
  }

  /** All cameras, as far as the browser tells. */
  static async all() {
    const devices = await navigator.mediaDevices.enumerateDevices();
    return devices.filter(({ kind, deviceId }) => kind === "videoinput" && deviceId !== "");
  }

  get id() {
    return this.stream.getVideoTracks()[0]?.getSettings().deviceId;
  }

  off() {
    for (const track of this.stream.getTracks()) track.stop();
  }

  /**
   * Record a clip, which ends by itself, when it is stopped, or with the camera.
   *
   * @param {number} seconds
   * @param {(elapsed: number) => void} tell Called with the seconds so far.
   * @returns {Recording}
   */
  record(seconds, tell) {
    const mimeType = FORMATS.find((format) => MediaRecorder.isTypeSupported(format));
    const recorder = new MediaRecorder(this.stream, { videoBitsPerSecond: BITS_PER_SECOND, ...(mimeType && { mimeType }) });
    const ended = new AbortController();
    /** @type {Blob[]} */
    const parts = [];
    const stop = () => {
      if (recorder.state !== "inactive") recorder.stop();
    };
    /** @type {Promise<File>} */
    const done = new Promise((resolve, reject) => {
      recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
      recorder.addEventListener("start", () => {
        const since = performance.now();
        const telling = setInterval(() => tell((performance.now() - since) / 1000), TELL_EVERY_MS);
        ended.signal.addEventListener("abort", () => clearInterval(telling));
        later(stop, seconds * 1000, ended.signal);
      });
      recorder.addEventListener("error", () => reject(new Error("The browser could not go on recording.")));
      recorder.addEventListener("stop", () => {
        ended.abort();
        const clip = new File(parts, nameOf(recorder.mimeType), { type: recorder.mimeType });
        if (clip.size > 0) resolve(clip);
        else reject(new Error("The camera gave no picture."));
      });
    });
    recorder.start();
    return { done, stop };
  }
}

/**
 * What a clip is called: when it was recorded, with the ending of its format.
 *
 * @param {string} mimeType
 */
function nameOf(mimeType) {
  const now = new Date();
  const local = new Date(now.getTime() - 60_000 * now.getTimezoneOffset());
  return `camera ${local.toISOString().slice(0, 19).replace("T", " ").replaceAll(":", ".")}.${mimeType.includes("mp4") ? "mp4" : "webm"}`;
}
