/** The target in a recording: marked by a person, with one of the kinds of mark that an experiment takes, or found automatically. A found
 mark can be corrected. If nothing is found, a person marks the target, or hints at its place by a mark of another kind. */

import { addressOf, formOf, messageOf, request } from "../shared/api.js";
import { attempt } from "../shared/dom.js";
import { descriptionOf, markEditor } from "../shared/marks/mark_editor.js";
import { throttle } from "../shared/timing.js";
import { computed, signal } from "../vendor/preact.js";

/** @import { MarkEditor } from "../shared/marks/mark_editor.js" */
/** @import { Description, Mark } from "../shared/marks/mark_json.js" */
/** @import { ExperimentPublic, SightingPublic, TruthPublic, UploadPublic } from "../shared/messages.js" */

/** The state of the search for a target.
 *
 * @typedef {object} Finding
 * @property {"looking"|"found"|"refused"|"marking"} state `marking` while a person marks it because it was not found.
 * @property {string[]} notes
 * @property {number|null} share Searched share of the frames; null while unknown.
 * @property {boolean} isGuessed Whether the model has placed parts of the mark.
 * @property {boolean} hasLater Whether it may be in later frames.
 */
/** @typedef {{kept: TruthPublic|null, refused: string, isBusy: boolean}} Truth What the server keeps, or why it refused the last file. */

const PICTURE_EVERY_MS = 80;
/** @type {Truth} */
const NO_TRUTH = { kept: null, refused: "", isBusy: false };

export class Target {
  /** Address of the shown picture. */
  picture = signal("");
  /** The editor of the mark; null if there is nothing to mark. */
  way = signal(/** @type {{description: Description, editor: MarkEditor}|null} */ (null));
  /** The mark in the editor. */
  mark = computed(() => this.way.value?.editor.mark ?? null);
  /** Number of handles still to be dragged. */
  left = computed(() => this.way.value?.editor.left ?? 0);
  finding = signal(/** @type {Finding|null} */ (null));
  truth = signal(NO_TRUTH);
  isStarting = signal(false);
  /** Why no session could be started. */
  wrong = signal("");
  /** The footage of a session; null while the target is not marked. */
  footage = computed(() => {
    const { finds, unmarked } = this.experiment;
    const [mark, start, kind] = [this.mark.value, this.frame.value, this.way.value?.description.kind];
    if (finds !== null) return mark !== null && kind === finds && this.left.value === 0 ? { mark, start } : null;
    if (mark !== null) return { mark, start };
    return kind === undefined || unmarked.includes(this.upload.kind) ? { start } : null;
  });
  /** Aborts the previous request: only the newest one counts. */
  #asked = new AbortController();
  #showSoon = throttle(() => this.#show(), PICTURE_EVERY_MS);

  /**
   * @param {UploadPublic} upload
   * @param {ExperimentPublic} experiment
   * @param {number} [frame]
   * @param {string} [proposal] Why this experiment is proposed, a sentence or more.
   */
  constructor(upload, experiment, frame = 0, proposal = "") {
    this.upload = upload;
    this.experiment = experiment;
    this.ids = { upload: upload.id, experiment: experiment.id };
    this.proposal = proposal;
    /** The frame to begin with. */
    this.frame = signal(frame);
    this.tracker = signal(experiment.default_tracker);
    this.found = descriptionOf(experiment, experiment.finds);
    this.hint = descriptionOf(experiment, experiment.hints[0]);
    this.#show();
    if (experiment.finds === null) this.markBy(experiment.marks[0]?.kind);
    else this.find();
  }

  /** Return the target for another experiment, from the same frame on; itself for the same experiment.
   *
   * @param {ExperimentPublic} experiment
   * @param {string} [proposal]
   */
  as(experiment, proposal) {
    if (experiment === this.experiment) return this;
    this.leave();
    return new Target(this.upload, experiment, this.frame.value, proposal);
  }

  /** Stop searching. */
  leave() {
    this.#asked.abort();
  }

  /** Show another frame. A mark stays; findings in the old frame are dropped.
   *
   * @param {number} frame
   */
  go(frame) {
    this.frame.value = frame;
    this.#showSoon();
    if (this.experiment.finds !== null) this.#forget();
  }

  /** Let a person mark the target, or hint at the place to search.
   *
   * @param {string|undefined} kind
   */
  markBy(kind) {
    this.#forget();
    this.#edit(kind)?.offer();
    if (this.experiment.finds !== null) this.#tell("marking", []);
  }

  /** Show a mark for correction.
   *
   * @param {Mark} mark
   * @param {string[]} [placed] Its guessed handles.
   */
  take(mark, placed) {
    this.#edit(String(mark.kind))?.set(mark, placed);
  }

  /** Search for the target from the shown frame on, or only in it. */
  find({ alone = false } = {}) {
    this.#forget();
    return this.#look(alone ? { last: this.frame.value } : {});
  }

  /** Search for the target at a person's hint. */
  place() {
    return this.#look({ hint: JSON.stringify(this.mark.value) });
  }

