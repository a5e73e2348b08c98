// Shows picture and particles of the same frame, and draws no frame in vain. viser processes a frame's messages while it draws, so it draws
// the old frame once more. It passes points to the graphics card at once, but decodes a picture in the background, from a temporary
// address; a newer picture even cancels that. Without a graphics card, drawing takes longer than everything else together. So a frame's
// messages are processed as soon as they arrive, while the last frame is being drawn; then nothing is drawn and nothing newer processed
// until its picture is in the scene.
const PATIENCE_MS = 500;
/** @type {Map<string, number>} */
const unpacking = new Map();
const create = URL.createObjectURL.bind(URL);
URL.createObjectURL = (object) => {
  const address = create(object);
  if (object instanceof Blob && object.type.startsWith("image/")) unpacking.set(address, performance.now());
  return address;
};
const hangs = (/** @type {string} */ address) => {
  let found = false;
  window.__viserMutable?.scene?.traverse((item) => (found ||= item.material?.map?.image?.src === address));
  return found;
};
const isUnpacking = () => {
  for (const [address, since] of unpacking) {
    // A picture that is never shown (it was hidden or removed meanwhile) must not stop the scene for ever.
    if (performance.now() - since > PATIENCE_MS || hangs(address)) unpacking.delete(address);
  }
  return unpacking.size > 0;
};
let isHeld = false;
const takeUp = () => {
  const viewer = window.__viserMutable;
  // A frame that had to wait is drawn before anything newer: otherwise frames that arrive faster than their pictures are decoded would
  // prevent all drawing.
  if (isHeld || !viewer?.drainMessageQueue || viewer.messageQueue.length === 0 || isUnpacking()) return;
  viewer.drainMessageQueue();
  viewer.requestRender();
};
const OriginalWorker = window.Worker;
window.Worker = class extends OriginalWorker {
  /** @param {ConstructorParameters<typeof Worker>} rest */
  constructor(...rest) {
    super(...rest);
    // viser's own listener runs later and queues the message.
    this.addEventListener("message", () => setTimeout(takeUp));
  }
};
const drawn = (/** @type {FrameRequestCallback} */ callback, /** @type {number} */ time) => {
  const viewer = window.__viserMutable;
  const later = viewer?.drainMessageQueue ? viewer.messageQueue.splice(0) : [];
  callback(time);
  if (viewer === undefined || later.length === 0) return;
  viewer.messageQueue.unshift(...later);
  viewer.requestRender();
  setTimeout(takeUp);
};
const draw = window.requestAnimationFrame.bind(window);
const undraw = window.cancelAnimationFrame.bind(window);
/** @type {Map<number, number>} */
const due = new Map();
let now = -1;
let last = 0;
window.requestAnimationFrame = (callback) => {
  const request = ++last;
  const run = (/** @type {number} */ time) => {
    // All callbacks of one frame run or wait together: the first may already have begun to decode the next picture.
    if (now !== time) isHeld = isUnpacking();
    now = time;
    if (isHeld) {
      due.set(request, draw(run));
      return;
    }
    due.delete(request);
    drawn(callback, time);
  };
  due.set(request, draw(run));
  return request;
};
window.cancelAnimationFrame = (request) => {
  undraw(due.get(request) ?? 0);
  due.delete(request);
};
