/** A picture of a recording for marking: as large as there is room, with an overlay whose unit is the picture's pixel, and the handling of
 the pointer. Pixels count from the middle of the first one. */

import { computed, html, signal, useEffect, useSignal } from "../../vendor/preact.js";

/** @import { Child } from "../../vendor/preact.js" */

/** @typedef {[x: number, y: number]} Place In px of the picture. */

const LOUPE_PX = 96;
const ABOVE_PX = 24;
/** Least magnification of the loupe, pixels of the page per pixel of the picture. */
const LARGE = 4;

export class Picture {
  address = signal("");
  /** Width and height. */
  size = signal(/** @type {[number, number]} */ ([1, 1]));
  /** Width in the page, px. */
  room = signal(0);
  /** Pixels of the picture per pixel of the page. */
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

  /** The place of a pointer, from the upper left corner of the picture, limited to it.
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

/** The pointer handlers of a mark's editor, with places on the picture.
 *
 * @typedef {object} Pointed
 * @property {Picture} picture
 * @property {(place: Place, event: PointerEvent) => boolean} press Returns whether a drag begins.
 * @property {(place: Place) => void} move
 * @property {() => void} release
 */

/**
 * @typedef {object} StageProps
 * @property {string} kind Kind of the mark.
 * @property {Pointed} editor
 * @property {Record<string, unknown>} surface Attributes of the picture's element.
 * @property {Child} drawn Content of the overlay.
 * @property {Child} [above] Content above the overlay.
 * @property {Child} words Text below the picture.
 * @property {Child} [controls] Controls below the text.
 */

/** @param {StageProps} props */
export function Stage({ kind, editor, surface, drawn, above, words, controls }) {
  const { picture } = editor;
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
  const press = (/** @type {PointerEvent} */ event) => {
    if (event.button !== 0) return;
    event.preventDefault();
    if (editor.press(picture.at(event), event)) picture.current?.setPointerCapture(event.pointerId);
  };
  const pointer = {
    onPointerDown: press,
    onPointerMove: (/** @type {PointerEvent} */ event) => editor.move(picture.at(event)),
    onPointerUp: () => editor.release(),
    onPointerCancel: () => editor.release(),
  };
  const look = `mark-surface picture ${surface.class} ${isKnown ? "" : "loading"}`;
  return html`<div class="target-stage" data-mark=${kind}>
    <div ref=${picture} ...${surface} ...${pointer} class=${look} style=${{ "--ratio": width / height }}>
      <img alt="" draggable=${false} src=${address || null} width=${width} height=${height} onLoad=${come(false)} onError=${come(true)} />
      <p class="picture-missing" role="alert" hidden=${!isKnown || !known.value.isMissing}>Couldn't load the picture of this frame.</p>
      <svg class="picture-overlay" preserveAspectRatio="none" aria-hidden="true" viewBox=${`0 0 ${width} ${height}`}>${drawn}</svg>
      ${above}
    </div>
    <output class="picture-words" aria-live="polite">${words}</output>
    ${controls}
  </div>`;
}

/** @param {{picture: Picture, place: Place}} props A loupe of the place around a point, next to the finger that covers it. */
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
