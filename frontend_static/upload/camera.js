/** Recording a clip with this computer's camera: a button turns it on, its picture is shown, a countdown runs, and after recording it turns
 off. The clip is played, and used or recorded again. Leaving at any time turns the camera off. This module sends nothing; the clip is an
 ordinary file, which the upload takes. */

import { messageOf } from "../shared/api.js";
import { openDialog } from "../shared/dialog.js";
import { Select } from "../shared/dom.js";
import { bytes } from "../shared/format.js";
import { later } from "../shared/timing.js";
import { h, html, signal, useEffect, useLayoutEffect, useMemo, useRef, useSignal } from "../vendor/preact.js";

/** @import { Child } from "../vendor/preact.js" */

const SHORTEST_S = 10;
const LONGEST_S = 30;
const COUNT_FROM = 3;
const SECOND_MS = 1000;
/** Requested video: enough pixels for trackers, and a few megabytes for half a minute. */
const WANTED = { width: { ideal: 640 }, height: { ideal: 480 }, frameRate: { ideal: 30 } };
const BITS_PER_SECOND = 4_000_000;
/** Recording formats, the fastest to decode first; Safari has only the last. */
const FORMATS = ["video/webm;codecs=vp8", "video/webm", "video/mp4"];
const TELL_EVERY_MS = 100;
/** Why a browser refuses the camera, by the name of its error. */
const REFUSALS = new Map([
  ["NotAllowedError", "The browser does not let this page use the camera. Allow it next to the address of this page, then try again."],
  ["NotFoundError", "No camera was found. Connect one, then try again."],
  ["NotReadableError", "The camera does not start; another program may use it. Close that program, then try again."],
]);

/** @typedef {[words: string, run: () => void]} Button */
/** @typedef {{keep: (clip: File) => void, refuse: (message: string) => void}} Ends What may become of a recording. */

/** Lengths of a clip. */
const seconds = signal(SHORTEST_S);

/** @param {(clip: File) => void} take Called with the clip. */
export function recordClip(take) {
  const dialog = openDialog("Use the camera", (close) => html`<div class="camera">${h(CameraDialog, { take, close })}</div>`, "wide");
  addEventListener("pagehide", () => dialog.close(), { once: true });
}

/** @param {{take: (clip: File) => void, close: () => void}} props */
function CameraDialog({ take, close }) {
  const prevented = obstacle();
  /** The camera, the recorded clip, or why it does not record. */
  const shown = useSignal(/** @type {"begin"|"on"|File|{refused: string}} */ (prevented ? { refused: prevented } : "begin"));
  const now = shown.value;
  const turnOn = () => (shown.value = "on");
  /** @type {Button} */
  const cancel = ["Cancel", close];
  if (now === "begin") {
    const body = html`<p class="hint">
      The clip stays in this browser until you press <strong>Use this clip</strong>. Then this server stores it with the uploads, which everybody who
      may use the server can see, until it is deleted under My work.
    </p>`;
    const words = `Record ${SHORTEST_S} to ${LONGEST_S} s, without sound, and track something in it.`;
    return h(Step, { key: "begin", words, buttons: [cancel, ["Turn on the camera", turnOn]], body });
  }
  if (now === "on") {
    return h(Live, { close, keep: (clip) => (shown.value = clip), refuse: (refused) => (shown.value = { refused }) });
  }
  if (now instanceof File) {
    const use = () => {
      close();
      take(now);
    };
    return h(Review, { clip: now, buttons: [cancel, ["Record again", turnOn], ["Use this clip", use]] });
  }
  /** @type {Button[]} */
  const buttons = prevented ? [["Close", close]] : [["Close", close], ["Try again", turnOn]];
  return h(Step, { key: "refused", words: now.refused, isWrong: true, buttons });
}

/** One step: its text and its buttons; the last one continues.
 *
 * @param {{words: string, buttons: Button[], body?: Child, isWrong?: boolean}} props
 */
