import type { Colour } from "../palette.js";
import type * as declared from "./types.js";

export type { Bars, Curve, Handle, Histogram, Rule, Scatter, Stems, StripChart, Tree } from "./types.js";

/** An axis; its labels may be given. */
export interface Axis extends declared.Axis {
  ticks?: { at: number; text: string }[];
}

/** The shared part of a live plot's traces. `ink` is a token or any colour; `name` identifies the trace; one with a title is in the key. */
interface Live {
  title: string;
  ink: string;
  name: string;
}

/** A line through points, in a colour of its own. `said` and `unit` surround the value in the tooltip; without words there is no tooltip.
 * `values` are the meanings of the heights, if these are not the values themselves. */
export interface Line extends Live {
  kind: "line";
  x: readonly number[];
  y: readonly number[];
  values?: readonly number[];
  width: number;
  dashed?: boolean;
  opacity?: number;
  said: string;
  unit: string;
}

/** The area between two lines. */
export interface Band extends Live {
  kind: "band";
  x: readonly number[];
  low: readonly number[];
  high: readonly number[];
  opacity: number;
}

/** Lines from point to point, each with its opacity. */
export interface Segments extends Live {
  kind: "segments";
  links: readonly { x0: number; y0: number; x1: number; y1: number; opacity: number }[];
  width?: number;
}

/** Discs, each with its opacity; or rings. */
export interface Nodes extends Live {
  kind: "nodes";
  x: readonly number[];
  y: readonly number[];
  opacity: readonly number[];
  size_px: number;
  ring: boolean;
}

/** Shaded intervals of the x axis, over the whole y axis or a part of it. */
export interface Spans extends Live {
  kind: "spans";
  intervals: readonly { first: number; last: number; low?: number; high?: number }[];
  opacity: number;
}

/** A cell by its indices on the axes. */
export interface Cell {
  i: number;
  j: number;
}

/** The look of a cell. `colour` is null if there is no value yet, `filled` the coloured share of the cell, 0..1;
 *  `isOutlined` is for colours near that of the page, `isHatched` for what has no value and will have none. */
export interface CellLook {
  colour: Readonly<Colour> | null;
  text?: string;
  filled: number;
  isOutlined?: boolean;
  isHatched: boolean;
}

/** Cells with individual looks, row after row, set when they are painted, since colours follow the theme; any of them can be chosen. Their
 * middles are at whole numbers of both axes. */
export interface CellMap extends Live {
  kind: "heat map";
  across: number;
  up: number;
  look: (index: number) => CellLook;
  chosen: Cell | null;
}

export type HeatMap = declared.HeatMap | CellMap;

export type Trace = declared.Trace | Line | Band | Segments | Nodes | Spans | CellMap;

/** One pair of axes with its traces. */
export interface Panel extends Omit<declared.Panel, "x" | "y" | "traces"> {
  x: Axis;
  y: Axis;
  traces: Trace[];
  /** Largest length of a unit of its axes, px; the remaining room at the right stays free. */
  unit_px?: number;
}

/** Panels in rows. */
export interface Figure {
  panels: Panel[];
}
