// A run that is played without a server: scene, plots and figures follow one clock.
import { Clock } from "./clock.js";
import { momentAt, openScene } from "./scene.js";
import { values } from "./sent.js";

/** @import { Run } from "../../viser_adapter/player/recording.js" */

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];
const BEFORE_LOSS = 10;

const run = /** @type {Run} */ (values("run"));
const clock = new Clock(run.frames, run.rate_hz);
/**
 * @template {HTMLElement} Kind
 * @param {string} id
 */
const element = (id) => /** @type {Kind} */ (document.getElementById(id));
/** @type {HTMLInputElement} */
const slider = element("frame");
/** @type {HTMLButtonElement} */
const play = element("play");
/** @type {HTMLSelectElement} */
const speed = element("speed");
const loss = element("loss");
const figures = Array.from(document.querySelectorAll("#readings dd"));
/** @type {HTMLElement[]} */
const axes = Array.from(document.querySelectorAll(".axes"));

/** The first frame in which the target is gone, and was not before. */
const lost = run.gone.findIndex((flag, frame) => flag === 1 && run.gone[frame - 1] !== 1);

/** @param {number} frame */
function show(frame) {
  slider.value = String(frame);
  slider.ariaValueText = `frame ${frame} of ${run.frames - 1}`;
  element("where").textContent = `frame ${frame} / ${run.frames - 1}`;
  element("caption").textContent = run.captions[momentAt(run, frame)];
  figures.forEach((figure, line) => (figure.textContent = run.readings[line][frame]));
  play.ariaPressed = String(clock.isPlaying);
  for (const plot of axes) {
    const [left, right] = [Number(plot.dataset.first), Number(plot.dataset.last)];
    const cursor = /** @type {HTMLElement} */ (plot.querySelector(".cursor"));
    cursor.style.left = `${100 * (left + ((right - left) * frame) / Math.max(1, run.frames - 1))}%`;
  }
}

/** @param {number} direction */
function faster(direction) {
  const at = SPEEDS.indexOf(clock.speed) + direction;
  if (at < 0 || at >= SPEEDS.length) return;
  clock.pace(SPEEDS[at]);
  speed.value = String(SPEEDS[at]);
}

const beforeLoss = () => lost >= 0 && clock.go(lost - BEFORE_LOSS);

/** @param {{key: string, shiftKey: boolean}} event */
function press({ key, shiftKey }) {
  const step = shiftKey ? 10 : 1;
  const actions = {
    " ": () => clock.toggle(),
    ArrowLeft: () => clock.go(clock.frame - step),
    ArrowRight: () => clock.go(clock.frame + step),
    Home: () => clock.go(0),
    End: () => clock.go(run.frames - 1),
    "[": () => faster(-1),
    "]": () => faster(1),
    l: beforeLoss,
    L: beforeLoss,
  };
  const action = Object.hasOwn(actions, key) ? actions[/** @type {keyof typeof actions} */ (key)] : null;
  action?.();
  return action !== null;
}

function listen() {
  addEventListener("keydown", (event) => {
    const at = event.target instanceof Element ? event.target : null;
    if (event.ctrlKey || event.metaKey || event.altKey || at?.closest("select, pre")) return;
    if (event.key === " " && at?.closest("button, summary, input[type=checkbox]")) return;
    if (press(event)) event.preventDefault();
  });
  slider.addEventListener("input", () => clock.go(Number(slider.value)));
  play.addEventListener("click", () => clock.toggle());
  speed.addEventListener("change", () => clock.pace(Number(speed.value)));
  loss.hidden = lost < 0;
  loss.addEventListener("click", beforeLoss);
  const ways = { first: "Home", back: "ArrowLeft", on: "ArrowRight", last: "End" };
  for (const [way, key] of Object.entries(ways)) {
    document.querySelector(`[data-go=${way}]`)?.addEventListener("click", () => press({ key, shiftKey: false }));
  }
  for (const plot of axes) plot.addEventListener("pointerdown", (event) => point(plot, event));
}

/**
 * Go to the frame at which somebody points in a plot, and follow the pointer.
 *
 * @param {HTMLElement} plot
 * @param {PointerEvent} event
 */
function point(plot, event) {
  const { left, width } = plot.getBoundingClientRect();
  const [from, to] = [Number(plot.dataset.first), Number(plot.dataset.last)];
  const follow = (/** @type {PointerEvent} */ { clientX }) => clock.go(((clientX - left) / width - from) / (to - from) * (run.frames - 1));
  follow(event);
  plot.setPointerCapture(event.pointerId);
  plot.onpointermove = follow;
  plot.onpointerup = () => (plot.onpointermove = null);
}

/** @param {() => void} onChange */
function chooseTheme(onChange) {
  const system = matchMedia("(prefers-color-scheme: dark)");
  element("theme").addEventListener("click", () => {
    const { dataset } = document.documentElement;
    const usual = system.matches ? "dark" : "light";
    dataset.theme = (dataset.theme ?? usual) === "dark" ? "light" : "dark";
    onChange();
  });
  system.addEventListener("change", onChange);
}

function offerCopy() {
  const copy = element("copy");
  copy.addEventListener("click", async () => {
    await navigator.clipboard.writeText(element("recipe").textContent);
    copy.textContent = "Copied";
  });
}

listen();
offerCopy();
chooseTheme(openScene(run, clock, press));
clock.follow(show);
