/** Moving through several runs in step: the one that leads is moved, and the others follow it. */

import { Steering } from "../session/steering.js";

export class JointSteering extends Steering {
  #joint;

  /**
   * @param {import("../session/store.js").Store} lead
   * @param {import("./joint_store.js").JointStore} joint
   * @param {AbortSignal} signal
   */
  constructor(lead, joint, signal) {
    super(lead, signal);
    this.#joint = joint;
  }

  eventFrames() {
    return this.#joint.eventFrames;
  }

  /** Go to before the first loss of any run, also where it has not been computed here yet. */
  async beforeLoss() {
    if (this.#joint.beforeLoss !== null) await this.seek(this.#joint.beforeLoss);
  }
}
