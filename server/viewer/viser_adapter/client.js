// Runs before viser's own script. Everything here goes through what a page may do anyway: events, the address, focus.
(() => {
  "use strict";

  // ---- Light or dark: as the page around says (?theme=), else as the system asks. viser reads ?darkMode once, at start.
  // A ?websocket= is dropped: the scene talks to its own session only.
  const asked = new URLSearchParams(location.search).get("theme");
  const system = matchMedia("(prefers-color-scheme: dark)");
  const theme = asked === "light" || asked === "dark" ? asked : system.matches ? "dark" : "light";
  const query = [...(asked ? [`theme=${theme}`] : []), ...(theme === "dark" ? ["darkMode=1"] : [])];
  history.replaceState(null, "", location.pathname + (query.length ? `?${query.join("&")}` : ""));
  document.documentElement.dataset.theme = theme;
  const restart = (wanted) => {
    if (wanted !== theme) location.replace(`${location.pathname}?theme=${wanted}`);
  };
  if (!asked) system.addEventListener("change", () => location.reload());
  addEventListener("message", (event) => {
    if (event.origin === location.origin && event.data?.source === "pftrack" && event.data.theme) {
      restart(event.data.theme === "dark" ? "dark" : "light");
    }
  });

  // viser loads a sorter for Gaussian splats that evaluates text, which the policy forbids; nothing here draws splats.
  addEventListener("unhandledrejection", (event) => event.reason instanceof EvalError && event.preventDefault());

  // ---- Reconnect while visible. viser retries only in a window that has the focus, which a frame rarely has.
  document.hasFocus = () => document.visibilityState === "visible";
  document.addEventListener("visibilitychange", () => {
    dispatchEvent(new Event(document.visibilityState === "visible" ? "focus" : "blur"));
  });

  // ---- Picture and particles of the same frame, and no frame drawn in vain. viser takes a frame up while it draws, so it
  // draws the old one once more; and it hands points to the graphics card at once, but unpacks a picture in the
  // background, from an address of its own that it gives back afterwards; a newer picture even cancels it. Without a
  // graphics card drawing takes longer than all else together. So a frame is taken up as soon as it comes, while the
  // last one is being drawn, and nothing is drawn and nothing newer taken up until its picture hangs in the scene.
  const PATIENCE_MS = 500;
  const unpacking = new Map();
  const create = URL.createObjectURL.bind(URL);
  URL.createObjectURL = (object) => {
    const address = create(object);
    if (object instanceof Blob && object.type.startsWith("image/")) unpacking.set(address, performance.now());
    return address;
  };
  const hangs = (address) => {
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
    constructor(...rest) {
      super(...rest);
      // viser's own listener comes later and puts what has come into its queue.
      this.addEventListener("message", () => setTimeout(takeUp));
    }
  };
  const drawn = (callback, time) => {
    const viewer = window.__viserMutable;
    const later = viewer?.drainMessageQueue ? viewer.messageQueue.splice(0) : [];
    callback(time);
    if (later.length === 0) return;
    viewer.messageQueue.unshift(...later);
    viewer.requestRender();
    setTimeout(takeUp);
  };
  const draw = window.requestAnimationFrame.bind(window);
  const undraw = window.cancelAnimationFrame.bind(window);
  const due = new Map();
  let now = -1;
  let last = 0;
  window.requestAnimationFrame = (callback) => {
    const request = ++last;
    const run = (time) => {
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
    undraw(due.get(request));
    due.delete(request);
  };

  // ---- Keys that steer the run go to the page around.
  const KEYS = new Set([" ", "ArrowLeft", "ArrowRight", "Home", "End", "[", "]", "?", ..."bBlLnNcC123456789"]);
  const SLIDER_KEYS = new Set(["ArrowLeft", "ArrowRight", "Home", "End"]);
  let clicked = true;
  addEventListener("pointerdown", () => (clicked = true), true);
  addEventListener("keydown", (event) => event.key === "Tab" && (clicked = false), true);
  const belongsTo = (element, key) => {
    if (!(element instanceof Element)) return false;
    if (element.closest("textarea, select, [contenteditable=''], [contenteditable=true]")) return true;
    const input = element.closest("input");
    if (input && !["checkbox", "radio", "button"].includes(input.type)) return true;
    if (element.closest("[role=slider]")) return SLIDER_KEYS.has(key);
    if (element.closest("[role=listbox], [role=option], [role=dialog]")) return true;
    // Space presses a button for people who came to it by keyboard, not for those who have just clicked it.
    return key === " " && !clicked && element.matches("button, input, [role=button], a");
  };
  addEventListener(
    "keydown",
    (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || !KEYS.has(event.key)) return;
      if (belongsTo(event.target, event.key)) return;
      event.preventDefault();
      event.stopImmediatePropagation();
      if (parent !== window) {
        parent.postMessage({ source: "pftrack-viser", key: event.key, shiftKey: event.shiftKey }, location.origin);
      }
    },
    true,
  );
  addEventListener(
    "keyup",
    (event) => {
      // A button is pressed when space comes up again.
      if (event.key === " " && !belongsTo(event.target, " ")) event.preventDefault();
    },
    true,
  );

  // ---- A typed number counts when it is finished (Enter, Tab, leaving the box), not digit by digit: 800 is not 8. Until
  // then no answer of the session to something else may write over it.
  const unfinished = new WeakSet();
  let finishing = false;
  const isNumber = (element) => element instanceof HTMLInputElement && element.inputMode !== "" && element.closest(".mantine-NumberInput-root");
  const finish = (element) => {
    if (!unfinished.delete(element)) return;
    finishing = true;
    element.dispatchEvent(new Event("input", { bubbles: true }));
    finishing = false;
  };
  const guarded = new WeakSet();
  const guard = (element) => {
    const own = Object.getOwnPropertyDescriptor(element, "value");
    if (guarded.has(element) || !own?.configurable || !own.set) return;
    guarded.add(element);
    const set = function (value) {
      if (!unfinished.has(element)) own.set.call(this, value);
    };
    Object.defineProperty(element, "value", { ...own, set });
  };
  addEventListener(
    "input",
    (event) => {
      if (finishing || !isNumber(event.target)) return;
      guard(event.target);
      unfinished.add(event.target);
      event.stopImmediatePropagation();
    },
    true,
  );
  addEventListener("keydown", (event) => event.key === "Enter" && finish(event.target), true);
  addEventListener("focusout", (event) => finish(event.target), true);
})();
