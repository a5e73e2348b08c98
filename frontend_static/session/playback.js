/** A run played from a file: it replaces the worker of a session for commands that move through a run, and shows the stored drawings. */

/** @import { Command } from "../shared/messages.js" */
/** @import { FlatView } from "./flat/flat_view.js" */
/** @import { Store } from "./store.js" */

/** The file's index of its drawings.
 *
 * @typedef {object} Recording
 * @property {[first: number, end: number][][]} parts For each drawing the range of its bytes, and those of its pictures.
 * @property {number} every One of this many frames is drawn.
 * @property {number|null} before_loss Frame from which to watch the first loss.
 * @property {import("../shared/messages.js").Section[]} glossary
 */

export class Playback {
  #store;
  #view;
  #recording;
  #bytes;
  /** The shown frame, or the one about to be shown. */
  #frame = 0;
  /** When the last shown frame was due, ms. */
  #shown = 0;
  #next = 0;

  /**
   * @param {Store} store
   * @param {FlatView} view
   * @param {Recording} recording
   * @param {Blob} bytes Drawings and pictures.
   */
  constructor(store, view, recording, bytes) {
    this.#store = store;
    this.#view = view;
    this.#recording = recording;
    this.#bytes = bytes;
  }

  /** Carry out a command of a session.
   *
   * @param {Command} command
   * @throws {Error} The command needs a session.
   */
  async carryOut(command) {
    switch (command.kind) {
      case "play":
        return this.#play();
      case "pause":
        return this.#tell({ playing: false });
      case "step":
        return this.show(this.#frame + 1);
      case "back":
        return this.show(this.#frame - 1);
      case "seek":
        return this.show(command.frame);
      case "before_loss":
        return this.show(this.#recording.before_loss ?? this.#frame);
      case "speed":
        this.#shown = performance.now();
        return this.#tell({ speed: command.speed });
      default:
        throw new Error("This run is a recording; open its recipe in pftrack to change it");
    }
  }

  /**
   * Show a frame, its picture and its numbers together.
   *
   * @param {number} frame
   */
  async show(frame) {
    const { frames } = this.#store.known;
    const position = Math.min(Math.max(frame, 0), frames - 1);
    this.#frame = position;
    const parts = this.#recording.parts[Math.floor(position / this.#recording.every)];
    const drawing = await new Blob(parts.map(([first, end]) => this.#bytes.slice(first, end))).arrayBuffer();
    const { show } = await this.#view.prepare(drawing, () => {});
    if (this.#frame !== position) return;
    this.#tell({ position });
    show();
  }

  async #play() {
    this.#tell({ playing: true });
    this.#shown = performance.now();
    if (this.#frame === this.#store.known.frames - 1) await this.show(0);
    this.#goOn();
  }

  #goOn() {
    cancelAnimationFrame(this.#next);
    this.#next = requestAnimationFrame(() => this.#advance());
  }

  /** Show the frame that is due, and continue until a pause or the end of the run. */
  async #advance() {
    const { playing, speed, frame_rate_hz: rate, frames } = this.#store.known;
    if (!playing) return;
    const one = speed === 0 ? 0 : 1000 / (rate * speed);
    const due = one === 0 ? 1 : Math.floor((performance.now() - this.#shown) / one);
    if (due > 0) {
      this.#shown += due * one;
      await this.show(this.#frame + due);
    }
    if (this.#frame === frames - 1) this.#tell({ playing: false });
    this.#goOn();
  }

  /** @param {Partial<import("../shared/messages.js").SessionSnapshot>} session The changed fields. */
  #tell(session) {
    this.#store.receive({ version: 1, type: "changes", session, rows: [] });
  }
}
