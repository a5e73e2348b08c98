/**
 * Editors of marks: one for boxes, and one for all kinds that consist of handles and numbers, which also does for kinds
 * that other packages bring along.
 */

import { BoxEditor } from "./box_editor.js";
import { HandlesEditor } from "./handles_editor.js";

/** @import { Description, Mark } from "./mark_json.js" */

/**
 * What every editor can do.
 *
 * @typedef {object} MarkEditor
 * @property {HTMLElement} element What is put into the page.
 * @property {Mark|null} mark As the server takes it; null while there is none.
 * @property {number} left How many of its parts still stand where they were offered.
 * @property {(address: string, width: number, height: number) => void} show Show a picture of this size.
 * @property {(mark: Mark|null, placed?: string[]) => void} set Show a mark, or none; the handles that were
 *     `placed` rather than found are hollow until somebody moves them.
 * @property {() => void} offer Begin to have one made.
 * @property {() => void} focus
 * @property {(event: PointerEvent) => boolean} [centre] Put the mark, as large as it is, around a pointer; false if there is none.
 */

/** @type {Record<string, new (description: Description, target: string, changed: () => void) => MarkEditor>} */
const OWN = { box: BoxEditor };

/**
 * @param {Description} description The kind of mark, as an experiment declares it.
 * @param {string} target What is marked, one word.
 * @param {() => void} changed Called when a person has changed the mark.
 * @returns {MarkEditor}
 */
export function markEditor(description, target, changed) {
  const Editor = OWN[description.kind] ?? HandlesEditor;
  return new Editor(description, target, changed);
}

/**
 * What an experiment says of a kind of mark that it takes.
 *
 * @param {import("../messages.js").ExperimentPublic} experiment
 * @param {string|null|undefined} kind
 */
export function descriptionOf(experiment, kind) {
  return experiment.marks.find((mark) => mark.kind === kind);
}
