/** The drop zone: takes videos, pictures, tables of tracks, results of trackers and saved runs, and shows how far it is. */

import { here } from "../shared/address.js";
import { api, messageOf, statusOf } from "../shared/api.js";
import { fill, h, setText } from "../shared/dom.js";
import { bytes } from "../shared/format.js";
import { icon } from "../shared/icons.js";
import { cancelJob, followJob, jobOf } from "../shared/jobs.js";
import { toast } from "../shared/toast.js";
import { progressWords } from "../shared/progress.js";
import { cameraButton } from "./camera/dialog.js";
import { columnsForm } from "./columns.js";

/** @import { OnProgress, Transfer } from "../shared/api.js" */
/** @import { ImportJob } from "../shared/messages.js" */

const SILENT = "The server does not answer; trying again";

const ACCEPTED = "video/*,image/*,.csv,.tsv,.txt,.xml,.json,text/csv,.pft";

const OFFERED =
  "A video, an animated GIF or pictures, a table of tracks (.csv), results of any tracker, alone or with their clip and truth, " +
  "a recording or a saved run (.pft)";

const PLACE_MS = 1000;

/** Of a table, from which its columns are seen. */
const HEAD_BYTES = 16_384;

/** The address names a run that is being computed, so that a reload goes on showing it. */
const IMPORT = /^#import\/(\w+)$/;

/**
 * @typedef {object} Listener
 * @property {(upload: import("../shared/messages.js").UploadPublic) => void} uploaded
 * @property {(run: import("../shared/messages.js").RunPublic) => void} imported
 */

export class DropZone {
  #on;
  #zone = h("div", { class: "drop" });
  #picker = h("input", { type: "file", multiple: true, class: "visually-hidden", id: "file-picker", accept: ACCEPTED });
  /** Whether files are on their way, which others would push out of sight. */
  #isBusy = false;
  /** How many elements deep within the page something is dragged. */
  #depth = 0;

  /**
   * @param {HTMLElement} root
   * @param {Listener} on
   */
  constructor(root, on) {
    this.#on = on;
    fill(root, this.#zone);
    this.#picker.addEventListener("change", () => this.#take([...(this.#picker.files ?? [])]));
    this.#listen();
    this.#invite();
    this.#resume();
  }

  /** Go on showing a run that was being computed when the page was left. */
  async #resume() {
    const id = IMPORT.exec(location.hash)?.[1];
    if (id === undefined) return;
    leaveAddress();
    try {
      /** @type {ImportJob} */
      const job = await jobOf(id);
      // One that is done is among the saved runs by now.
      if (job.state !== "done" && !this.#isBusy) await this.#follow(job);
    } catch {
      // It was given up meanwhile, or the server has started again.
    }
  }

  /** Files may be dropped anywhere in the page. */
  #listen() {
    document.addEventListener("dragenter", (event) => {
      if (!hasFiles(event)) return;
      this.#depth += 1;
      this.#zone.classList.add("over");
    });
    document.addEventListener("dragleave", () => this.#leave(this.#depth - 1));
    document.addEventListener("dragover", (event) => hasFiles(event) && event.preventDefault());
    document.addEventListener("drop", (event) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      this.#leave(0);
      this.#take([...(event.dataTransfer?.files ?? [])]);
    });
  }

  /** @param {number} depth */
  #leave(depth) {
    this.#depth = Math.max(0, depth);
    if (this.#depth === 0) this.#zone.classList.remove("over");
  }

  #invite() {
    this.#picker.value = "";
    fill(
      this.#zone,
      this.#picker,
      icon("film"),
      h("p", { class: "drop-words" }, h("strong", {}, "Drop a video here"), " or ", h("label", { for: "file-picker", class: "link" }, "choose a file")),
      h("p", { class: "hint" }, OFFERED),
      cameraButton((clip) => this.#take([clip])),
    );
  }

