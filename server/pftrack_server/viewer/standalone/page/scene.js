// The scene's frame: it is given the recording once, and then told what is to be seen.
import { bytes, unzipped, values } from "./sent.js";

/** @import { Clock } from "./clock.js" */
/** @import { Heard, Run, Told } from "../../viser_adapter/player/recording.js" */

const PATIENCE_MS = 20_000;

/**
 * Open the scene, and have it follow the clock.
 *
 * @param {Run} run
 * @param {Clock} clock
 * @param {(event: {key: string, shiftKey: boolean}) => void} onKey Takes what is pressed in the frame.
 */
export function openScene(run, clock, onKey) {
  const frame = /** @type {HTMLIFrameElement} */ (document.getElementById("scene"));
  const opening = document.getElementById("opening");
  let view = run.views[0];
  let isOpen = false;
  /** @param {Told} told */
  const tell = (told) => frame.contentWindow?.postMessage({ source: "pftrack", ...told }, "*");
  const begin = async () => {
    const [packed, pictures] = [await unzipped(bytes("packed")), bytes("pictures").buffer];
    tell({ recording: { packed, pictures, sizes: run.sizes, relief: run.relief }, hidden: hiddenLayers(), view, moment: momentAt(run, clock.frame) });
    isOpen = true;
  };
  clock.follow((at) => isOpen && tell({ moment: momentAt(run, at) }));
  addEventListener("message", ({ data, source }) => {
    const heard = /** @type {Heard} */ (data);
    if (source !== frame.contentWindow || heard?.source !== "pftrack-viser") return;
    if (heard.ready) begin();
    if (heard.key !== undefined) onKey({ key: heard.key, shiftKey: heard.shiftKey === true });
    if (heard.drawn !== undefined) {
      if (opening) opening.hidden = true;
      document.documentElement.dataset.drawn = String(run.kept[heard.drawn]);
    }
  });
  for (const button of buttons()) {
    button.addEventListener("click", () => {
      view = run.views.find(({ name }) => name === button.dataset.view) ?? view;
      for (const other of buttons()) other.ariaPressed = String(other === button);
      tell({ view });
    });
  }
  document.querySelector(".layers fieldset")?.addEventListener("change", () => tell({ hidden: hiddenLayers() }));
  const restart = () => {
    isOpen = false;
    setTimeout(() => {
      if (!isOpen && opening) opening.textContent = "The scene did not open; it needs WebGL. Plots and figures work without it.";
    }, PATIENCE_MS);
    frame.srcdoc = themed(values("player"));
  };
  restart();
  return restart;
}

/** @returns {HTMLButtonElement[]} */
const buttons = () => Array.from(document.querySelectorAll("button[data-view]"));

function hiddenLayers() {
  /** @type {NodeListOf<HTMLInputElement>} */
  const boxes = document.querySelectorAll(".layers input");
  return Array.from(boxes).flatMap((box) => (box.checked ? [] : [box.value]));
}

/**
 * The moment that shows a frame: its own, or that of the last frame before it that was kept.
 *
 * @param {Run} run
 * @param {number} frame
 */
export function momentAt({ kept }, frame) {
  return kept.findLastIndex((each) => each <= frame);
}

/**
 * viser's client in the scheme of this page.
 *
 * @param {string} client
 */
function themed(client) {
  const { theme } = document.documentElement.dataset;
  const isDark = theme ? theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  return client.replaceAll("{page theme}", isDark ? "dark" : "light").replaceAll("{page is dark}", String(isDark));
}
