// Keeps a person's folds in the panel. viser resets all folds when the scene reconnects and when the page is loaded; so they are stored
// under the title of the panel, which is the experiment's. The flat view's panel stores its folds in the same place (`session/panel.js`).
const HEADING = ".mantine-Paper-root > .mantine-Paper-root:has(> .tabler-icon-chevron-up, > .tabler-icon-chevron-down)";
const titleOf = (/** @type {Element|null} */ element) => element?.textContent?.trim() ?? "";
const isUnfolded = (/** @type {Element} */ heading) => heading.querySelector(".tabler-icon-chevron-up") !== null;
const place = () => `pftrack-folds ${titleOf(document.querySelector("[data-dock-header]"))}`;
/** @returns {Record<string, boolean>} */
const remembered = () => {
  try {
    return JSON.parse(localStorage.getItem(place()) ?? "{}");
  } catch {
    return {};
  }
};
const restore = (/** @type {HTMLElement} */ heading) => {
  const wanted = remembered()[titleOf(heading)];
  if (wanted !== undefined && wanted !== isUnfolded(heading)) heading.click();
};
addEventListener(
  "click",
  (event) => {
    const heading = event.target instanceof Element ? event.target.closest(HEADING) : null;
    // Only a person's changes, not those restored here.
    if (heading === null || !event.isTrusted) return;
    try {
      localStorage.setItem(place(), JSON.stringify({ ...remembered(), [titleOf(heading)]: !isUnfolded(heading) }));
    } catch {
      // Without storage the folds last until the scene reconnects.
    }
  },
  true,
);
new MutationObserver((changes) => {
  for (const node of changes.flatMap(({ addedNodes }) => [...addedNodes])) {
    if (!(node instanceof HTMLElement)) continue;
    const headings = /** @type {HTMLElement[]} */ ([...node.querySelectorAll(HEADING)]);
    for (const heading of node.matches(HEADING) ? [node, ...headings] : headings) restore(heading);
  }
}).observe(document, { childList: true, subtree: true });