  /** @param {File[]} files */
  async #take(files) {
    if (files.length === 0) return;
    if (this.#isBusy) {
      toast("Other files are still uploading; wait for them, or stop them first");
      return;
    }
    const isRun = files.length === 1 && files[0].name.toLowerCase().endsWith(".pft") && !(await isRecording(files[0]));
    if (isRun) await this.#send(files, api.importRun, "Computing the run", (begun) => this.#follow(begun));
    else await this.#send(files, api.sendUpload, "Checking every frame", this.#on.uploaded);
  }

  /**
   * Send files, show how far that is, and hand on what the server answers.
   *
   * @template Answer
   * @param {File[]} files
   * @param {(files: File[], onProgress: OnProgress) => Transfer<Answer>} send
   * @param {string} reading What the server does when it has them.
   * @param {(answer: Answer) => void} received
   */
  async #send(files, send, reading, received) {
    const name = files.length === 1 ? files[0].name : `${files.length} files`;
    const size = files.reduce((sum, file) => sum + file.size, 0);
    const meter = h("progress", { max: 1, value: 0, "aria-label": "Upload" });
    const words = h("p", { class: "hint", role: "status" });
    const ended = new AbortController();
    let isSent = false;
    const transfer = send(files, (sent, total) => {
      if (isSent) return;
      isSent = sent >= total;
      meter.value = total > 0 ? sent / total : 0;
      setText(words, isSent ? reading : `${bytes(Math.min(sent, size))} of ${bytes(size)}`);
      if (!isSent) return;
      meter.removeAttribute("value");
      tellPlace(transfer, ended.signal, (before) => setText(words, before > 0 ? `Waiting, ${before} before this one` : reading));
    });
    const stop = h("button", { type: "button", on: { click: () => transfer.stop() } }, "Stop");
    fill(this.#zone, h("p", { class: "drop-words" }, name), meter, words, stop);
    this.#isBusy = true;
    let answer;
    try {
      answer = await transfer.done;
    } catch (error) {
      if (statusOf(error) === -1) this.#invite();
      else if (!(await this.#askColumns(files, messageOf(error)))) this.#refuse(name, messageOf(error));
      return;
    } finally {
      this.#isBusy = false;
      ended.abort();
    }
    this.#invite();
    received(answer);
  }

  /**
   * Ask what the columns of a table are that was not understood; whether it is such a table.
   *
   * @param {File[]} files
   * @param {string} refusal
   */
  async #askColumns(files, refusal) {
    if (files.length !== 1 || !/\.(csv|tsv|txt)$/i.test(files[0].name)) return false;
    let table;
    try {
      table = await api.table(await files[0].slice(0, HEAD_BYTES).text());
    } catch {
      return false;
    }
    const form = columnsForm(files[0].name, table, refusal, {
      chosen: (columns) => this.#send(files, (some, onProgress) => api.sendUpload(some, onProgress, columns), "Checking every frame", this.#on.uploaded),
      cancelled: () => this.#invite(),
    });
    fill(this.#zone, form);
    form.querySelector("select")?.focus();
    return true;
  }

  /**
   * Show how far a run is that is computed before it is kept, and hand it on when it is there.
   *
   * @param {ImportJob} begun
   */
  async #follow(begun) {
    const { id, name } = begun;
    history.replaceState(null, "", here(`import/${id}`));
    const meter = h("progress", { max: 1, "aria-label": "Frames computed" });
    const words = h("p", { class: "hint", role: "status" }, "Waiting in the queue");
    const wanted = new AbortController();
    const stop = () => {
      wanted.abort();
      this.#isBusy = false;
      leaveAddress();
      this.#invite();
      cancelJob(id);
    };
    fill(this.#zone, h("p", { class: "drop-words" }, name), meter, words, h("button", { type: "button", on: { click: stop } }, "Cancel"));
    const since = performance.now();
    const tell = (/** @type {ImportJob} */ { done, total }) => {
      if (total === 0) return;
      meter.value = done / total;
      setText(words, progressWords(done, total, (performance.now() - since) / 1000, done - begun.done));
    };
    this.#isBusy = true;
    try {
      tell(begun);
      const job = await followJob(begun, (now) => (now === null ? setText(words, SILENT) : tell(now)), wanted.signal);
      if (job === null) return;
      leaveAddress();
      if (job.result === null) throw new Error(job.error ?? "The run could not be imported");
      this.#invite();
      this.#on.imported(job.result);
    } catch (error) {
      if (!wanted.signal.aborted) this.#refuse(name, messageOf(error));
    } finally {
      if (!wanted.signal.aborted) this.#isBusy = false;
    }
  }

  /**
   * @param {string} name
   * @param {string} message
   */
  #refuse(name, message) {
    fill(
      this.#zone,
      h("p", { class: "drop-words" }, h("strong", {}, `${name} was not accepted`)),
      h("p", { class: "wrong", role: "alert" }, message),
      h("button", { type: "button", autofocus: true, on: { click: () => this.#invite() } }, "Choose another file"),
    );
  }
}

/** Name no run in the address any more; an upload may be there by now. */
function leaveAddress() {
  if (IMPORT.test(location.hash)) history.replaceState(null, "", location.pathname);
}

/**
 * Tell the place of a transfer in the server's queue, again and again until it ends.
 *
 * @param {Transfer<unknown>} transfer
 * @param {AbortSignal} signal
 * @param {(before: number) => void} tell
 */
function tellPlace(transfer, signal, tell) {
  const ask = async () => {
    try {
      const before = await transfer.before();
      if (!signal.aborted) tell(before);
    } catch {
      // The transfer itself will say what is wrong.
    }
  };
  const asking = setInterval(ask, PLACE_MS);
  signal.addEventListener("abort", () => clearInterval(asking));
}

/**
 * Tell a recording of beliefs from a saved run: both are archives, whose first entry is named after 30 bytes.
 *
 * @param {File} file
 */
async function isRecording(file) {
  return (await file.slice(30, 44).text()) === "recording.json";
}

/** @param {DragEvent} event */
function hasFiles(event) {
  return event.dataTransfer?.types.includes("Files") ?? false;
}