function Step({ words, buttons, body, isWrong = false }) {
  const footer = useRef(/** @type {HTMLElement|null} */ (null));
  useLayoutEffect(() => [...(footer.current?.querySelectorAll("button") ?? [])].at(-1)?.focus(), []);
  const button = (/** @type {Button} */ [label, run], /** @type {number} */ place) => {
    const isLast = place === buttons.length - 1;
    return html`<button type="button" autofocus=${isLast} class=${isLast && place > 0 ? "primary" : null} onClick=${run}>${label}</button>`;
  };
  return html`
    <p role="status" class=${isWrong ? "wrong" : null}>${words}</p>
    ${body && html`<div class="camera-body">${body}</div>`}
    <footer ref=${footer}>${buttons.map(button)}</footer>
  `;
}

/** @param {{close: () => void} & Ends} props The camera while it is on: the browser asks for permission, and the light is on until this
 * component is removed. */
function Live({ close, keep, refuse }) {
  const stage = useSignal(/** @type {"preview"|"counting"|"recording"} */ ("preview"));
  /** The chosen camera; without one the browser chooses, on a phone the rear camera. */
  const id = useSignal("");
  const stream = useSignal(/** @type {MediaStream|null} */ (null));
  const cameras = useSignal(/** @type {MediaDeviceInfo[]} */ ([]));
  // Its cleanup runs at once, not after the next frame of the page, as that of other effects.
  useLayoutEffect(() => {
    const end = new AbortController();
    const which = id.value === "" ? { facingMode: { ideal: "environment" } } : { deviceId: { exact: id.value } };
    const turnOn = async () => {
      const found = await navigator.mediaDevices.getUserMedia({ video: { ...WANTED, ...which }, audio: false });
      const off = () => found.getTracks().forEach((track) => track.stop());
      if (end.signal.aborted) off();
      end.signal.addEventListener("abort", off);
      const devices = await navigator.mediaDevices.enumerateDevices();
      cameras.value = devices.filter(({ kind, deviceId }) => kind === "videoinput" && deviceId !== "");
      if (!end.signal.aborted) stream.value = found;
    };
    turnOn().catch((error) => end.signal.aborted || refuse(refusalOf(error)));
    return () => {
      end.abort();
      stream.value = null;
    };
  }, [id.value]);
  const now = stream.value;
  if (now === null) {
    return h(Step, { key: "waiting", words: "Waiting for the camera. The browser may ask whether this page may use it.", buttons: [["Cancel", close]] });
  }
  const to = (/** @type {typeof stage.value} */ next) => () => (stage.value = next);
  const preview = {
    words: "This is what will be recorded. Keep the camera still, and the whole target in the picture.",
    buttons: /** @type {Button[]} */ ([["Cancel", close], ["Record", to("counting")]]),
    body: h(Choices, { cameras: cameras.value, own: now.getVideoTracks()[0]?.getSettings().deviceId, choose: (other) => (id.value = other) }),
  };
  return html`
    <div class="camera-stage">
      <video srcObject=${now} autoplay muted playsinline aria-label="Picture of the camera"></video>
      ${stage.value === "counting" && h(Countdown, { end: to("recording") })}
    </div>
    ${stage.value === "preview" && h(Step, { key: "preview", ...preview })}
    ${stage.value === "counting" && h(Step, { key: "counting", words: "Recording begins in a moment", buttons: [["Stop", to("preview")]] })}
    ${stage.value === "recording" && h(Recording, { stream: now, keep, refuse })}
  `;
}

/** @param {{cameras: MediaDeviceInfo[], own: string|undefined, choose: (id: string) => void}} props The camera, and the length of the clip.
 * */
function Choices({ cameras, own, choose }) {
  const last = (/** @type {Event & {currentTarget: HTMLInputElement}} */ { currentTarget }) => (seconds.value = currentTarget.valueAsNumber);
  const options = cameras.map(({ deviceId, label }, index) => ({ value: deviceId, words: label || `Camera ${index + 1}` }));
  return html`
    ${options.length > 1 && html`<label>Camera ${h(Select, { label: "Camera", options, value: own ?? "", choose })}</label>`}
    <label for="camera-length">Length <output for="camera-length">${seconds} s</output></label>
    <input type="range" id="camera-length" min=${SHORTEST_S} max=${LONGEST_S} step="1" value=${seconds.value} onInput=${last} />
  `;
}