  /** End a search. */
  stop() {
    this.leave();
    this.#tell("refused", ["The search was stopped."]);
  }

  /** Check whether there is truth already; on an error it can be uploaded again. */
  async findTruth() {
    const kept = await request("GET uploads/{upload}/truth", this.ids).catch(() => null);
    if (kept !== null && this.truth.value === NO_TRUTH) this.truth.value = { ...NO_TRUTH, kept };
  }

  /** @param {File[]} files */
  async giveTruth(files) {
    this.truth.value = { ...NO_TRUTH, isBusy: true };
    try {
      const kept = await request("PUT uploads/{upload}/truth", { ...this.ids, body: formOf(files) });
      this.truth.value = { ...NO_TRUTH, kept };
    } catch (error) {
      const refused = `${files.map(({ name }) => name).join(", ")} was not accepted. ${messageOf(error)}`;
      this.truth.value = { ...NO_TRUTH, refused };
    }
  }

  async removeTruth() {
    const removed = await attempt(() => request("DELETE uploads/{upload}/truth", this.ids));
    if (removed === null) this.truth.value = NO_TRUTH;
  }

  /** Start a session, and go there. */
  async start() {
    this.isStarting.value = true;
    try {
      const recipe = { experiment: this.experiment.id, tracker: this.tracker.value, footage: this.footage.value };
      const session = await request("POST sessions", { body: { recipe, upload: this.upload.id } });
      location.assign(session.page);
    } catch (error) {
      this.wrong.value = messageOf(error);
      this.isStarting.value = false;
    }
  }

  /** Search the frames from the shown one on, at most up to `last`; `hint` is a mark of the place.
   *
   * @param {{last?: number, hint?: string}} where
   */
  async #look(where) {
    this.leave();
    const { signal: ended } = (this.#asked = new AbortController());
    const frame = this.frame.value;
    try {
      const sighting = await this.#search(where, ended);
      const isNowhere = sighting?.mark === null && where.last === undefined && where.hint === undefined;
      // Report why the requested frame has no target, or show a possible one.
      const known = isNowhere ? await this.#search({ last: frame }, ended) : sighting;
      if (known?.mark) this.#found({ ...known, mark: known.mark });
      else if (known) this.#tell("refused", isNowhere ? [...known.remarks, "None was found in later frames either."] : known.remarks, { hasLater: !isNowhere });
    } catch (error) {
      if (!ended.aborted) this.#tell("refused", [messageOf(error)]);
    }
  }

  /** Repeat the request until there is an answer; null if nobody waits for it any more.
   *
   * @param {{last?: number, hint?: string}} where
   * @param {AbortSignal} ended
   */
  async #search(where, ended) {
    const words = `Looking for a ${this.experiment.target}`;
    const question = { ...this.ids, frame: this.frame.value, ...where };
    this.#tell("looking", [words]);
    for (let looked = 0; !ended.aborted; ) {
      const answer = await request("GET uploads/{upload}/mark", { ...question, looked });
      if (ended.aborted) break;
      if (answer.mark !== null || answer.looked >= answer.of) return answer;
      looked = answer.looked;
      this.#tell("looking", [`${words}, ${looked} of ${answer.of} frames`], { share: looked / answer.of });
    }
    return null;
  }

  /** @param {SightingPublic & {mark: Mark}} sighting */
  #found({ frame, mark, placed, remarks }) {
    const wanted = this.frame.value;
    const late = `Starting at picture ${wanted}, the first suitable ${this.experiment.target} is in picture ${frame}.`;
    this.frame.value = frame;
    this.#show();
    this.take(mark, placed);
    this.#tell("found", frame === wanted ? remarks : [late, ...remarks], { isGuessed: placed.length > 0 });
  }

  /**
   * @param {Finding["state"]} state
   * @param {string[]} notes
   * @param {Partial<Finding>} [more]
   */
  #tell(state, notes, { share = null, isGuessed = false, hasLater = true } = {}) {
    this.finding.value = { state, notes, share, isGuessed, hasLater: hasLater && this.frame.value < this.upload.frames - 1 };
  }

  /** Show no mark, and stop searching. */
  #forget() {
    this.leave();
    this.#edit(this.experiment.finds ?? this.way.value?.description.kind)?.set(null);
    this.finding.value = null;
  }

  /**
   * The editor for a kind of mark.
   *
   * @param {string|undefined} kind
   */
  #edit(kind) {
    const description = descriptionOf(this.experiment, kind);
    if (description === undefined) this.way.value = null;
    else if (this.way.value?.description !== description) {
      this.way.value = { description, editor: markEditor(description, this.experiment.target) };
      this.#show();
    }
    return this.way.value?.editor;
  }

  #show() {
    const { id, width, height } = this.upload;
    this.picture.value = addressOf("GET uploads/{upload}/frames/{frame}.jpg", { upload: id, frame: this.frame.value });
    this.way.value?.editor.picture.show(this.picture.value, width, height);
  }
}
