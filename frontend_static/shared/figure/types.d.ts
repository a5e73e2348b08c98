// Generated from pftrack/teaching/lessons/figure.py by `python -m tools.message_types`; changes here are lost.

/** An axis. */
export interface Axis {
  title: string;
  low: number;
  high: number;
  unit: string;
  log: boolean;
  names: string[];
  hidden: boolean;
}

/** Bars side by side, one per name of the axis; or stacked in one bar, as shares of a whole. */
export interface Bars {
  title: string;
  ink: "estimate" | "truth" | "prediction" | "observation" | "lost" | "second" | "hidden";
  reveals: boolean;
  kind: "bars";
  heights: (number | null)[];
  stacked: boolean;
}

/** A line through points. */
export interface Curve {
  title: string;
  ink: "estimate" | "truth" | "prediction" | "observation" | "lost" | "second" | "hidden";
  reveals: boolean;
  kind: "curve";
  x: (number | null)[];
  y: (number | null)[];
  dashed: boolean;
  area: [number, number] | null;
}

/** Panels in rows. */
export interface Figure {
  panels: Panel[];
}

/** A parameter of the lesson that is turned by dragging a line across the panel, or by the arrow keys on it. */
export interface Handle {
  parameter: string;
  at: number;
  along: "x" | "y";
}

/** Amounts over a plane, in viridis from nothing to the largest. */
export interface HeatMap {
  title: string;
  ink: "estimate" | "truth" | "prediction" | "observation" | "lost" | "second" | "hidden";
  reveals: boolean;
  kind: "heat map";
  x: (number | null)[];
  y: (number | null)[];
  values: ((number | null)[])[];
}

/** Adjoining bars over intervals. */
export interface Histogram {
  title: string;
  ink: "estimate" | "truth" | "prediction" | "observation" | "lost" | "second" | "hidden";
  reveals: boolean;
  kind: "histogram";
  edges: (number | null)[];
  heights: (number | null)[];
}

/** One pair of axes with what is drawn in it. */
export interface Panel {
  id: string;
  title: string;
  x: Axis;
  y: Axis;
  traces: (Curve | Histogram | HeatMap | Stems | Bars | Scatter | StripChart | Tree | Rule)[];
  handles: Handle[];
  words: string;
  row: number;
  share: [number, number];
}

/** A line across the panel at a value, such as a mean. */
export interface Rule {
  title: string;
  ink: "estimate" | "truth" | "prediction" | "observation" | "lost" | "second" | "hidden";
  reveals: boolean;
  kind: "rule";
  at: number;
  along: "x" | "y";
  dashed: boolean;
}

/** Points. */
export interface Scatter {
  title: string;
  ink: "estimate" | "truth" | "prediction" | "observation" | "lost" | "second" | "hidden";
  reveals: boolean;
  kind: "scatter";
  x: (number | null)[];
  y: (number | null)[];
  size_px: number;
}

/** Lines from nothing up to points, such as draws with their weights. */
export interface Stems {
  title: string;
  ink: "estimate" | "truth" | "prediction" | "observation" | "lost" | "second" | "hidden";
  reveals: boolean;
  kind: "stems";
  x: (number | null)[];
  y: (number | null)[];
}

/** A value over steps of time: a line with a dot at each step. */
export interface StripChart {
  title: string;
  ink: "estimate" | "truth" | "prediction" | "observation" | "lost" | "second" | "hidden";
  reveals: boolean;
  kind: "strip chart";
  x: (number | null)[];
  y: (number | null)[];
}

/** Who descends from whom: a column for each generation, a row for each particle. */
export interface Tree {
  title: string;
  ink: "estimate" | "truth" | "prediction" | "observation" | "lost" | "second" | "hidden";
  reveals: boolean;
  kind: "tree";
  parents: ((number | null)[])[];
  weights: ((number | null)[])[];
}

/** A trace of a panel. */
export type Trace = Curve | Histogram | HeatMap | Stems | Bars | Scatter | StripChart | Tree | Rule;
