/** The references page: what each experiment comes from, to be cited. */

import { api, messageOf } from "../shared/api.js";
import { citationList } from "../shared/citations.js";
import { fill, h, part } from "../shared/dom.js";
import { navigation } from "../shared/navigation.js";
import { notice } from "../shared/notice.js";
import { themeButton } from "../shared/theme.js";
import { later } from "../shared/timing.js";

const SKELETON_AFTER_MS = 200;
const root = part("references");

navigation(null);
part("tools").append(themeButton());
begin();

async function begin() {
  const bone = () => h("section", { "aria-hidden": "true" }, h("div", { class: "bone short shimmer" }), h("div", { class: "bone shimmer" }));
  const there = later(() => fill(root, bone(), bone(), bone()), SKELETON_AFTER_MS);
  try {
    const experiments = await api.experiments();
    there();
    fill(root, experiments.map(({ id, title, references }) => h("section", { id, "aria-label": title }, h("h2", {}, title), citationList(title, references))));
    document.querySelector(`[id="${CSS.escape(location.hash.slice(1))}"]`)?.scrollIntoView();
  } catch (error) {
    there();
    fill(root, notice("The references could not be listed", messageOf(error), { label: "Try again", run: begin }, { inline: true }));
  }
}
