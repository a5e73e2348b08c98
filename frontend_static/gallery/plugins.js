/** What is wrong with experiments of other packages. */

import { api } from "../shared/api.js";
import { fill, h } from "../shared/dom.js";

/**
 * Say of each experiment of another package that cannot be used why; nothing at all when all can.
 *
 * @param {HTMLElement} root
 */
export async function pluginProblems(root) {
  const problems = (await api.plugins()).map((plugin) => plugin.problem).filter(Boolean);
  root.hidden = problems.length === 0;
  fill(root, h("ul", { class: "problems" }, problems.map((problem) => h("li", {}, problem))));
}
