/** While somebody looks at the start page, fetch what a session's page will need. */

import { h } from "../shared/dom.js";
import { idle } from "../shared/timing.js";

const PAGE = "session/new";

/** What was fetched ahead is used once, for some minutes, without asking the server again. */
export async function ahead() {
  await idle();
  try {
    const answer = await fetch(PAGE);
    const page = new DOMParser().parseFromString(await answer.text(), "text/html");
    const modules = [...page.querySelectorAll("link[rel=modulepreload]")].map((link) => link.getAttribute("href"));
    for (const script of modules) document.head.append(h("link", { rel: "prefetch", href: script, as: "script" }));
  } catch {
    // Then it is fetched when it is needed.
  }
}
