/** What `build` of dom.js is given. */

/** What becomes of an attribute: true and false switch it, null and undefined leave it out, the rest is its text. */
export type Attribute = string | number | boolean | null | undefined;

type HtmlName =
  | "accept" | "alt" | "as" | "autocomplete" | "autofocus" | "checked" | "class" | "disabled" | "download" | "fetchpriority" | "for"
  | "allow" | "height" | "hidden" | "href" | "id" | "inputmode" | "label" | "loading" | "max" | "maxlength" | "method" | "min"
  | "name" | "novalidate" | "open" | "placeholder" | "popover" | "popovertarget" | "readonly" | "rel" | "required"
  | "role" | "rows" | "scope" | "selected"
  | "src" | "step" | "style" | "tabindex" | "target" | "title" | "type" | "value" | "width";

/** Attributes by name. One that is not among these yet is added to the lists above. */
export type Attributes = { [Name in HtmlName | `aria-${string}` | `data-${string}`]?: Attribute };

/** What to call, by the type of the event. */
export type Listeners = { [Type in keyof HTMLElementEventMap]?: (event: HTMLElementEventMap[Type]) => unknown };

/** Attributes, the listeners, and what becomes data attributes. */
export type Properties = Attributes & { on?: Listeners; data?: Record<string, string | number | boolean> };

/** What an element holds: strings and numbers become text, nothing becomes of false, null and undefined. */
export type Child = Node | string | number | false | null | undefined | readonly Child[];
