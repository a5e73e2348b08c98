/** Tables of truth as text: the values of each frame that has any, by its number in the recording. */

/** @typedef {Map<number, number[]>} Rows In the order of the columns after the frame's. */

/**
 * Read a table that the server has written.
 *
 * @param {string} text
 * @returns {Rows}
 */
export function readTable(text) {
  const lines = text.split("\n").slice(1).filter((line) => line !== "");
  return new Map(lines.map((line) => {
    const [frame, ...values] = line.split(",").map(Number);
    return [frame, values];
  }));
}

/**
 * A table that the server reads.
 *
 * @param {readonly string[]} columns
 * @param {Rows} rows
 */
export function tableText(columns, rows) {
  const lines = [...rows].sort(([one], [other]) => one - other).map(([frame, values]) => [frame, ...values].join(","));
  return `${[columns.join(","), ...lines].join("\n")}\n`;
}
