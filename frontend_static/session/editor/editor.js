/** A filter of one's own beside the session that runs it: the text of its file, saved with Ctrl-S, mistakes at their line. */

import { api, messageOf } from "../../shared/api.js";
import { fill, h, setText } from "../../shared/dom.js";
import { iconButton } from "../../shared/icons.js";
import { CodeField } from "./code_field.js";

/** @import { FilterPublic } from "../../shared/messages.js" */
/** @import { Store } from "../store.js" */

/** A file that another editor has saved is taken over when the session has taken it over. */
export class Editor {
  #element;
  #store;
  #file;
  /** @type {CodeField} */
  #field;
  #title = h("h2", {});
  #state = h("p", { class: "editor-state", role: "status" });
  #said = "";

  /**
   * @param {HTMLElement} element
   * @param {Store} store
   * @param {FilterPublic} file
   * @param {() => void} onClose
   */
  constructor(element, store, file, onClose) {
    this.#element = element;
    this.#store = store;
    this.#file = file;
    const place = h("div", { class: "editor-text" });
    const save = h("button", { type: "button", class: "primary", title: "Save (Ctrl-S)", on: { click: () => this.#save() } }, "Save");
    fill(element, h("div", { class: "editor-bar" }, this.#title, save, iconButton("close", "Close the editor", onClose)), place, this.#state);
    setText(this.#title, file.file);
    this.#field = new CodeField(place, file, { onChange: () => this.#show(), onSave: () => this.#save() });
    store.on(["problem", "recipe", "parameters", "position"], () => this.#show());
    store.on(["recipe"], () => this.#follow());
    this.#show();
    this.#field.focus();
  }

  get name() {
    return this.#file.name;
  }

  /** Come back to it: what happened meanwhile is told. */
  focus() {
    this.#show();
    this.#field.focus();
  }

  get #isChanged() {
    return this.#field.text !== this.#file.text;
  }

  async #save() {
    try {
      this.#file = await api.writeFilter(this.#file.name, this.#field.text, this.#file.digest);
      this.#said = "Saved.";
    } catch (error) {
      this.#said = `Not saved: ${messageOf(error)}`;
    }
    this.#show();
  }

  /** Take over what another editor has saved, unless something here is not saved. */
  async #follow() {
    const versions = this.#store.session?.recipe.filters?.[this.#file.name];
    const newest = Array.isArray(versions) ? versions.at(-1) : undefined;
    if (newest === undefined || newest === this.#file.digest || this.#isChanged) return;
    const found = (await api.filters()).find(({ name }) => name === this.#file.name);
    if (found === undefined || this.#isChanged) return;
    this.#file = found;
    if (this.#field.text !== found.text) this.#field.text = found.text;
    this.#show();
  }

  #show() {
    const { session } = this.#store;
    if (session === null || this.#element.hidden) return;
    const { problem, tracker, parameters, position } = session;
    const own = problem && problem.file === this.#file.file ? problem : null;
    this.#field.mark(own);
    this.#title.classList.toggle("unsaved", this.#isChanged);
    this.#state.classList.toggle("wrong", own !== null || this.#said.startsWith("Not"));
    const version = parameters[`${this.#file.name}_version`];
    const isRunning = tracker === this.#file.name;
    const running = isRunning
      ? `This text is version ${version}: it computes the frames after ${position}. What older versions computed is kept in the other branches.`
      : `Choose ${this.#file.file} as the tracker to run it.`;
    if (this.#isChanged) this.#said = "";
    const words = this.#isChanged ? "Not saved yet: Ctrl-S saves, and the run goes on with it as a branch." : running;
    setText(this.#state, own ? `${own.line === null ? "" : `Line ${own.line}: `}${own.text}` : `${this.#said} ${words}`.trim());
  }
}
