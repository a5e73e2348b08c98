/** Inspecting the shown frame: the estimate, a place, or a particle, which is followed from frame to frame. The server computes the
 findings; the picture shows them in either view. */

import { messageOf, sendCommand } from "../shared/api.js";
import { IconButton, Segments, step } from "../shared/dom.js";
import { plainAxis } from "../shared/figure/axes.js";
import { StillFigure } from "../shared/figure/figure.js";
import { lineOver, linksOver } from "../shared/figure/kinds.js";
import { count, number, quantity } from "../shared/format.js";
import { gradient, viridis } from "../shared/theme.js";
import { follow, NewestRequest, throttle } from "../shared/timing.js";
import { computed, h, html, signal, useEffect, useRef } from "../vendor/preact.js";

/** @import { Amount, Contributions, Course, GenealogyPublic, Histograms, Inspect, InspectionPublic, ParticleFinding } from "../shared/messages.js" */
/** @import { PatchesPublic, Residual } from "../shared/messages.js" */
/** @import { Component } from "../vendor/preact.js" */
/** @import { Mounted } from "./mount.js" */

// Figures of an inspection: numbers with a limit over the last frames, and the ancestors of the present particles.

const SPACE = 1.1;
/** Most frames that are all numbered. */
const FEW = 4;
/** Width of a line, thin enough that close lines stay distinct. */
const OPACITY = 0.6;

/** @param {Course} course */
function coursePanel({ title, limit, first, values }) {
  const x = values.map((_, place) => first + place);
  const y = values.map((value) => value ?? NaN);
  const last = first + values.length - 1;
  return {
    x: plainAxis({ low: first, high: last }),
    y: plainAxis({ low: 0, high: SPACE * Math.max(limit, ...y.filter(Number.isFinite)) }),
    traces: [
      lineOver({ name: `${title} limit`, ink: "muted", width: 1.8, dashed: true, x: [first, last], y: [limit, limit] }),
      lineOver({ name: title, ink: "estimate", width: 1.8, x, y, said: title }),
    ],
  };
}

/**
 * @param {GenealogyPublic} genealogy
 * @param {number} frame
 */
function genealogyPanel({ first, lines }, frame) {
  const all = lines.flatMap((line) => line.slice(1).map((height, place) => {
    const [x0, y0] = [first + place, line[place] ?? NaN];
    return { x0, y0, x1: x0 + 1, y1: height ?? NaN, opacity: OPACITY };
  }));
  // Lines that have met are drawn once.
  const links = [...new Map(all.map((link) => [`${link.x0} ${link.y0} ${link.y1}`, link])).values()];
  // Each frame has a tick, since there is nothing between frames.
  const ticks = Array.from({ length: frame - first + 1 }, (_, place) => ({ at: first + place, text: String(first + place) }));
  return {
    x: plainAxis({ low: first, high: frame, ...(frame - first <= FEW && { ticks }) }),
    y: plainAxis({ low: 0, high: 1, ticks: [] }),
    traces: [linksOver({ name: "ancestors", ink: "estimate", links })],
  };
}

/** @param {GenealogyPublic} genealogy */
function genealogyWords({ first, counts, coalesced, lines }) {
  const of = counts[counts.length - 1];
  if (coalesced !== null) return `All ${of} particles descend from one of frame ${coalesced}.`;
  if (lines.some(([oldest]) => oldest === null)) return `The ${of} particles have ${count(counts[0], "ancestor")} in frame ${first}; other lines begin later.`;
  return `The ${of} particles descend from ${counts[0]} of frame ${first}.`;
}

// The findings in a frame: the likelihood with its parts, a particle with its relatives, the parts of a step.

/** Number of standard deviations beyond which the mark is at the edge. */
const MOST_SD = 4;
const HIGH = 40;

const LIMITED = "The number over the last frames, and its limit";
const DESCENT = "The ancestors of the particles of this frame, as lines that lead back and meet";

/** The range of the colours over the picture, the findings, numbers such as the normalised innovation squared of a Kalman filter, and the
 * ancestors as lines that meet going back: lines that meet early show impoverishment.
 *
 * @param {{found: InspectionPublic}} props
 */
function Findings({ found }) {
  const { courses, frame, genealogy, scale } = found;
  return html`
    ${scale && html`<div class="colour-bar" title="Log likelihood of the colours over the picture">
      <span>${number(scale[0], 2)}</span><i style=${`background: ${gradient(viridis)}`}></i><span>${number(scale[1], 2)}</span>
    </div>`}
    <div class="inspection-card" role="status" aria-live="off">${numbers(found)}</div>
    ${courses.length > 0 && html`<section class="inspection-course">
      <h3>${courses.map(({ title }) => title).join(", ")}</h3>
      ${h(StillFigure, { kind: "lineage", words: LIMITED, panels: courses.map(coursePanel) })}
    </section>`}
    ${genealogy !== null && genealogy.counts.length > 1 && html`<section class="inspection-genealogy">
      <h3>Genealogy</h3>
      ${h(StillFigure, { kind: "lineage", words: DESCENT, panels: [genealogyPanel(genealogy, frame)] })}
      <p class="small">${genealogyWords(genealogy)}</p>
    </section>`}
  `;
}

