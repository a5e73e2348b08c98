/**
 * Building page elements. Text goes in as text nodes only, so nothing a person typed or named can become markup.
 */

import { render } from "../vendor/preact.js";

/** @import { Child, Properties } from "./elements.js" */
/** @import { VNode } from "../vendor/preact.js" */

const SVG = "http://www.w3.org/2000/svg";

/**
 * Make an element.
 *
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Properties} [properties]
 * @param {...Child} children
 */
export function h(tag, properties = {}, ...children) {
  return dress(document.createElement(tag), properties, children);
}

/**
 * The same for SVG.
 *
 * @template {keyof SVGElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Properties} [properties]
 * @param {...Child} children
 */
export function svg(tag, properties = {}, ...children) {
  return dress(document.createElementNS(SVG, tag), properties, children);
}

/**
 * A place of the page by its name.
 *
 * @param {string} name
 * @returns {HTMLElement}
 */
export function part(name) {
  const found = document.querySelector(`[data-part="${name}"]`);
  if (!(found instanceof HTMLElement)) throw new Error(`The page has no part ${name}`);
  return found;
}

/**
 * The last part of the page's address, or the one so many before it.
 *
 * @param {number} [before]
 */
export function lastOfAddress(before = 0) {
  return decodeURIComponent(location.pathname.split("/").filter(Boolean).at(-1 - before) ?? "");
}

/**
 * Replace all that an element holds.
 *
 * @template {Element} E
 * @param {E} element
 * @param {...Child} children
 */
export function fill(element, ...children) {
  element.replaceChildren(...flat(children));
  return element;
}

/**
 * Set an element's text, touching the page only when it differs.
 *
 * @param {Element} element
 * @param {string} text
 */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/**
 * The element that a component makes, for a page that is not made of components.
 *
 * @template {Element} E
 * @param {VNode} component
 * @returns {E}
 */
export function elementOf(component) {
  const place = document.createElement("div");
  render(component, place);
  return /** @type {E} */ (place.firstElementChild);
}

/**
 * @template {HTMLElement|SVGElement} E
 * @param {E} element
 * @param {Properties} properties
 * @param {readonly Child[]} children
 */
function dress(element, { on = {}, data = {}, ...attributes }, children) {
  // Each listener takes the events of its own type, which are not told apart here.
  for (const [type, listener] of Object.entries(on)) element.addEventListener(type, /** @type {EventListener} */ (listener));
  Object.assign(element.dataset, data);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, String(value));
  }
  element.append(...flat(children));
  return element;
}

/**
 * @param {readonly Child[]} children
 * @returns {(Node|string)[]} Strings become text.
 */
function flat(children) {
  return children.flatMap((child) => {
    if (child === null || child === undefined || child === false) return [];
    if (child instanceof Node) return [child];
    return typeof child === "object" ? flat(child) : [String(child)];
  });
}
