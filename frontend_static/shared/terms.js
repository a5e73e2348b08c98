/** Explanations of words on all pages. An explained word has a dotted underline. Pointing at it, tapping it or reaching it by Tab shows its
 meaning; Escape hides it. */

import { h, html } from "../vendor/preact.js";
import { request } from "./api.js";
import { build, CopyButton, Tooltip } from "./dom.js";

/** @import { CitationPublic, Section, Term } from "./messages.js" */

// The references of an experiment, to read and to copy.

/** The page of all references. */
export const REFERENCES = "references";

/**
 * The citations of an experiment, with buttons that copy all of them.
 *
 * @param {{title: string, citations: CitationPublic[]}} props `title` of the experiment.
 */
export function Citations({ title, citations }) {
  return html`<div class="citations">
    ${citations.map(({ text }) => html`<p>${text}</p>`)}
    <div class="citation-tools">
      ${h(CopyButton, { label: "Copy citation", text: citations.map(({ text }) => text).join("\n"), what: title })}
      ${h(CopyButton, { label: "Copy BibTeX", text: citations.map(({ bibtex }) => bibtex).join("\n"), what: title })}
    </div>
  </div>`;
}

/** The page of all words. */
export const GLOSSARY = "glossary";
/** Elements in which no words are marked: controls, or elements already marked. */
const APART = ".term, button, a, input, select, textarea, canvas, svg, output";
/** Pages with so many words that none is a tab stop: F1 on a control explains it, and so does the glossary. */
const POINTED = "session";
/** Explained elements: mere words, and elements with an action of their own. */
const MARKED = ".term, .explained";

/** The words known on a page of an experiment. */
class Words {
  #known;
  #pattern;

