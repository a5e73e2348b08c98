/**
 * Marking a target's features in a picture: by mouse or touch (drag a point) and by keyboard (Tab goes through the
 * points, arrows move one by 1 px, shift+arrows by 10). Points are in pixels of the picture and never leave it.
 */

import { fill, h, setText, svg } from "../../shared/dom.js";
import { Loupe } from "./loupe.js";
import { Picture, arrow } from "./picture.js";

const REACH_PX = 28;
const FAR = 10;
/** So much room the longest name takes. */
const NAME_PX = 180;

export class PointsEditor {
  #titles;
  #links;
  #changed;
  #points = new Map();
  #placed = new Set();
  #drag = null;
  #lines;
  #handles;
  #loupe = new Loupe();
  #picture;
  #words = h("output", { class: "picture-words", "aria-live": "polite" });

  /**
   * @param {HTMLElement} root
   * @param {string} target What is marked.
   * @param {import("../../shared/messages.js").Editor} kind The points of such a mark, and the lines between them.
   * @param {() => void} changed Called when a person has moved a point.
   */
  constructor(root, target, { handles, links }, changed) {
    const nameOf = (handle) => handle.replace(/^points\./, "");
    this.#titles = Object.fromEntries(handles.map(({ name, title }) => [nameOf(name), title]));
    [this.#links, this.#changed] = [links.map((pair) => pair.map(nameOf)), changed];
    this.#lines = links.map(() => ["points-halo", "points-line"].map((kind) => svg("line", { class: kind })));
    this.#handles = new Map(Object.entries(this.#titles).map(([name, title]) => [name, this.#handle(name, title)]));
    const properties = { class: "points", role: "group", "aria-label": `Points of the ${target}` };
    this.#picture = new Picture(properties, this.#lines.flat(), () => this.#draw());
    const surface = this.#picture.element;
    surface.append(...this.#handles.values(), this.#loupe.element);
    surface.addEventListener("pointerdown", (event) => this.#press(event));
    surface.addEventListener("pointermove", (event) => this.#move(event));
    surface.addEventListener("pointerleave", () => this.#name(null));
    for (const end of ["pointerup", "pointercancel"]) surface.addEventListener(end, () => this.#release());
    fill(root, surface, this.#words);
  }

  /** {name: [x, y]} in px, or null while there are none. */
  get points() {
    return this.#points.size > 0 ? Object.fromEntries(this.#points) : null;
  }

  /**
   * @param {{[name: string]: [number, number]}} points
   * @param {string[]} placed Those that were placed rather than found: they are hollow until somebody moves them.
   */
  set(points, placed) {
    this.#points = new Map(Object.entries(points));
    this.#placed = new Set(placed);
    this.#draw();
  }

  /** Show a picture of this size. */
  show(address, width, height) {
    this.#picture.show(address, width, height);
    this.#draw();
  }

  focus() {
    this.#handles.values().next().value?.focus({ preventScroll: true });
  }

  #handle(name, title) {
    const handle = h("button", { type: "button", class: "point", data: { feature: name } }, h("span", { class: "point-name" }, title));
    handle.addEventListener("focus", () => this.#say(name));
    handle.addEventListener("blur", () => (this.#loupe.hide(), this.#say(null)));
    handle.addEventListener("keydown", (event) => {
      const way = arrow(event);
      if (way === null) return;
      event.preventDefault();
      event.stopPropagation();
      const [x, y] = this.#points.get(name);
      const far = event.shiftKey ? FAR : 1;
      this.#put(name, x + far * way[0], y + far * way[1]);
    });
    return handle;
  }

  /** The point nearest to a place, if it is within reach. */
  #near([x, y]) {
    let [nearest, least] = [null, REACH_PX * this.#picture.scale];
    for (const [name, [u, v]] of this.#points) {
      const away = Math.hypot(u + 0.5 - x, v + 0.5 - y);
      if (away < least) [nearest, least] = [name, away];
    }
    return nearest;
  }

  #press(event) {
    if (event.button !== 0) return;
    const at = this.#picture.at(event);
    const name = this.#near(at);
    event.preventDefault();
    if (name === null) return;
    const [x, y] = this.#points.get(name);
    this.#drag = { name, grip: [at[0] - x, at[1] - y] };
    this.#picture.element.setPointerCapture(event.pointerId);
    this.#handles.get(name).focus({ preventScroll: true });
    this.#magnify(name);
  }

  #move(event) {
    const at = this.#picture.at(event);
    if (this.#drag === null) {
      this.#name(this.#near(at));
      return;
    }
    const { name, grip } = this.#drag;
    this.#put(name, at[0] - grip[0], at[1] - grip[1]);
  }

  #release() {
    this.#drag = null;
    this.#loupe.hide();
  }

  #put(name, x, y) {
    const within = (value, most) => Math.min(Math.max(0, Math.round(value * 10) / 10), most);
    this.#points.set(name, [within(x, this.#picture.width - 1), within(y, this.#picture.height - 1)]);
    this.#placed.delete(name);
    this.#draw();
    this.#magnify(name);
    this.#say(name);
    this.#changed();
  }

  #magnify(name) {
    this.#loupe.show(this.#picture, this.#points.get(name));
  }

  /** Show the name of the point under the pointer. */
  #name(name) {
    for (const [each, handle] of this.#handles) handle.classList.toggle("near", each === name);
    this.#picture.element.classList.toggle("grip", name !== null);
  }

  #say(name) {
    const place = name === null ? undefined : this.#points.get(name);
    setText(this.#words, place === undefined ? "" : `${this.#titles[name]} at ${place.map((value) => value.toFixed(1)).join(", ")} px`);
  }

  #draw() {
    const { width, height } = this.#picture;
    for (const [name, handle] of this.#handles) {
      const place = this.#points.get(name);
      handle.hidden = place === undefined;
      if (place === undefined) continue;
      handle.style.left = `${(100 * (place[0] + 0.5)) / width}%`;
      handle.style.top = `${(100 * (place[1] + 0.5)) / height}%`;
      handle.classList.toggle("placed", this.#placed.has(name));
      handle.classList.toggle("at-right", (width - place[0]) / this.#picture.scale < NAME_PX);
      handle.setAttribute("aria-label", `${this.#titles[name]}, ${Math.round(place[0])} across, ${Math.round(place[1])} down`);
    }
    this.#links.forEach(([from, to], index) => {
      const ends = [this.#points.get(from), this.#points.get(to)];
      for (const line of this.#lines[index]) {
        line.style.display = ends.every(Boolean) ? "" : "none";
        if (!ends.every(Boolean)) continue;
        ends.forEach(([x, y], end) => {
          line.setAttribute(`x${end + 1}`, x + 0.5);
          line.setAttribute(`y${end + 1}`, y + 0.5);
        });
      }
    });
  }
}
