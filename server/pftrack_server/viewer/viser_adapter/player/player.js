// Plays a recording in viser's client, which has no server here. The page around says which frame is to be seen; it is told
// when that has been drawn.
import { isInPlace, messagesTo, raised } from "./camera.js";
import { Nodes } from "./nodes.js";
import { Arrays } from "./unpack.js";

/** @import { Description, Heard, Relief, Told, View } from "./recording.js" */

/** @type {{description: Description, nodes: Nodes, relief: Relief}|null} */
let scene = null;
/** @type {View|null} */
let view = null;
/** @type {Set<string>} */
let hidden = new Set();
let moment = 0;
let height = 0;
let isDue = false;
let isAwaited = false;
let isMoved = false;

/** @param {Heard} what */
const tell = (what) => parent.postMessage({ source: "pftrack-viser", ...what }, "*");

/** @param {NonNullable<Told["recording"]>} recording */
function opened({ packed, pictures, sizes, relief }) {
  const length = new DataView(packed).getUint32(0, true);
  const description = /** @type {Description} */ (JSON.parse(new TextDecoder().decode(new Uint8Array(packed, 4, length))));
  let at = 0;
  const files = sizes.map((size) => new Uint8Array(pictures, (at += size) - size, size));
  return { description, nodes: new Nodes(description, new Arrays(description, new Uint8Array(packed, 4 + length), files)), relief };
}

/** Bring the camera to its view, unless it is there or somebody has moved it. */
function look() {
  const viewer = window.__viserMutable;
  if (!view || isMoved || !viewer?.camera || viewer.messageQueue.length > 0 || isInPlace(view, viewer)) return;
  viewer.messageQueue.push(...messagesTo(view, viewer.camera.aspect));
  viewer.requestRender();
}

/** @param {Told} told */
function hear(told) {
  if (told.recording) scene = opened(told.recording);
  if (told.hidden) hidden = new Set(told.hidden);
  moment = told.moment ?? moment;
  if (told.view) {
    view = told.view;
    isMoved = false;
  }
  isDue = true;
}

// Callbacks wait while a picture is being unpacked (`frames.js`), so a frame is drawn with its picture, or not at all.
function attend() {
  requestAnimationFrame(attend);
  const viewer = window.__viserMutable;
  if (!scene || !viewer) return;
  look();
  const risen = view?.beside ? 0 : raised(viewer, scene.relief);
  if (isDue || risen !== height) {
    isDue = false;
    height = risen;
    viewer.messageQueue.push(...scene.nodes.show(scene.description.moments[moment], height, hidden));
    viewer.requestRender();
    isAwaited = true;
  } else if (isAwaited && viewer.messageQueue.length === 0) {
    isAwaited = false;
    tell({ drawn: moment });
  }
}

function begin() {
  const viewer = window.__viserMutable;
  if (!(viewer?.scene && viewer.camera && viewer.cameraControl && viewer.drainMessageQueue)) {
    requestAnimationFrame(begin);
    return;
  }
  addEventListener("message", ({ data, source }) => source === parent && data?.source === "pftrack" && hear(data));
  for (const event of ["pointerdown", "wheel", "keydown"]) {
    addEventListener(event, () => (isMoved = true), { capture: true, passive: true });
  }
  requestAnimationFrame(attend);
  tell({ ready: true });
}

// viser loads a sorter for Gaussian splats that evaluates text, which the page's policy forbids; nothing here draws splats.
addEventListener("unhandledrejection", (event) => event.reason instanceof EvalError && event.preventDefault());
begin();