  /** @param {Section[]} sections */
  constructor(sections) {
    // Later words, those of an experiment, override the shared ones.
    this.#known = new Map(sections.flatMap(({ terms }) => terms.flatMap((term) => [term.name, ...term.also].map((form) => [form.toLowerCase(), term]))));
    const forms = [...this.#known.keys()].sort((one, other) => other.length - one.length).map((form) => form.replace(/[.*+?^${}()|[\]\\]/gu, "\\$&"));
    this.#pattern = new RegExp(`(?<![\\p{L}\\p{N}-])(?:${forms.join("|") || "(?!)"})(?![\\p{L}\\p{N}-])`, "giu");
  }

  /** The known words in a text, with their places.
   *
   * @param {string} text
   * @returns {{from: number, to: number, term: Term}[]}
   */
  in(text) {
    return [...text.matchAll(this.#pattern)].flatMap(({ 0: form, index }) => {
      const term = this.#known.get(form.toLowerCase());
      return term ? [{ from: index, to: index + form.length, term }] : [];
    });
  }
}

/** @type {Promise<Section[]>|null} */
let sections = null;
/** @type {Map<string, Promise<Words>>} By experiment. */
const words = new Map();

/**
 * The words that all experiments share, and those of one.
 *
 * @param {string} experiment
 */
function wordsOf(experiment) {
  sections ??= request("GET glossary");
  const found = words.get(experiment) ?? sections.then((all) => new Words(all.filter((each) => each.experiment === null || each.experiment === experiment)));
  words.set(experiment, found);
  return found;
}

/**
 * The explanation of each marked word: its own, and the experiment whose glossary has others.
 *
 * @type {WeakMap<Element, {own: string, experiment: string}>}
 */
const said = new WeakMap();

/** Mark the glossary's words in an element; or the whole element, if it has its own explanation. A caller that changes the text marks it
 * again; existing marks stay.
 *
 * @param {HTMLElement} element
 * @param {{own?: string, experiment?: string}} [options] The explanation of the whole; the experiment whose words it has.
 */
export function explain(element, { own = "", experiment = "" } = {}) {
  if (own !== "") {
    const first = element.firstElementChild;
    if (first?.classList.contains("term") && element.childNodes.length === 1) return;
    const marked = markedTerm(...element.childNodes);
    element.append(marked);
    said.set(marked, { own, experiment });
    return;
  }
  const text = element.textContent;
  // Without the glossary the words are not marked.
  wordsOf(experiment).then((known) => {
    if (element.textContent === text) markWords(element, known, experiment);
  }, () => {});
}

/** Explain an element with an action, such as a checkbox, which keeps its action.
 *
 * @param {HTMLElement} element
 * @param {string} own
 * @param {string} [experiment]
 */
export function explainControl(element, own, experiment = "") {
  element.classList.add("explained");
  said.set(element, { own, experiment });
}

/** A text with its words marked, or marked as a whole if it has its own explanation.
 *
 * @param {{text: string, own?: string, experiment?: string}} props
 */
export function Explained({ text, own, experiment }) {
  const mark = (/** @type {HTMLElement|null} */ element) => {
    if (element === null || element.textContent !== "") return;
    element.textContent = text;
    explain(element, { own, experiment });
  };
  return html`<span key=${text} ref=${mark}></span>`;
}

/** @param {...(Node|string)} content Content that breaks like text within a line, unlike a button. */
function markedTerm(...content) {
  return build("span", { class: "term", role: "button", tabindex: document.body.classList.contains(POINTED) ? -1 : 0 }, content);
}

/**
 * @param {HTMLElement} element
 * @param {Words} known
 * @param {string} experiment
 */
function markWords(element, known, experiment) {
  const walker = document.createTreeWalker(element, NodeFilter.SHOW_TEXT);
  /** @type {Text[]} */
  const texts = [];
  while (walker.nextNode()) if (walker.currentNode instanceof Text && !walker.currentNode.parentElement?.closest(APART)) texts.push(walker.currentNode);
  for (const node of texts) {
    /** @type {(string|Node)[]} */
    const parts = [];
    let done = 0;
    for (const { from, to } of known.in(node.data)) {
      const marked = markedTerm(node.data.slice(from, to));
      said.set(marked, { own: "", experiment });
      parts.push(node.data.slice(done, from), marked);
      done = to;
    }
    if (done > 0) node.replaceWith(...parts, node.data.slice(done));
  }
}

const MEANING = "meaning";
const tooltip = new Tooltip({ id: MEANING, role: "tooltip" });
/** @type {Element|null} */
let shown = null;

/** @param {Element} marked */
async function show(marked) {
  const about = said.get(marked);
  if (about === undefined || marked === shown) return;
  hide();
  shown = marked;
  const known = await wordsOf(about.experiment).catch(() => new Words([]));
  if (shown !== marked || !marked.isConnected) return;
  const terms = new Set(known.in(marked.textContent ?? "").map(({ term }) => term));
  const meanings = [...terms].map(({ name, meaning }) => build("p", {}, build("strong", {}, name), ` – ${meaning}`));
  const within = marked.closest("dialog[open], [popover], main, header") ?? document.body;
  tooltip.show([about.own !== "" && build("p", {}, about.own), meanings], placeOf(marked), within);
  marked.setAttribute("aria-describedby", MEANING);
}

/** @param {Element} marked */
function placeOf(marked) {
  const { left, width, top, bottom } = marked.getBoundingClientRect();
  return { x: left + width / 2, y: top, below: bottom };
}

/** The explanation moves with scrolling; a hidden word is scrolled into view when it gets the focus. */
function follow() {
  if (shown !== null) tooltip.move(placeOf(shown));
}

function hide() {
  shown?.removeAttribute("aria-describedby");
  shown = null;
  tooltip.hide();
}

/** @param {Event} event */
function markedOf({ target }) {
  return target instanceof Element ? target.closest(MARKED) : null;
}

if (typeof document !== "undefined") {
  document.addEventListener("pointerover", (event) => {
    const marked = markedOf(event);
    if (marked !== null) show(marked);
    else if (shown !== null && shown !== document.activeElement) hide();
  });
  document.addEventListener("focusin", (event) => {
    const marked = markedOf(event);
    if (marked === null) hide();
    else show(marked);
  });
  document.addEventListener("focusout", hide);
  document.addEventListener("scroll", follow, { capture: true, passive: true });
  document.addEventListener("pointerdown", (event) => markedOf(event) ?? hide());
  document.addEventListener("click", (event) => {
    const marked = markedOf(event);
    // A tap does not reach the label or summary around it; a mouse shows the meaning on hover.
    if (marked === null || !marked.classList.contains("term") || event.pointerType === "mouse") return;
    event.preventDefault();
    event.stopPropagation();
    show(marked);
  }, { capture: true });
  document.addEventListener("keydown", (event) => {
    const control = event.key === "F1" && event.target instanceof Element && event.target.closest(".control");
    const marked = control && (control.matches(".explained") ? control : control.querySelector(".explained"));
    if (marked) {
      event.preventDefault();
      show(marked);
    }
    if (event.key !== "Escape" || shown === null) return;
    event.preventDefault();
    event.stopPropagation();
    hide();
  }, { capture: true });
}
