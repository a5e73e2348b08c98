/** A field for Python: CodeMirror in the page's colours, with hints and with a mistake at its line. */

import {
  EditorView,
  HighlightStyle,
  autocompletion,
  basicSetup,
  indentUnit,
  indentWithTab,
  keymap,
  lintGutter,
  python,
  pythonLanguage,
  setDiagnostics,
  syntaxHighlighting,
  tags,
} from "../../vendor/codemirror.js";

/** @import { FilterPublic, SessionProblem } from "../../shared/messages.js" */

const COLOURS = HighlightStyle.define([
  { tag: [tags.keyword, tags.operatorKeyword], color: "light-dark(#0b5394, #7cc4ff)" },
  { tag: [tags.string, tags.docString], color: "light-dark(#7a4b00, #f0c674)" },
  { tag: tags.comment, color: "light-dark(#5a6169, #a3acb5)", fontStyle: "italic" },
  { tag: tags.number, color: "light-dark(#0b6b53, #6fd6b5)" },
  { tag: [tags.function(tags.definition(tags.variableName)), tags.definition(tags.className)], fontWeight: "600" },
]);

const THEME = EditorView.theme({
  "&": { color: "var(--ink)", backgroundColor: "var(--surface)" },
  ".cm-content": { caretColor: "var(--ink)", fontFamily: "ui-monospace, monospace" },
  ".cm-cursor": { borderLeftColor: "var(--ink)" },
  ".cm-gutters": { color: "var(--muted)", backgroundColor: "var(--well)", border: "0" },
  ".cm-activeLine, .cm-activeLineGutter": { backgroundColor: "light-dark(#0000000a, #ffffff0f)" },
  "&.cm-focused .cm-selectionBackground, .cm-selectionBackground, ::selection": { backgroundColor: "light-dark(#bcd9f5, #2f4d6b) !important" },
  ".cm-tooltip": { color: "var(--ink)", backgroundColor: "var(--raised)", border: "1px solid var(--line)", maxWidth: "30rem" },
});

export class CodeField {
  #view;
  /** The mistake that has been brought into sight; one is told again whenever the run moves. */
  #seen = "";

  /**
   * @param {HTMLElement} parent
   * @param {FilterPublic} file
   * @param {{onChange: () => void, onSave: () => void}} told
   */
  constructor(parent, file, { onChange, onSave }) {
    const save = () => {
      onSave();
      return true;
    };
    this.#view = new EditorView({
      parent,
      doc: file.text,
      extensions: [
        keymap.of([{ key: "Mod-s", preventDefault: true, run: save }, indentWithTab]),
        basicSetup,
        indentUnit.of("    "),
        python(),
        pythonLanguage.data.of({ autocomplete: hints(file) }),
        autocompletion(),
        lintGutter(),
        syntaxHighlighting(COLOURS),
        THEME,
        EditorView.contentAttributes.of({ "aria-label": file.file }),
        EditorView.updateListener.of((/** @type {{docChanged: boolean}} */ update) => update.docChanged && onChange()),
      ],
    });
  }

  get text() {
    return this.#view.state.doc.toString();
  }

  set text(text) {
    const { state } = this.#view;
    this.#view.dispatch({ changes: { from: 0, to: state.doc.length, insert: text } });
  }

  focus() {
    this.#view.focus();
  }

  /**
   * Mark a mistake at its line, or none; one that is new comes into sight.
   *
   * @param {SessionProblem|null} problem
   */
  mark(problem) {
    const { state } = this.#view;
    const number = problem?.line ?? 0;
    const line = number >= 1 && number <= state.doc.lines ? state.doc.line(number) : null;
    const marks = problem && line ? [{ from: line.from, to: line.to, severity: "error", message: problem.text }] : [];
    this.#view.dispatch(setDiagnostics(state, marks));
    const seen = problem && line ? `${number} ${problem.text}` : "";
    if (seen !== this.#seen && line) this.#view.dispatch({ effects: EditorView.scrollIntoView(line.from, { y: "center" }) });
    this.#seen = seen;
  }
}

/**
 * Complete the names of functions that a file may define, with what they get and return.
 *
 * @param {FilterPublic} file
 */
function hints({ hints: known, components, observed }) {
  const columns = components.map(({ name, unit }) => (unit ? `${name} (${unit})` : name)).join(", ");
  const options = known.map(({ name, arguments: given, returns, about }) => ({
    label: name,
    type: "function",
    detail: `(${given.join(", ")}) → ${returns}`,
    info: `${about} Columns of states: ${columns}. ${observed}.`,
    apply: `def ${name}(${given.join(", ")}):\n    `,
  }));
  return (/** @type {{matchBefore: (pattern: RegExp) => {from: number, text: string}|null, explicit: boolean}} */ context) => {
    const word = context.matchBefore(/^(def )?\w*/);
    if (word === null || (word.text === "" && !context.explicit)) return null;
    return { from: word.from, options: options.map((one) => ({ ...one, label: word.text.startsWith("def ") ? `def ${one.label}` : one.label })) };
  };
}
