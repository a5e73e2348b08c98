/** What is in a page: the run's numbers, which the page reads, and its scene, which the player in the frame reads. */

/** A property of a node: a value, or where its array is. */
export type Prop =
  | string
  | number
  | boolean
  | null
  | number[]
  | { picture: number; array?: undefined; lines?: undefined }
  | { lines: string; which: number; picture?: undefined }
  | { array: string; columns: number[]; picture?: undefined; lines?: undefined };

/** Which node, where it is, how it is turned, whether it is shown, and what is not as it was made. */
export type State = [node: number, position: number[], wxyz: number[], visible: number, changed: Record<string, Prop>];

/** Numbers of states, of the scene as it is seen from the front and as it is seen from aside. */
export type Moment = [flat: number[], raised: number[]];

export interface Description {
  nodes: { name: string; type: string; layer: string; props: Record<string, Prop> }[];
  states: State[];
  lines: Record<string, number[]>;
  columns: [form: string, count: number, at: number][];
  moments: Moment[];
}

/** A way to look: from which direction, and how far from the target to stand for some shapes of the window. */
export interface View {
  name: string;
  title: string;
  beside: boolean;
  target: number[];
  towards: number[];
  fov: number;
  aspects: number[];
  distances: number[];
}

/** How steeply the camera has to be tilted for heights to rise, rad, and in how many steps they do. */
export interface Relief {
  flat: number;
  full: number;
  steps: number;
}

/** What the page tells the player. */
export interface Told {
  recording?: { packed: ArrayBuffer; pictures: ArrayBuffer; sizes: number[]; relief: Relief };
  moment?: number;
  view?: View;
  hidden?: string[];
}

/** What the player, or a key in its frame, tells the page. */
export interface Heard {
  source?: string;
  ready?: boolean;
  drawn?: number;
  key?: string;
  shiftKey?: boolean;
}

export interface Run {
  frames: number;
  rate_hz: number;
  /** The frames that the scene has, and what is said of each of them. */
  kept: number[];
  captions: string[];
  /** Whether the target was lost, 1 or 0, by frame. */
  gone: number[];
  /** Words by frame, of each reading. */
  readings: string[][];
  views: View[];
  /** Bytes of each picture. */
  sizes: number[];
  relief: Relief;
}
