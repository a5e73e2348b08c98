/** The glossary page: what the words on all pages mean. */

import { api, messageOf } from "../shared/api.js";
import { fill, h, part } from "../shared/dom.js";
import { navigation } from "../shared/navigation.js";
import { notice } from "../shared/notice.js";
import { themeButton } from "../shared/theme.js";

const root = part("glossary");

navigation("help");
part("tools").append(themeButton());
begin();

async function begin() {
  try {
    const sections = await api.glossary();
    const listed = sections.filter(({ terms }) => terms.length > 0);
    fill(root, listed.map(({ title, terms }) => {
      const meanings = terms.map(({ name, meaning }) => [h("dt", {}, name), h("dd", {}, meaning)]);
      return h("section", { "aria-label": title }, h("h2", {}, title), h("dl", {}, meanings));
    }));
  } catch (error) {
    fill(root, notice("The glossary could not be shown", messageOf(error), { label: "Try again", run: begin }, { inline: true }));
  }
}
