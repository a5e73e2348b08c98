/** An editor for a person's own filter next to its session: saved with Ctrl-S, with errors marked at their line. */

import { messageOf, request } from "../shared/api.js";
import { IconButton } from "../shared/dom.js";
import {
  autocompletion, basicSetup, EditorView, HighlightStyle, indentUnit, indentWithTab, keymap, lintGutter, python, pythonLanguage, setDiagnostics,
  syntaxHighlighting, tags,
} from "../vendor/codemirror.js";
import { h, html, useEffect, useRef, useSignal } from "../vendor/preact.js";

/** @import { FilterPublic, SessionProblem, SessionPublic } from "../shared/messages.js" */
/** @import { Store } from "./store.js" */

const COLOURS = HighlightStyle.define([
  { tag: [tags.keyword, tags.operatorKeyword], color: "light-dark(#0b5394, #7cc4ff)" },
  { tag: [tags.string, tags.docString], color: "light-dark(#7a4b00, #f0c674)" },
  { tag: tags.comment, color: "light-dark(#5a6169, #a3acb5)", fontStyle: "italic" },
  { tag: tags.number, color: "light-dark(#0b6b53, #6fd6b5)" },
  { tag: [tags.function(tags.definition(tags.variableName)), tags.definition(tags.className)], fontWeight: "600" },
]);

/**
 * @param {FilterPublic} file
 * @param {(text: string) => void} change Called at every change of the text.
 * @param {() => void} save
 */
function extensions(file, change, save) {
  const run = () => {
    save();
    return true;
  };
  return [
    keymap.of([{ key: "Mod-s", preventDefault: true, run }, indentWithTab]),
    basicSetup,
    indentUnit.of("    "),
    python(),
    pythonLanguage.data.of({ autocomplete: hints(file) }),
    autocompletion(),
    lintGutter(),
    syntaxHighlighting(COLOURS),
    EditorView.contentAttributes.of({ "aria-label": file.file }),
    EditorView.updateListener.of(({ docChanged, state }) => docChanged && change(state.doc.toString())),
  ];
}

/** A transaction that marks an error at its line and scrolls to it; null clears the mark.
 *
 * @param {EditorView["state"]} state
 * @param {SessionProblem|null} problem
 */
function marked(state, problem) {
  const number = problem?.line ?? 0;
  const line = number >= 1 && number <= state.doc.lines ? state.doc.line(number) : null;
  const marks = problem && line ? [{ from: line.from, to: line.to, severity: "error", message: problem.text }] : [];
  return [setDiagnostics(state, marks), ...(line ? [{ effects: EditorView.scrollIntoView(line.from, { y: "center" }) }] : [])];
}

/** Complete the names of functions that a file may define, with their arguments and results.
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

/** A file saved by another editor is loaded once the session uses it, unless there are unsaved changes here.
 *
 * @param {{store: Store, file: FilterPublic, close: () => void}} props
 */
export function Editor({ store, file: first, close }) {
  const file = useSignal(first);
  const text = useSignal(first.text);
  const said = useSignal("");
  const place = useRef(/** @type {HTMLElement|null} */ (null));
  const field = useRef(/** @type {EditorView|null} */ (null));
  const save = async () => {
    try {
      file.value = await request("PUT filters/{name}", { name: file.value.name, body: { text: text.value, before: file.value.digest } });
      said.value = "Saved.";
    } catch (error) {
      said.value = `Not saved: ${messageOf(error)}`;
    }
  };
  const { problem = null, recipe } = store.session ?? {};
  const { name } = file.value;
  const isChanged = text.value !== file.value.text;
  const own = problem?.file === file.value.file ? problem : null;
  const versions = recipe?.filters?.[name];
  const newest = Array.isArray(versions) ? versions.at(-1) : undefined;
  useEffect(() => {
    const change = (/** @type {string} */ next) => {
      text.value = next;
      said.value = "";
    };
    const parent = /** @type {HTMLElement} */ (place.current);
    field.current = new EditorView({ parent, doc: first.text, extensions: extensions(first, change, save) });
    field.current.focus();
  }, []);
  useEffect(() => field.current?.dispatch(...marked(field.current.state, own)), [own?.line, own?.text]);
  useEffect(() => {
    if (newest !== undefined && newest !== file.value.digest && !isChanged) follow();
  }, [newest]);
  const follow = async () => {
    const found = (await request("GET filters")).find((each) => each.name === name);
    if (found === undefined || text.value !== file.value.text) return;
    file.value = found;
    if (text.value !== found.text) field.current?.dispatch({ changes: { from: 0, to: field.current.state.doc.length, insert: found.text } });
  };
  return html`
    <div class="editor-bar">
      <h2 class=${isChanged ? "unsaved" : ""}>${file.value.file}</h2>
      <button type="button" class="primary" title="Save (Ctrl-S)" onClick=${save}>Save</button>
      ${h(IconButton, { name: "close", title: "Close the editor", run: close })}
    </div>
    <div class="editor-text" ref=${place}></div>
    ${h(State, { session: store.session, file: file.value, own, isChanged, said: said.value })}
  `;
}

/** Whether the file is saved and runs, or its error.
 *
 * @param {{session: SessionPublic|null, file: FilterPublic, own: SessionProblem|null, isChanged: boolean, said: string}} props
 */
function State({ session, file: { name, file }, own, isChanged, said }) {
  const version = `This text is version ${session?.parameters[`${name}_version`]}: it computes the frames after ${session?.position}.`;
  const running = session?.tracker === name ? `${version} Older versions' frames stay in other branches.` : `Choose ${file} as the tracker to run it.`;
  const words = isChanged ? "Unsaved. Ctrl-S saves and continues in a new branch." : running;
  const mistake = own && `${own.line === null ? "" : `Line ${own.line}: `}${own.text}`;
  const isWrong = own !== null || said.startsWith("Not");
  return html`<p class=${isWrong ? "editor-state wrong" : "editor-state"} role="status">${mistake ?? `${said} ${words}`.trim()}</p>`;
}
