/** The arguments of `build` in dom.js. */

/** The value of an attribute: true and false switch it, null and undefined leave it out, others are its text. */
export type Attribute = string | number | boolean | null | undefined;

type HtmlName =
  | "accept" | "alt" | "as" | "autocomplete" | "autofocus" | "checked" | "class" | "disabled" | "download" | "fetchpriority" | "for"
  | "allow" | "height" | "hidden" | "href" | "id" | "inputmode" | "label" | "loading" | "max" | "maxlength" | "method" | "min"
  | "name" | "novalidate" | "open" | "placeholder" | "popover" | "popovertarget" | "readonly" | "rel" | "required"
  | "role" | "rows" | "scope" | "selected"
  | "src" | "step" | "style" | "tabindex" | "target" | "title" | "type" | "value" | "width";

/** Attributes by name. Add missing ones to the lists above. */
export type Attributes = { [Name in HtmlName | `aria-${string}` | `data-${string}`]?: Attribute };

/** Listeners by the type of the event. */
export type Listeners = { [Type in keyof HTMLElementEventMap]?: (event: HTMLElementEventMap[Type]) => unknown };

/** Attributes, listeners and data attributes. */
export type Properties = Attributes & { on?: Listeners; data?: Record<string, string | number | boolean> };

/** The content of an element: strings and numbers become text; false, null and undefined are skipped. */
export type Child = Node | string | number | false | null | undefined | readonly Child[];
