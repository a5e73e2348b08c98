/** What the pages use of CodeMirror, as far as they need to know; its own types are larger than the pages. */

type Extension = unknown;
type Line = { from: number; to: number };
type State = { doc: { length: number; lines: number; line: (number: number) => Line; toString: () => string } };

export class EditorView {
  constructor(config: { parent: HTMLElement; doc: string; extensions: Extension[] });
  readonly state: State;
  dispatch(...specs: unknown[]): void;
  focus(): void;
  static scrollIntoView(place: number, options: { y: "center" }): unknown;
  static theme(rules: Record<string, Record<string, string>>): Extension;
  static readonly contentAttributes: { of: (attributes: Record<string, string>) => Extension };
  static readonly updateListener: { of: (listener: (update: { docChanged: boolean; state: State }) => void) => Extension };
}
export const HighlightStyle: { define: (rules: Record<string, unknown>[]) => unknown };
export const tags: Record<"keyword" | "operatorKeyword" | "string" | "docString" | "comment" | "number" | "variableName" | "className", unknown> & {
  definition: (tag: unknown) => unknown;
  function: (tag: unknown) => unknown;
};
export const basicSetup: Extension;
export const indentUnit: { of: (unit: string) => Extension };
export const indentWithTab: unknown;
export const keymap: { of: (keys: unknown[]) => Extension };
export const pythonLanguage: { data: { of: (data: unknown) => Extension } };
export function autocompletion(): Extension;
export function lintGutter(): Extension;
export function python(): Extension;
export function setDiagnostics(state: State, diagnostics: unknown[]): unknown;
export function syntaxHighlighting(style: unknown): Extension;
