// Picture and particles of the same frame, and no frame drawn in vain. viser takes a frame up while it draws, so it
// draws the old one once more; and it hands points to the graphics card at once, but unpacks a picture in the
// background, from an address of its own that it gives back afterwards; a newer picture even cancels it. Without a
// graphics card drawing takes longer than all else together. So a frame is taken up as soon as it comes, while the
// last one is being drawn, and nothing is drawn and nothing newer taken up until its picture hangs in the scene.
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
    // One that nobody hangs up (it was hidden or removed meanwhile) must not stop the scene for good.
    if (performance.now() - since > PATIENCE_MS || hangs(address)) unpacking.delete(address);
  }
  return unpacking.size > 0;
};
let isHeld = false;
const takeUp = () => {
  const viewer = window.__viserMutable;
  // Once a frame had to be held, it is drawn before anything newer: frames that come faster than their pictures are
  // unpacked would otherwise keep all of them from being drawn.
  if (isHeld || !viewer?.drainMessageQueue || viewer.messageQueue.length === 0 || isUnpacking()) return;
  viewer.drainMessageQueue();
  viewer.requestRender();
};
const OriginalWorker = window.Worker;
window.Worker = class extends OriginalWorker {
  /** @param {ConstructorParameters<typeof Worker>} rest */
  constructor(...rest) {
    super(...rest);
    // viser's own listener comes later and puts what has come into its queue.
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
    // All callbacks of one frame run or wait together: the first of them may well have begun to unpack the next picture.
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
