/** As much of BokehJS as the plots use. Its models take assignments to their properties for changes, and draw again. */

/** Columns of a source, by name. */
export type Data = Record<string, number[] | number[][]>;

/** Where a glyph finds a coordinate: in a column. */
export interface Field {
  field: string;
}

export interface Range {
  start: number;
  end: number;
}

export interface Source {
  data: Data;
  /** Add rows to the columns. */
  stream(data: Data): void;
}

export interface Glyph {
  line_color: string | null;
  line_width: number;
  /** Of areas and markers alone. */
  fill_color?: string | null;
}

export interface Renderer {
  glyph: Glyph;
  data_source: Source;
  visible: boolean;
  level: "underlay" | "glyph" | "guide" | "overlay";
  tags: string[];
}

export interface Ticker {
  ticks?: number[];
  desired_num_ticks?: number;
}

export interface PlotAxis {
  visible: boolean;
  ticker: Ticker;
  major_label_overrides: Map<number, string>;
  major_label_text_color: string;
  major_tick_line_color: string;
  major_tick_out: number;
}

export interface Grid {
  visible: boolean;
  ticker: Ticker;
  grid_line_color: string;
}

/** A line through the whole figure. */
export interface Span {
  location: number;
  line_color: string;
}

/** How a glyph looks, and what it is known by. */
export interface Look {
  fill_alpha?: number | Field;
  fill_color?: string | null;
  level?: Renderer["level"];
  line_alpha?: number | Field;
  line_color?: string | null;
  line_dash?: "dashed" | number[];
  line_join?: "round";
  line_width?: number;
  name?: string;
  size?: number;
  tags?: string[];
}

type Drawn = Look & { source: Source };

export interface FigureModel {
  min_border_left: number;
  min_border_right: number;
  xaxis: PlotAxis;
  yaxis: PlotAxis;
  xaxes: PlotAxis[];
  yaxes: PlotAxis[];
  xgrid: Grid;
  ygrid: Grid;
  ygrids: Grid[];
  add_layout(layout: Span): void;
  on_event(name: "tap", heard: (event: { x: number; y: number }) => void): void;
  line(x: Field, y: Field, look: Drawn): Renderer;
  multi_line(xs: Field, ys: Field, look: Drawn): Renderer;
  quad(look: Drawn & { left: Field; right: Field; top: Field; bottom: Field }): Renderer;
  scatter(x: Field, y: Field, look: Drawn): Renderer;
  segment(x0: Field, y0: Field, x1: Field, y1: Field, look: Drawn): Renderer;
  varea(x: Field, y1: Field, y2: Field, look: Drawn): Renderer;
  vstrip(x0: Field, x1: Field, look: Drawn): Renderer;
}

export interface BokehDocument {
  config: { notifications: unknown };
  add_root(model: FigureModel): void;
  clear(): void;
}

interface View {
  remove(): void;
}

/** What the scripts put into the page's window. */
export interface BokehApi {
  ColumnDataSource: new (properties: { data: Data }) => Source;
  Document: new () => BokehDocument;
  FixedTicker: new (properties: { ticks: number[] }) => Ticker;
  Plotting: { figure(properties: Record<string, unknown>): FigureModel };
  Range1d: new (properties: Range) => Range;
  Span: new (properties: { location: number; dimension: "width" | "height"; line_width: number; line_dash?: number[] }) => Span;
  documents: BokehDocument[];
  embed: {
    add_document_standalone(document: BokehDocument, element: HTMLElement, roots: HTMLElement[]): Promise<Iterable<View> & { clear(): void }>;
  };
  set_log_level(level: "error"): void;
}
