/**
 * The library's own picture of the current frame, in the scene's place while the scene is still loading: the run is seen
 * at once, and lives.
 */

import { api } from "../shared/api.js";
import { fill, h } from "../shared/dom.js";
import { later, throttle } from "../shared/timing.js";

const EVERY_MS = 200;
const SETTLED_MS = 250;

export class Preview {
  #id;
  #signal;
  #often;
  #resolveFirst = () => {};
  #asked = 0;
  #busy = false;

  /** Whether to leave it at the picture there is, because nobody would answer. */
  stopped = false;

  /** What is put into the page. */
  element = h("div", { class: "scene-still" });

  /** Resolves when the first picture is there. */
  first = /** @type {Promise<void>} */ (new Promise((resolve) => {
    this.#resolveFirst = resolve;
  }));

  /**
   * @param {string} id The session.
   * @param {boolean} isFresh Whether it stands still at its beginning, so that its picture can be asked for at once.
   * @param {AbortSignal} signal
   */
  constructor(id, isFresh, signal) {
    this.#id = id;
    this.#signal = signal;
    this.#often = throttle(() => this.#again(), EVERY_MS, signal);
    if (isFresh) this.#ask();
  }

  /**
   * Show the frame that is the current one now. While the run plays that is done at a modest rate; otherwise only once
   * it stands, because asking for a picture would end a seek that is under way.
   *
   * @param {boolean} isPlaying
   */
  refresh(isPlaying) {
    this.#unsettle();
    if (isPlaying) this.#often();
    else this.#unsettle = later(() => this.#again(), SETTLED_MS, this.#signal);
  }

  #unsettle = () => {};

  #again() {
    if (this.element.isConnected && !this.#busy && !this.stopped) this.#ask();
  }

  async #ask() {
    this.#busy = true;
    this.#asked += 1;
    const image = h("img", {
      src: `${api.frameAddress(this.#id)}?picture=${this.#asked}`,
      alt: "The current frame with what the tracker believes",
      fetchpriority: "high",
    });
    try {
      // The old picture stays until the new one can be painted: nothing flashes.
      await image.decode();
      fill(this.element, image);
      this.#resolveFirst();
    } catch {
      // The next one, or the scene.
    } finally {
      this.#busy = false;
    }
  }
}