/** @param {InspectionPublic} found */
function numbers({ frame, impossible, log_likelihood: value, particle, parts, place, state, subject, title, update }) {
  if (subject === "gone") return html`<p class="note">The particle has no descendants in this frame, or is too many frames away.</p>`;
  if (title === "" && particle === null && update.length === 0) return html`<p class="note">This tracker has no likelihood to show.</p>`;
  const at = place === null ? "" : ` at ${place.map((each) => number(each)).join(", ")} px`;
  const headline = html`<p class="headline">
    <span>log likelihood </span><strong>${impossible ? "impossible" : number(value, 3)}</strong><span class="of">${`${title}, ${subject}${at}`}</span>
  </p>`;
  const rows = state.map((each) => entry(each.name, `${quantity(each.value, each.unit)} ${each.unit}`.trim()));
  return html`
    ${title !== "" && headline} ${parts.map(shownPart)} ${particle && h(Particle, { particle, frame })} ${update.map(shownPart)}
    ${state.length > 0 && html`<details><summary>All of the state</summary><dl>${rows}</dl></details>`}
  `;
}

/**
 * @param {string} title
 * @param {string} text
 */
function entry(title, text) {
  return html`<dt>${title}</dt><dd>${text}</dd>`;
}

/** @param {{particle: ParticleFinding, frame: number}} props */
function Particle({ particle, frame }) {
  const { filter, number: place, count: total, weight, rank, sampler, ancestors, begins, descendants } = particle;
  return html`<dl class="particle-list">
    ${entry("particle", `${place} of ${total}${filter && `, ${filter}`}`)}
    ${entry("weight", `${number(100 * weight, 3)} %, ${number(weight * total, 1)} times the mean`)}
    ${entry("rank", `${rank} of ${total}`)}
    ${sampler !== "" && entry("drawn by", sampler)}
    ${entry("ancestors", lineage(ancestors.length, begins, frame))}
    ${entry("descendants", children(descendants))}
  </dl>`;
}

/**
 * @param {number} known Number of known frames back.
 * @param {number|null} begins
 * @param {number} frame
 */
function lineage(known, begins, frame) {
  if (begins === frame) return "none: it was drawn without a parent";
  if (known === 0) return "not known";
  return `followed back to frame ${frame - known}${begins === null ? "" : ", where its line begins"}`;
}

/** @param {readonly number[]} counts */
function children(counts) {
  if (counts.length === 0) return "not computed yet";
  const far = counts.length > 1 ? `, ${counts[counts.length - 1]} after ${counts.length} frames` : "";
  return `${counts[0]} in the next frame${far}`;
}

/** Components for each kind of part of a likelihood or a step, in a form that shows the comparison. */
const PARTS = { amount: AmountPart, residual: ResidualPart, histograms: HistogramsPart, patches: PatchesPart, contributions: ContributionsPart };

/** @param {Part} part */
function shownPart(part) {
  return h(/** @type {Component<Part>} */ (PARTS[part.kind]), part);
}

/** @param {Amount} part */
function AmountPart({ title, value, unit, limit }) {
  const isBeyond = limit !== null && value !== null && value > limit;
  const words = limit === null ? "" : ` (${isBeyond ? "above" : "within"} ${quantity(limit, unit)})`;
  return html`<p class="part-line" data-beyond=${String(isBeyond)}>
    <span>${title}</span><strong>${`${quantity(value, unit)} ${unit}`.trim()}${words}</strong>
  </p>`;
}

/** @param {Residual} part */
function ResidualPart({ title, found, expected, sd, unit }) {
  const off = found === null || expected === null || !sd ? null : (found - expected) / sd;
  const place = off === null ? 50 : 50 + (50 * Math.max(-MOST_SD, Math.min(MOST_SD, off))) / MOST_SD;
  return html`<div class="part">
    <p class="part-line"><span>${title}</span><strong>${off === null ? "nothing found" : `${number(off, 1)} sd`}</strong></p>
    <div class="deviation" aria-hidden="true">${off !== null && html`<i style=${`left: ${place}%`}></i>`}</div>
    <p class="small">${`${quantity(found, unit)} found, ${quantity(expected, unit)} expected ${unit}`.trim()}</p>
  </div>`;
}

