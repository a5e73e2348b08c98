/** The pictures of drawings, decoded outside the page's thread and freed as soon as no drawing needs them any more. */

/** @import { Drawing } from "./decode.js" */

/** @typedef {{decoded: Promise<ImageBitmap|null>, bitmap: ImageBitmap|null, needed: number}} Kept */

export class Pictures {
  /** @type {Map<number, Kept>} */
  #newest = new Map();
  /** @type {Set<Kept>} */
  #all = new Set();

  /**
   * Take the files of a drawing, and keep what it needs.
   *
   * @param {Drawing} drawing
   * @param {number} number Drawings are counted as they come.
   * @returns {Promise<Map<number, ImageBitmap>>} Its pictures by key; one that cannot be decoded is missing.
   */
  async of(drawing, number) {
    for (const [key, file] of drawing.files) this.#newest.set(key, this.#decoding(file));
    /** @type {Map<number, Kept>} */
    const needed = new Map();
    for (const item of drawing.primitives) {
      const kept = item.kind === "picture" ? this.#newest.get(item.image_rgb.key) : undefined;
      if (item.kind === "picture" && kept !== undefined) needed.set(item.image_rgb.key, kept);
    }
    // A key that the newest drawing does not name is sent again when it is needed again.
    this.#newest = needed;
    for (const kept of needed.values()) kept.needed = number;
    await Promise.all([...needed.values()].map(({ decoded }) => decoded));
    const bitmaps = [...needed].flatMap(([key, { bitmap }]) => (bitmap === null ? [] : [/** @type {const} */ ([key, bitmap])]));
    return new Map(bitmaps);
  }

  /**
   * Free what only drawings before this one needed.
   *
   * @param {number} number
   */
  free(number) {
    for (const kept of this.#all) {
      if (kept.needed >= number) continue;
      this.#all.delete(kept);
      kept.decoded.then((bitmap) => bitmap?.close());
    }
  }

  /**
   * @param {Uint8Array} file
   * @returns {Kept}
   */
  #decoding(file) {
    /** @type {Kept} */
    const kept = { decoded: Promise.resolve(null), bitmap: null, needed: 0 };
    kept.decoded = createImageBitmap(new Blob([/** @type {BlobPart} */ (file)], { type: "image/jpeg" })).then(
      (bitmap) => (kept.bitmap = bitmap),
      () => null,
    );
    this.#all.add(kept);
    return kept;
  }
}
