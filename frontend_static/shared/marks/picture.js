/**
 * A picture of a recording that something is marked in: shown as large as there is room, with an overlay whose unit is
 * the picture's pixel. Pixels count from the middle of the first one.
 */

import { computed, html, signal, useEffect, useSignal } from "../../vendor/preact.js";

/** @import { Child } from "../../vendor/preact.js" */

/** @typedef {[x: number, y: number]} Place In px of the picture. */

const LOUPE_PX = 96;
const ABOVE_PX = 24;
/** So many pixels of the page one of the picture becomes in the loupe, at least. */
const LARGE = 4;

export class Picture {
  address = signal("");
  /** Width and height. */
  size = signal(/** @type {[number, number]} */ ([1, 1]));
  /** Width in the page, px. */
  room = signal(0);
  /** How many pixels of the picture one of the page is. */
  scale = computed(() => this.size.value[0] / (this.room.value || this.size.value[0]));
  /** @type {HTMLElement|null} What takes the focus and the pointer. */
  current = null;

  /**
   * Show a picture of this size.
   *
   * @param {string} address
   * @param {number} width
   * @param {number} height
   */
  show(address, width, height) {
    this.address.value = address;
    this.size.value = [width, height];
  }

  /**
   * Where a pointer is, from the left upper edge of the picture, and never beyond it.
   *
   * @param {PointerEvent} event
   * @returns {Place}
   */
  at({ clientX, clientY }) {
    const { left, top, width, height } = this.current?.getBoundingClientRect() ?? { left: 0, top: 0, width: 1, height: 1 };
    const [across, down] = this.size.value;
    return [within(((clientX - left) / width) * across, across), within(((clientY - top) / height) * down, down)];
  }
}

/**
 * @param {{picture: Picture, surface: Record<string, unknown>, drawn: Child, above?: Child}} props `surface` is for the
 *     element itself, `drawn` lies in the overlay, `above` over it.
 */
export function PictureView({ picture, surface, drawn, above }) {
  const address = picture.address.value;
  const [width, height] = picture.size.value;
  /** The last address that was loaded, or could not be. */
  const known = useSignal({ address: "", isMissing: false });
  const come = (/** @type {boolean} */ isMissing) => () => (known.value = { address, isMissing });
  const isKnown = known.value.address === address;
  useEffect(() => {
    const { current } = picture;
    if (current) new ResizeObserver(() => (picture.room.value = current.clientWidth)).observe(current);
  }, []);
  return html`<div ref=${picture} ...${surface} class=${`${surface.class} picture ${isKnown ? "" : "loading"}`} style=${{ "--ratio": width / height }}>
    <img alt="" draggable=${false} src=${address || null} width=${width} height=${height} onLoad=${come(false)} onError=${come(true)} />
    <p class="picture-missing" role="alert" hidden=${!isKnown || !known.value.isMissing}>The picture of this frame could not be shown.</p>
    <svg class="picture-overlay" preserveAspectRatio="none" aria-hidden="true" viewBox=${`0 0 ${width} ${height}`}>${drawn}</svg>
    ${above}
  </div>`;
}

/** @param {{picture: Picture, place: Place}} props What is around a point, magnified, beside the finger that hides it. */
export function Loupe({ picture: { address, size, scale }, place }) {
  const zoom = Math.max(LARGE, 2 / scale.value);
  const [width, height] = size.value;
  const [x, y] = place.map((value) => value + 0.5);
  const [left, top] = [x / scale.value, y / scale.value];
  const style = {
    left: within(left - LOUPE_PX / 2, Math.max(0, width / scale.value - LOUPE_PX)),
    top: top > LOUPE_PX + ABOVE_PX ? top - LOUPE_PX - ABOVE_PX : top + ABOVE_PX,
    width: LOUPE_PX,
    height: LOUPE_PX,
    backgroundImage: `url("${address.value}")`,
    backgroundSize: `${width * zoom}px ${height * zoom}px`,
    backgroundPosition: `${LOUPE_PX / 2 - x * zoom}px ${LOUPE_PX / 2 - y * zoom}px`,
  };
  return html`<div class="loupe" aria-hidden="true" style=${style}></div>`;
}

/**
 * @param {number} value
 * @param {number} most
 */
export function within(value, most) {
  return Math.min(Math.max(0, value), most);
}

/** @type {Record<string, [right: number, down: number]>} */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
/** A step with shift, px. */
const FAR = 10;

/**
 * How far a key goes: a pixel, or with shift ten; null for any other key.
 *
 * @param {KeyboardEvent} event
 * @param {Record<string, [right: number, down: number]>} [ways] Where keys go, by their place on the keyboard or their name; else the arrows.
 * @returns {[right: number, down: number]|null}
 */
export function step(event, ways = ARROWS) {
  const way = event.ctrlKey || event.metaKey || event.altKey ? undefined : (ways[event.code] ?? ways[event.key]);
  if (way === undefined) return null;
  event.preventDefault();
  event.stopPropagation();
  const far = event.shiftKey ? FAR : 1;
  return [far * way[0], far * way[1]];
}