/** @param {Histograms} part */
function HistogramsPart({ title, expected, found, colours }) {
  const most = Math.max(...expected, ...found, 1e-9);
  const drawn = expected.map((share, bin) => {
    const [up, down] = [share, found[bin]].map((each) => (HIGH * each) / most);
    return up + down > 0 && html`<path d=${`M${bin} ${HIGH}h1v${-up}h-1zM${bin} ${HIGH + 1}h1v${down}h-1z`} fill=${colours[bin] ?? "currentColor"} />`;
  });
  return html`<figure class="part histograms">
    <figcaption>${title}</figcaption>
    <svg viewBox=${`0 0 ${expected.length} ${2 * HIGH + 1}`} preserveAspectRatio="none" role="img" aria-label=${title}>${drawn}</svg>
    <p class="small">expected above, found below</p>
  </figure>`;
}

/** @param {PatchesPublic} part */
function PatchesPart({ title, expected, found }) {
  const patch = (/** @type {string|null} */ source, /** @type {string} */ words) =>
    source === null ? html`<span class="outside">outside</span>` : html`<img src=${source} alt=${words} />`;
  return html`<figure class="part patches"><figcaption>${title}</figcaption><div>${patch(expected, "expected")} ${patch(found, "found")}</div></figure>`;
}

/** @param {Contributions} part */
function ContributionsPart({ title, columns, names, rows }) {
  return html`<div class="part contributions">
    <p>${title}</p>
    <table>
      <thead><tr><th></th>${columns.map((column) => html`<th scope="col">${column}</th>`)}</tr></thead>
      <tbody>${names.map((name, place) => html`<tr><th scope="row">${name}</th>${rows[place].map((value) => html`<td>${number(value, 2)}</td>`)}</tr>`)}</tbody>
    </table>
  </div>`;
}

/** @typedef {InspectionPublic["parts"][number]} Part */
/** @typedef {"estimate"|"place"|"particle"} Kind Kind of the inspected subject. */
/** @typedef {{place?: [number, number], picks?: boolean, particle?: number, frame?: number}} Subject In the form of the server. */
/** @typedef {[number, number]} Place In the picture, px; its origin is the centre of the first pixel. */

const ASK_MS = 80;
const KINDS = /** @type {const} */ ([
  { value: "estimate", words: "Estimate", hint: "Inspect the tracker's estimate" },
  { value: "place", words: "Place", hint: "Point at the picture; a click holds the place" },
  { value: "particle", words: "Particle", hint: "Click in the picture: the nearest particle is followed" },
]);
const PAD = "Arrows move the place by a pixel, with Shift by ten; Enter takes the nearest particle";

export class Inspector {
  kind = signal(/** @type {Kind} */ ("estimate"));
  /** Whether the likelihood is drawn over the picture. */
  hasVeil = signal(false);
  /** The findings, or why there are none. */
  found = signal(/** @type {InspectionPublic|string|null} */ (null));
  #view;
  #request;
  #ask;
  /** @type {Subject} */
  #subject = {};
  #isHeld = false;

