/** The course of a lesson: the question first, then what answers it, and then everything can be turned. */

import { fill, part } from "../shared/dom.js";
import { after } from "../shared/timing.js";
import { lessons } from "./api.js";
import { Demonstration } from "./demonstration.js";
import { Progress } from "./progress.js";
import { Question } from "./question.js";
import { ScenarioStage } from "./scenario.js";

/** @import { LessonDetail, LessonsPublic, VerdictPublic } from "../shared/messages.js" */

const AGAIN_MS = 300;

export class Course {
  #lesson;
  #all;
  #signal;
  #progress = new Progress();
  /** @type {Question} */
  #question;
  /** @type {Demonstration|ScenarioStage} */
  #stage;
  #known = () => {};
  /** @type {(() => void)|null} */
  #askClass = null;

  /**
   * @param {LessonDetail} lesson
   * @param {LessonsPublic} all
   * @param {(isLost: boolean) => void} lost
   * @param {AbortSignal} signal
   */
  constructor(lesson, all, lost, signal) {
    this.#lesson = lesson;
    this.#all = all.lessons.filter(({ number }) => number > 0);
    this.#signal = signal;
    this.#question = new Question(part("question"), lesson, {
      answer: async (given) => this.#reveal(await this.#judged(given)),
      skip: () => this.#skip(),
      again: () => this.#again(),
      toClass: () => this.#askClass?.(),
    });
    const places = { show: part("show"), numbers: part("numbers"), controls: part("controls") };
    this.#stage = lesson.scenario
      ? new ScenarioStage(places, lesson.scenario, { isLocked: true, known: () => this.#known() })
      : new Demonstration(places, lesson, { placed: (value) => this.#question.placed(value), lost }, signal);
    this.#begin();
  }

  /** Draw other random numbers, where there are some. */
  draw() {
    if (this.#stage instanceof Demonstration) this.#stage.draw();
  }

  /** The run that is the lesson, where it is one. */
  get run() {
    return this.#stage instanceof ScenarioStage ? this.#stage : null;
  }

  /**
   * Be told when it is known which session that is.
   *
   * @param {() => void} known
   */
  onRun(known) {
    this.#known = known;
  }

  /**
   * Have a class see each figure that is shown from now on, the one that is shown now included.
   *
   * @param {string|null} follow Null for no class.
   */
  followedBy(follow) {
    if (this.#stage instanceof Demonstration) this.#stage.followedBy(follow);
  }

  /**
   * Offer to ask a class the question.
   *
   * @param {(() => void)|null} ask Null where no class sees the lesson.
   */
  offerClass(ask) {
    this.#askClass = ask;
    this.#question.offerClass(ask !== null);
  }

  #begin() {
    const entry = this.#progress.of(this.#lesson.id);
    if (entry !== null && "skipped" in entry) {
      this.#look();
      return;
    }
    this.#ask();
    // What was asked then may be another question by now.
    if (entry !== null) this.#judged(entry.given).then((verdict) => this.#reveal(verdict), () => {});
  }

  /** Ask, and show nothing that answers. */
  #ask() {
    this.#stage.veil();
    this.#question.ask();
    this.#tell();
  }

  #again() {
    this.#progress.set(this.#lesson.id, null);
    this.#ask();
  }

  #skip() {
    this.#progress.set(this.#lesson.id, { skipped: true });
    this.#look();
  }

  /** Show everything once a class has answered: it sees the figure with its lecturer. */
  answered() {
    if (part("question").dataset.stage !== "asked") return;
    this.#stage.reveal(null);
    this.#question.answeredByClass();
  }

  /** Show everything to who did not want to answer. */
  #look() {
    this.#stage.reveal(null);
    this.#question.skipped();
    this.#tell();
  }

  /** @param {VerdictPublic} verdict */
  #reveal(verdict) {
    this.#progress.set(this.#lesson.id, { given: verdict.given, right: verdict.right });
    this.#stage.reveal(verdict);
    this.#question.say(verdict);
    this.#tell();
  }

  /** Say how far the course is. */
  #tell() {
    const { remark } = this.#progress;
    part("progress").hidden = this.#all.length === 0;
    fill(part("progress"), `${this.#progress.done(this.#all)} of ${this.#all.length} done`);
    fill(part("remark"), remark);
    part("remark").hidden = remark === "";
  }

  /**
   * Have an answer judged; a run that has to be computed for it is waited for.
   *
   * @param {number|string} given
   * @returns {Promise<VerdictPublic>}
   */
  async #judged(given) {
    for (;;) {
      const said = await lessons.answer(this.#lesson.id, given);
      if ("words" in said) return said;
      this.#question.computing(said.done, said.total);
      await after(AGAIN_MS, this.#signal);
    }
  }
}
