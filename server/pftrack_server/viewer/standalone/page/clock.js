// The one clock of the page: which frame is shown, and when the next one is due. Scene, plots and figures follow it.

/** @typedef {(frame: number) => void} Listener */

export class Clock {
  frame = 0;
  speed = 1;
  isPlaying = false;
  #last;
  #rateHz;
  /** @type {Listener[]} */
  #listeners = [];
  #since = 0;

  /**
   * @param {number} frames
   * @param {number} rateHz Frames of the recording a second.
   */
  constructor(frames, rateHz) {
    this.#last = frames - 1;
    this.#rateHz = rateHz;
  }

  /** @param {Listener} listener */
  follow(listener) {
    this.#listeners.push(listener);
    listener(this.frame);
  }

  /** @param {number} frame */
  go(frame) {
    this.#since = performance.now();
    this.#show(Math.min(this.#last, Math.max(0, Math.round(frame))));
  }

  /** Play from here, from the beginning at the end, or pause. */
  toggle() {
    this.isPlaying = !this.isPlaying;
    this.go(this.isPlaying && this.frame === this.#last ? 0 : this.frame);
    if (this.isPlaying) requestAnimationFrame(() => this.#tick());
  }

  /** @param {number} speed */
  pace(speed) {
    this.speed = speed;
    this.#since = performance.now();
  }

  #tick() {
    if (!this.isPlaying) return;
    const one = 1000 / (this.#rateHz * this.speed);
    const due = Math.floor((performance.now() - this.#since) / one);
    if (due > 0) {
      this.#since += due * one;
      this.isPlaying = this.frame + due < this.#last;
      this.#show(Math.min(this.#last, this.frame + due));
    }
    requestAnimationFrame(() => this.#tick());
  }

  /** @param {number} frame */
  #show(frame) {
    this.frame = frame;
    for (const listener of this.#listeners) listener(frame);
  }
}
