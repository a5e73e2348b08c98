/** The references page: what each experiment comes from, to be cited. */

import { api, messageOf } from "../shared/api.js";
import { citationList } from "../shared/citations.js";
import { fill, h, part } from "../shared/dom.js";
import { themeButton } from "../shared/theme.js";

part("tools").append(themeButton());
try {
  const experiments = await api.experiments();
  fill(
    part("references"),
    experiments.map(({ id, title, references }) => h("section", { id, "aria-label": title }, h("h2", {}, title), citationList(references))),
  );
  document.querySelector(`[id="${CSS.escape(location.hash.slice(1))}"]`)?.scrollIntoView();
} catch (error) {
  fill(part("references"), h("p", { class: "wrong", role: "alert" }, messageOf(error)));
}
