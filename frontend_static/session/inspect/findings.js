/** What is found in a frame: the likelihood with its parts, a particle with its kin, what a step was made of. */

import { gradient, viridis } from "../../shared/colours.js";
import { number, quantity } from "../../shared/format.js";
import { h, html } from "../../vendor/preact.js";
import { Courses, Genealogy } from "./figures.js";

/** @import { Amount, Contributions, Histograms, InspectionPublic, ParticleFinding, PatchesPublic, Residual } from "../../shared/messages.js" */
/** @import { Child } from "../../vendor/preact.js" */

/** Beyond so many deviations the mark stands at the edge. */
const MOST_SD = 4;
const HIGH = 40;

/** @param {{found: InspectionPublic}} props */
export function Findings({ found }) {
  const { courses, frame, genealogy, scale } = found;
  return html`
    ${scale && h(ColourBar, { scale })}
    <div class="inspection-card" role="status" aria-live="off">${numbers(found)}</div>
    ${courses.length > 0 && h(Courses, { courses })}
    ${genealogy !== null && genealogy.counts.length > 1 && h(Genealogy, { genealogy, frame })}
  `;
}

/**
 * The range of the colours that lie over the picture.
 *
 * @param {{scale: [number, number]}} props
 */
function ColourBar({ scale: [low, high] }) {
  return html`<div class="colour-bar" title="Log likelihood of the colours over the picture">
    <span>${number(low, 2)}</span><i style=${`background: ${gradient(viridis)}`}></i><span>${number(high, 2)}</span>
  </div>`;
}

/** @param {InspectionPublic} found */
function numbers({ frame, impossible, log_likelihood: value, particle, parts, place, state, subject, title, update }) {
  if (subject === "gone") return html`<p class="note">The particle has no descendants in this frame, or is too many frames away.</p>`;
  if (title === "" && particle === null && update.length === 0) return html`<p class="note">This tracker has no likelihood to show.</p>`;
  const at = place === null ? "" : ` at ${place.map((each) => number(each)).join(", ")} px`;
  const headline = html`<p class="headline">
    <span>log likelihood </span><strong>${impossible ? "impossible" : number(value, 3)}</strong><span class="of">${`${title}, ${subject}${at}`}</span>
  </p>`;
  const rows = state.map((each) => line(each.name, `${quantity(each.value, each.unit)} ${each.unit}`.trim()));
  return html`
    ${title !== "" && headline} ${parts.map(partElement)} ${particle && particleList(particle, frame)} ${update.map(partElement)}
    ${state.length > 0 && html`<details><summary>All of the state</summary><dl>${rows}</dl></details>`}
  `;
}

/**
 * @param {string} title
 * @param {string} text
 */
function line(title, text) {
  return html`<dt>${title}</dt><dd>${text}</dd>`;
}

/**
 * @param {ParticleFinding} particle
 * @param {number} frame
 */
function particleList({ filter, number: place, count, weight, rank, sampler, ancestors, begins, descendants }, frame) {
  return html`<dl class="particle-list">
    ${line("particle", `${place} of ${count}${filter && `, ${filter}`}`)}
    ${line("weight", `${number(100 * weight, 3)} %, ${number(weight * count, 1)} times the mean`)}
    ${line("rank", `${rank} of ${count}`)}
    ${sampler !== "" && line("drawn by", sampler)}
    ${line("ancestors", lineage(ancestors.length, begins, frame))}
    ${line("descendants", children(descendants))}
  </dl>`;
}

/**
 * @param {number} known How many frames back they are known.
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

/**
 * A number that a likelihood or a step is made of, in a form that shows what was compared.
 *
 * @param {InspectionPublic["parts"][number]} part
 * @returns {Child}
 */
function partElement(part) {
  switch (part.kind) {
    case "amount":
      return amount(part);
    case "residual":
      return residual(part);
    case "histograms":
      return histograms(part);
    case "patches":
      return patches(part);
    default:
      return contributions(part);
  }
}

/** @param {Amount} part */
function amount({ title, value, unit, limit }) {
  const isBeyond = limit !== null && value !== null && value > limit;
  const words = limit === null ? "" : ` (${isBeyond ? "above" : "within"} ${quantity(limit, unit)})`;
  return html`<p class="part-line" data-beyond=${String(isBeyond)}>
    <span>${title}</span><strong>${`${quantity(value, unit)} ${unit}`.trim()}${words}</strong>
  </p>`;
}

/** @param {Residual} part */
function residual({ title, found, expected, sd, unit }) {
  const off = found === null || expected === null || !sd ? null : (found - expected) / sd;
  const place = off === null ? 50 : 50 + (50 * Math.max(-MOST_SD, Math.min(MOST_SD, off))) / MOST_SD;
  return html`<div class="part">
    <p class="part-line"><span>${title}</span><strong>${off === null ? "nothing found" : `${number(off, 1)} sd`}</strong></p>
    <div class="deviation" aria-hidden="true">${off !== null && html`<i style=${`left: ${place}%`}></i>`}</div>
    <p class="small">${`${quantity(found, unit)} found, ${quantity(expected, unit)} expected ${unit}`.trim()}</p>
  </div>`;
}

/** @param {Histograms} part */
function histograms({ title, expected, found, colours }) {
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
function patches({ title, expected, found }) {
  const patch = (/** @type {string|null} */ source, /** @type {string} */ words) =>
    source === null ? html`<span class="outside">outside</span>` : html`<img src=${source} alt=${words} />`;
  return html`<figure class="part patches"><figcaption>${title}</figcaption><div>${patch(expected, "expected")} ${patch(found, "found")}</div></figure>`;
}

/** @param {Contributions} part */
function contributions({ title, columns, names, rows }) {
  return html`<div class="part contributions">
    <p>${title}</p>
    <table>
      <thead><tr><th></th>${columns.map((column) => html`<th scope="col">${column}</th>`)}</tr></thead>
      <tbody>${names.map((name, place) => html`<tr><th scope="row">${name}</th>${rows[place].map((value) => html`<td>${number(value, 2)}</td>`)}</tr>`)}</tbody>
    </table>
  </div>`;
}