  /** @param {Mounted} view */
  constructor(view) {
    this.#view = view;
    const { card, scene, signal: end, store } = view;
    this.isOpen = computed(() => card.value === "inspect");
    this.#request = new NewestRequest(
      async (/** @type {Inspect} */ wish) => /** @type {InspectionPublic} */ (await sendCommand(store.known.id, wish)),
      { answer: (found) => this.#take(found), refused: (error) => (this.found.value = messageOf(error)) },
      end,
    );
    /** @returns {Inspect} */
    const wish = () => ({ kind: "inspect", likelihood: this.hasVeil.peek(), genealogy: true, pulls: true, ...this.#subject });
    this.#ask = throttle(() => view.store.isSteerable && this.#request.ask(this.isOpen.peek() ? wish() : { kind: "inspect" }), ASK_MS, end);
    // The fields on which the findings of a frame depend.
    const parts = /** @type {const} */ (["branch", "parameters", "position", "tracker"]);
    follow(() => this.isOpen.value && [this.hasVeil.value, ...parts.map((name) => store.session?.[name])], this.#ask, end);
    const at = (/** @type {(place: Place) => void} */ tell) => (/** @type {Event} */ event) => {
      const place = this.isOpen.peek() && event instanceof MouseEvent ? placeOf(event) : null;
      if (place !== null) tell(place);
    };
    scene?.root.addEventListener("pointermove", at((place) => this.#hover(place)), { signal: end });
    scene?.root.addEventListener("click", at((place) => this.#press(place)), { signal: end });
    globalThis.addEventListener("message", ({ origin, source, data }) => {
      if (!this.isOpen.peek() || origin !== location.origin || !scene?.window || source !== scene.window || data?.source !== "pftrack-viser") return;
      if (data.pointed === "hover") this.#hover(data.place);
      // A particle may be raised above the place at the pointer.
      else if (data.pointed === "press") this.#press(data.place, data.particle ?? undefined);
    }, { signal: end });
  }

  /** Begin or stop inspecting; when stopped, nothing is computed or drawn for it. */
  toggle() {
    const { store, card } = this.#view;
    if (this.isOpen.peek()) card.value = null;
    else if (store.isSteerable) {
      card.value = "inspect";
      this.choose(this.kind.peek());
    }
  }

  /** Inspect another subject.
   *
   * @param {Kind} kind
   * @param {Place|null} at
   */
  choose(kind, at = this.#at) {
    this.kind.value = kind;
    this.#isHeld = false;
    const subjects = { estimate: {}, place: at ? { place: at } : this.#subject, particle: { place: at ?? [0, 0], picks: true } };
    this.#subject = subjects[kind];
    this.#ask();
  }

  /** Move the place by keys, or choose the nearest particle.
   *
   * @param {KeyboardEvent} event
   */
  steer(event) {
    const [way, at] = [step(event), this.#at];
    if (event.key === "Enter") {
      event.preventDefault();
      if (at) this.choose("particle");
    } else if (way && at) {
      const [x, y] = this.#subject.place ?? at;
      this.choose("place", [x + way[0], y + way[1]]);
      this.#isHeld = true;
    }
  }

  /** The last inspected place. */
  get #at() {
    const found = this.found.peek();
    return typeof found === "object" ? found?.place ?? null : null;
  }

  /** @param {Place} at */
  #hover(at) {
    if (this.kind.peek() === "place" && !this.#isHeld) this.choose("place", at);
  }

  /**
   * @param {Place} at
   * @param {Place} particle Position of the clicked particle.
   */
  #press(at, particle = at) {
    if (this.kind.peek() === "particle") {
      this.choose("particle", particle);
      return;
    }
    const isHeld = this.kind.peek() === "place" && this.#isHeld;
    this.choose("place", at);
    this.#isHeld = !isHeld;
  }

  /** @param {InspectionPublic} found */
  #take(found) {
    if (!this.isOpen.peek()) return;
    this.found.value = found;
    // From now on this particle is followed.
    const isPicked = this.#subject.picks === true || this.#subject.particle !== undefined;
    if (isPicked && found.particle !== null) this.#subject = { particle: found.particle.particle, frame: found.frame };
  }
}

/** @param {{inspector: Inspector}} props */
export function Inspection({ inspector }) {
  const { found: told, hasVeil, isOpen, kind: chosen } = inspector;
  const root = useRef(/** @type {HTMLElement|null} */ (null));
  useEffect(() => root.current?.scrollIntoView({ block: "start" }), [isOpen.value]);
  if (!isOpen.value) return null;
  const found = told.value;
  const isBlind = typeof found === "object" && found?.has_map === false;
  const close = (/** @type {KeyboardEvent} */ event) => event.key === "Escape" && inspector.toggle();
  const veil = (/** @type {{currentTarget: HTMLInputElement}} */ { currentTarget: { checked } }) => (hasVeil.value = checked);
  const options = KINDS.map((each) => ({ ...each, isOff: each.value === "place" && isBlind }));
  const choose = (/** @type {string} */ wanted) => inspector.choose(/** @type {Kind} */ (wanted));
  return html`<div ref=${root} onKeyDown=${close}>
    <header>
      <h2>Inspect the frame</h2>
      ${h(IconButton, { name: "close", title: "Stop looking (I)", run: () => inspector.toggle() })}
    </header>
    <label class="inspection-veil">
      <input type="checkbox" checked=${hasVeil.value} disabled=${isBlind} onChange=${veil} />
      <span>Likelihood over the picture</span>
    </label>
    ${h(Segments, { label: "What to inspect", options, value: chosen.value, choose })}
    <button type="button" title=${PAD} data-role="pad" onKeyDown=${(/** @type {KeyboardEvent} */ event) => inspector.steer(event)}>Move by keys</button>
    <p class="hint">${chosen.value !== "estimate" && KINDS.find(({ value }) => value === chosen.value)?.hint}</p>
    ${typeof found === "string" ? html`<div class="inspection-card" role="status"><p class="note">${found}</p></div>` : found && h(Findings, { found })}
  </div>`;
}

/** The position of a pointer in the flat picture.
 *
 * @param {MouseEvent} event
 * @returns {Place|null}
 */
function placeOf({ target, offsetX, offsetY }) {
  if (!(target instanceof HTMLElement) || !target.classList.contains("flat-canvas")) return null;
  const scale = target.offsetWidth / Number(target.dataset.width);
  return Number.isFinite(scale) && scale > 0 ? [offsetX / scale - 0.5, offsetY / scale - 0.5] : null;
}