/** @param {{end: () => void}} props */
function Countdown({ end }) {
  const left = useSignal(COUNT_FROM);
  useEffect(() => later(() => (left.value > 1 ? (left.value -= 1) : end()), SECOND_MS), [left.value]);
  return html`<p class="camera-count" aria-hidden="true">${left.value}</p>`;
}

/** @param {{stream: MediaStream} & Ends} props Records a clip, which ends by itself, when it is stopped, or with the camera. */
function Recording({ stream, keep, refuse }) {
  const elapsed = useSignal(0);
  const recorder = useRef(/** @type {MediaRecorder|null} */ (null));
  const stop = () => recorder.current?.state === "recording" && recorder.current.stop();
  useLayoutEffect(() => {
    const end = new AbortController();
    const tell = (/** @type {number} */ now) => {
      elapsed.value = now;
      if (now >= seconds.value) stop();
    };
    try {
      recorder.current = begun(stream, end.signal, { tell, keep, refuse });
    } catch (error) {
      refuse(messageOf(error));
    }
    return () => end.abort();
  }, []);
  const { value: long } = seconds;
  const body = html`<p class="camera-recording">
    <progress max=${long} value=${elapsed.value} aria-label="Recorded"></progress>
    <output class="camera-elapsed">${Math.min(elapsed.value, long).toFixed(1)} of ${long} s</output>
  </p>`;
  return h(Step, { words: "Recording", buttons: [["Stop", stop]], body });
}

/** @param {{clip: File, buttons: Button[]}} props Plays the recorded clip. */
function Review({ clip, buttons }) {
  const address = useMemo(() => URL.createObjectURL(clip), [clip]);
  useEffect(() => () => URL.revokeObjectURL(address), [address]);
  return html`
    <div class="camera-stage"><video src=${address} autoplay muted controls loop playsinline aria-label="The recorded clip"></video></div>
    ${h(Step, { words: `The camera is off. The clip has ${bytes(clip.size)} and is still only in this browser.`, buttons })}
  `;
}

/** Why this page cannot use a camera, a sentence; empty if it can. */
function obstacle() {
  if (!isSecureContext) {
    return (
      "Browsers give the camera only to pages that come over https, or from this computer itself (http://localhost). " +
      `This page comes over http from ${location.host}. Its server can be put behind https.`
    );
  }
  return navigator.mediaDevices && globalThis.MediaRecorder ? "" : "This browser cannot record from a camera.";
}

/**
 * Why the camera does not start, in a sentence.
 *
 * @param {unknown} error
 */
function refusalOf(error) {
  const name = error instanceof DOMException ? error.name : "";
  return REFUSALS.get(name) ?? `The camera does not start (${error instanceof Error ? error.message || error.name : error}).`;
}

/** A started recorder; its recording becomes a clip when it ends, unless nobody waits for it any more.
 *
 * @param {MediaStream} stream
 * @param {AbortSignal} left
 * @param {{tell: (elapsed: number) => void} & Ends} on `tell` is called with the seconds so far.
 */
function begun(stream, left, { tell, keep, refuse }) {
  const mimeType = FORMATS.find((format) => MediaRecorder.isTypeSupported(format));
  const recorder = new MediaRecorder(stream, { videoBitsPerSecond: BITS_PER_SECOND, ...(mimeType && { mimeType }) });
  const until = { signal: left };
  /** @type {Blob[]} */
  const parts = [];
  let since = 0;
  recorder.addEventListener("start", () => (since = performance.now()), until);
  recorder.addEventListener("dataavailable", ({ data }) => {
    parts.push(data);
    tell((performance.now() - since) / 1000);
  }, until);
  recorder.addEventListener("error", () => refuse("The browser stopped recording."), until);
  recorder.addEventListener("stop", () => {
    const { mimeType: type } = recorder;
    // The Swedish form of a date has its largest part first.
    const name = `camera ${new Date().toLocaleString("sv").replaceAll(":", ".")}.${type.includes("mp4") ? "mp4" : "webm"}`;
    const clip = new File(parts, name, { type });
    if (clip.size > 0) keep(clip);
    else refuse("The camera sent no picture.");
  }, until);
  recorder.start(TELL_EVERY_MS);
  return recorder;
}
