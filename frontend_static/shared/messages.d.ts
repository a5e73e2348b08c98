// Generated from the server's models by `python -m tools.message_types`; changes here are lost.

/** A number. */
export interface Amount {
  title: string;
  value: number | null;
  unit: string;
  limit: number | null;
  kind: "amount";
}

/** A person's prediction: a number, or the name of a choice. */
export interface AnswerRequest {
  answer: number | string;
}

/** An axis with its labels for a map. */
export interface AxisPublic {
  name: string;
  title: string;
  unit: string;
  kind: string;
  values: (boolean | number | string)[];
}

/** Results of runs with other seeds, frame by frame, as far as computed. */
export interface Bands {
  runs: number;
  frames: number;
  computed: number[];
  unit: string;
  low: (number | null)[];
  middle: (number | null)[];
  high: (number | null)[];
  holding: (number | null)[];
}

/** Go to a frame shortly before the target was lost. */
export interface BeforeLoss {
  kind: "before_loss";
}

/** A frame that somebody wants to find again. */
export interface Bookmark {
  id: string;
  frame: number;
  note: string;
  branch: string;
}

/** A bookmark on the shown frame. */
export interface BookmarkCreate {
  note?: string;
}

/** A branch in the page's list. */
export interface BranchPublic {
  id: string;
  title: string;
  parent: string | null;
  frame: number;
  tracker: string;
  colour: string;
}

/** The changed cells, by their number: row after row of the y axis. */
export interface Cells {
  version: 1;
  type: "cells";
  done: number;
  at: number[];
  maps: MapPublic[];
}

/** A sweep over one or two of its axes; the others, and the trials, are pooled. */
export interface CellsPublic {
  x: AxisPublic;
  y: AxisPublic | null;
  planned: number;
  done: number;
  maps: MapPublic[];
  comparison: ComparisonPublic | null;
}

/** Values that take effect in a frame. */
export interface Change {
  frame: number;
  values: Record<string, unknown>;
}

/** A change of parameters on the timeline, with the values before it, unless the run begins with it. */
export interface ChangePublic {
  frame: number;
  values: Record<string, boolean | number | string>;
  before: Record<string, boolean | number | string>;
  /** Changes made by a person, in words */
  moved: string[];
}

/** Change parameters from the next frame on; in the past this makes a branch. */
export interface ChangeValues {
  kind: "change";
  /** New values by name of the parameter; `tracker` is the tracker */
  values: Record<string, unknown>;
}

/** The values after a change, and the frame from which they apply. */
export interface Changed {
  parameters: Record<string, boolean | number | string>;
  tracker: string;
  frame: number;
  branch: string;
}

/** The changed fields of a session's snapshot, and new rows of diagnostics; all other fields stay as they are. */
export interface Changes {
  version: 1;
  type: "changes";
  session: Partial<SessionSnapshot>;
  /** Diagnostics of new frames of the branch active then */
  rows: Record<string, unknown>[];
}

/** A claim of a lesson that can be computed. */
export interface CheckPublic {
  name: string;
  title: string;
}

/** The result of a check. */
export interface CheckedPublic {
  check: string;
  title: string;
  ours: number | null;
  exact: number | null;
  tolerance: number | null;
  passed: boolean;
  /** Why it could not be computed, one sentence */
  problem: string | null;
}

/** The results of the checks so far. */
export interface ChecksPublic {
  done: number;
  total: number;
  results: CheckedPublic[];
}

/** A possible answer. */
export interface ChoicePublic {
  name: string;
  /** HTML */
  words: string;
}

/** A citation of a place in a publication. */
export interface CitationPublic {
  /** Name of the publication in BibTeX */
  key: string;
  /** Family names, year and place */
  short: string;
  /** The whole reference as plain text */
  text: string;
  bibtex: string;
}

/** Possible meanings of a column in a table of boxes; the title is the question to the user. */
export interface ColumnMeaning {
  name: string;
  title: string;
}

/** The diagnostics of a branch, one list per column. */
export interface Columns {
  branch: string;
  columns: Record<string, unknown[]>;
}

/** One of the runs of a comparison. */
export interface ComparedPublic {
  /** Name by its special setting */
  name: string;
  /** Title, if a person gave one */
  title: string | null;
  colour: string;
  /** Its frame that is compared first */
  first: number;
  recipe: Recipe;
  /** The recipe, cut to the compared frames */
  shown: Recipe;
  upload: string | null;
}

/** A run to compare, given by a reference or by its recipe. */
export interface ComparedRun {
  /** `run`, `session:branch`, `sweep:run`[`:tracker`] */
  reference?: string | null;
  recipe?: RecipeRequest | null;
  /** Name of the upload that holds the recipe's footage */
  upload?: string | null;
}

/** Two to four runs to compare. */
export interface ComparisonCreate {
  runs: ComparedRun[];
}

/** Two to four runs whose comparison to write as a file. */
export interface ComparisonExportCreate {
  runs: ComparedRun[];
  /** Title for the file's name */
  title?: string;
}

/** A comparison of runs; its steps are frames of all runs. */
export interface ComparisonJob {
  id: string;
  kind: "comparison";
  /** Name of the file being read or written, or of what is compared, fitted or explored */
  name: string;
  state: "working" | "done" | "failed";
  /** Steps done */
  done: number;
  /** Total of steps; 0 until it is known */
  total: number;
  /** Result so far; complete once the job is done */
  result: RunComparisonPublic | null;
  /** Why the job failed, a sentence */
  error: string | null;
}

/** A comparison of two methods, cell by cell. */
export interface ComparisonPublic {
  first: string;
  second: string;
  measure: string;
  test: "chi-square" | "rank-sum" | "mcnemar" | "signed-rank";
  level: number;
  correction: "none" | "holm";
  difference: (number | null)[];
  paired: (number | null)[];
  paired_low: (number | null)[];
  paired_high: (number | null)[];
  pairs: number[];
  verdict: ("first" | "second" | "none" | "untested")[];
  p_value: (number | null)[];
}

/** A comparison of computed runs. */
export interface ComparisonResult {
  frames: number;
  outcomes: Outcome[];
  partings: Divergence[];
  first_difference: number | null;
  before_loss: number | null;
  paired: Paired[];
}

/** Progress of compiling, which is needed once after an installation or an update. */
export interface CompilationPublic {
  finished: boolean;
  /** In words: "compiling, 14 of 41 functions, about 40 s on an idle machine" */
  sentence: string;
  /** Number of compiled functions */
  done: number;
  /** Number of functions; 0 while unknown */
  total: number;
  /** Seconds left on an idle machine; null if unknown */
  seconds_left: number | null;
  /** Experiments ready to start */
  usable: string[];
  /** Experiments compiled whole */
  ready: string[];
}

/** One coordinate of a state. */
export interface Component {
  name: string;
  unit: string;
}

/** The run that answers the question is still being computed; ask again. */
export interface ComputingPublic {
  done: number;
  total: number;
}

/** Contributions of several items. */
export interface Contributions {
  title: string;
  columns: string[];
  names: string[];
  rows: ((number | null)[])[];
  kind: "contributions";
}

/** A number with a limit over the last frames, such as the normalised innovation squared. */
export interface Course {
  title: string;
  limit: number;
  first: number;
  values: (number | null)[];
}

/** The declaration of one parameter for page, command line and documentation. */
export interface Declaration {
  name: string;
  title: string;
  description: string;
  unit: string;
  kind: "integer" | "number" | "boolean" | "choice" | "colour" | "file";
  default: boolean | number | string;
  minimum: number | null;
  maximum: number | null;
  step: number | null;
  useful: [number, number] | null;
  choices: string[];
  live: boolean;
  group: string;
  trackers: string[];
  role: "" | "particles" | "threshold" | "noise" | "memory" | "smoothing" | "sharpness" | "resampling" | "world" | "loss_share" | "drawing";
  threshold_of: string;
  sets: number;
  accept: string;
  /** Title with unit, the label of a control. */
  label: string;
  /** Description, bounds, and whether a change restarts the run. */
  hint: string;
}

/** What is wrong at a moment of a run. */
export interface Diagnosis {
  frame: number | null;
  lost: boolean;
  witness: "truth" | "tracker" | "";
  signs: Sign[];
  first_lost_frame: number | null;
  /** What began first; "unclear" where nothing is found. */
  cause: "sample-impoverishment" | "overconfident-weights" | "look-alike-capture" | "wrong-dynamics" | "occlusion-longer-than-memory" | "degenerate-resampling" | "mirror-pose" | "shrinking-covariance" | "template-drift" | "detector-seized-by-background" | "target-not-in-the-picture" | "uninformative-likelihood" | "changed-look" | "noisy-picture" | "nothing-to-measure" | "unclear";
  /** What went wrong, in a sentence. */
  sentence: string;
  /** How often a cause that is named is right, in a sentence; empty where none is named. */
  reliability: string;
}

/** One setting that the cure changes. */
export interface DifferencePublic {
  title: string;
  unit: string;
  failing: boolean | number | string;
  cured: boolean | number | string;
}

/** The frame at which two runs diverge. */
export interface Divergence {
  first: number;
  second: number;
  frame: number | null;
}

/** Description of one kind of mark for editors. */
export interface Editor {
  kind: string;
  title: string;
  instruction: string;
  text: string;
  handles: Handle[];
  links: ([string, string])[];
  closed: boolean;
  numbers: MarkNumber[];
}

/** The size of a sweep before it starts. */
export interface EstimatePublic {
  runs: number;
  conditions: number;
  cells: number;
  frames: number;
  axes: ValuesPublic[];
  jobs: number;
  bytes: number;
  seconds: number | null;
  problem: string | null;
}

/** A sweep whose size is requested before it starts. */
export interface EstimateRequest {
  experiment: string;
  /** Title; made from the plan if it is not given. */
  title?: string | null;
  /** Axes; all values are combined. May be empty on a recording. */
  axes: SweepAxis[];
  /** Trackers; all get the same seeds. */
  trackers?: string[];
  trials?: number;
  /** Length of a run. */
  frames?: number | null;
  seed?: number;
  /** Whether to measure the probability of a loss, too. */
  loss_probability?: boolean;
  /** Parameters that differ from the defaults in every run. */
  parameters?: Record<string, unknown>;
  /** The recording of all runs; the simulated scene if not given. */
  footage?: FootageRequest | null;
  /** Name of the footage's upload; the footage's hash is enough, too. */
  upload?: string | null;
  /** Whether to measure the time on a few runs, which takes some seconds. */
  measure?: boolean;
}

/** A column of numbers in the frames around what it shows. */
export interface Evidence {
  name: string;
  title: string;
  unit: string;
  first: number;
  values: (number | null)[];
}

/** An experiment with all its parameters. */
export interface ExperimentDetail {
  id: string;
  title: string;
  /** Title on a recording */
  clip_title: string;
  /** Kind of quantity that it estimates; a family is listed together */
  family: string;
  question: string;
  /** Sources, the main one first */
  references: CitationPublic[];
  description: string;
  accepts_video: boolean;
  /** Kinds of recording that it takes, as in an upload's kind */
  footage: string[];
  /** The target, one word */
  target: string;
  /** Kinds of mark that it takes in a recording, the default one first */
  marks: Editor[];
  /** Kinds of recording in which the target need not be marked */
  unmarked: string[];
  /** Kind of mark that it finds by itself; null if a person marks the target */
  finds: string | null;
  /** Kinds of mark with which a person can hint at the target */
  hints: string[];
  /** Whether it can judge a target's suitability before tracking */
  suits: boolean;
  /** Advice for marking the target */
  advice: string;
  /** Columns of a truth table for a recording; empty if it takes none */
  truth_columns: string[];
  default_tracker: string;
  frames: number;
  trackers: Record<string, string>[];
  presets: Preset[];
  /** Address of a small picture; null if it has none */
  thumbnail: string | null;
  declarations: Declaration[];
  layers: Layer[];
  worlds: World[];
  schema: Record<string, unknown>;
  /** Trackers that can give the probability of a loss */
  loss_trackers: string[];
}

/** An experiment on the start page. */
export interface ExperimentPublic {
  id: string;
  title: string;
  /** Title on a recording */
  clip_title: string;
  /** Kind of quantity that it estimates; a family is listed together */
  family: string;
  question: string;
  /** Sources, the main one first */
  references: CitationPublic[];
  description: string;
  accepts_video: boolean;
  /** Kinds of recording that it takes, as in an upload's kind */
  footage: string[];
  /** The target, one word */
  target: string;
  /** Kinds of mark that it takes in a recording, the default one first */
  marks: Editor[];
  /** Kinds of recording in which the target need not be marked */
  unmarked: string[];
  /** Kind of mark that it finds by itself; null if a person marks the target */
  finds: string | null;
  /** Kinds of mark with which a person can hint at the target */
  hints: string[];
  /** Whether it can judge a target's suitability before tracking */
  suits: boolean;
  /** Advice for marking the target */
  advice: string;
  /** Columns of a truth table for a recording; empty if it takes none */
  truth_columns: string[];
  default_tracker: string;
  frames: number;
  trackers: Record<string, string>[];
  presets: Preset[];
  /** Address of a small picture; null if it has none */
  thumbnail: string | null;
}

/** All findings on a loss. */
export interface Explanation {
  diagnosis: Diagnosis;
  what_if: Report | null;
  untried: string;
  before: number | null;
}

/** The exploration of a session's active branch to begin. */
export interface ExplorationCreate {
  kind: "what-if" | "ensemble";
  /** For what-if: a frame of the loss (default: the first lasting) */
  frame?: number | null;
  /** For an ensemble: whether each run sees the scene of its own seed */
  scene?: "same" | "other";
  /** Time limit, s */
  seconds?: number;
}

/** Changes that would have saved a run (a report), or runs with other seeds (bands). */
export interface ExplorationJob {
  id: string;
  kind: "exploration";
  /** Name of the file being read or written, or of what is compared, fitted or explored */
  name: string;
  state: "working" | "done" | "failed";
  /** Steps done */
  done: number;
  /** Total of steps; 0 until it is known */
  total: number;
  /** Result so far; complete once the job is done */
  result: Report | Bands | null;
  /** Why the job failed, a sentence */
  error: string | null;
  session: string;
  branch: string;
  /** Whether the session's run has changed since then */
  stale: boolean;
}

/** A file that is being written; the first half of its steps computes the run. */
export interface ExportJob {
  id: string;
  kind: "export";
  /** Name of the file being read or written, or of what is compared, fitted or explored */
  name: string;
  state: "working" | "done" | "failed";
  /** Steps done */
  done: number;
  /** Total of steps; 0 until it is known */
  total: number;
  /** Result so far; complete once the job is done */
  result: ExportedFile | null;
  /** Why the job failed, a sentence */
  error: string | null;
}

/** An exported file. */
export interface ExportedFile {
  /** Title of the file's kind */
  title: string;
  media_type: string;
  /** Address of the file */
  address: string;
}

/** The exports of a saved run. */
export interface ExportsPublic {
  exports: FileKind[];
  /** Values of `plot` for an export of the group "plots" */
  plots: Plot[];
}

/** The failure before another in the gallery, or the one after it. */
export interface FailureNeighbour {
  id: string;
  title: string;
}

/** A named failure of an experiment's trackers, and its cure. */
export interface FailurePublic {
  id: string;
  /** Number in the gallery; usable in addresses in place of the id */
  number: number;
  title: string;
  kind: string;
  kind_title: string;
  /** First cause in the diagnosis of its run */
  cause: "sample-impoverishment" | "overconfident-weights" | "look-alike-capture" | "wrong-dynamics" | "occlusion-longer-than-memory" | "degenerate-resampling" | "mirror-pose" | "shrinking-covariance" | "template-drift" | "detector-seized-by-background" | "target-not-in-the-picture" | "uninformative-likelihood" | "changed-look" | "noisy-picture" | "nothing-to-measure" | "unclear";
  experiment: string;
  experiment_title: string;
  /** Failure and its reason */
  diagnosis: string;
  /** Remedy and its reason */
  cure: string;
  /** The frame before it happens */
  frame: number;
  /** Settings that the cure changes at frame 0 */
  differences: DifferencePublic[];
  failing: Recipe;
  cured: Recipe;
  page: string;
  previous: FailureNeighbour | null;
  next: FailureNeighbour | null;
}

/** Both runs of a failure, computed on this server. */
export interface FailureResult {
  unit: string;
  /** Frame of the first loss; null if the target is not lost here */
  frame: number | null;
  /** Medians, and shares of frames in %, from that frame on */
  measured: Measured[];
  failing: FailureSide;
  cured: FailureSide;
}

/** The result of one of a failure's two runs. */
export interface FailureSide {
  /** Error in each frame; null where the truth is unknown */
  errors: (number | null)[];
  /** Whether the target is lost, for each frame */
  lost: boolean[];
  /** Whether the run fails in this way */
  shown: boolean;
  /** Finding in the run's numbers, a sentence */
  finding: string;
  /** Numbers behind the finding; empty if the run does not fail this way */
  numbers: Record<string, number | null>;
  /** Cause of the loss, derived from the run's numbers alone, a sentence */
  why: string;
}

/** The figure of a lesson at some parameters. */
export interface FigurePublic {
  /** The figure, in the form of `pftrack.teaching.lessons.Figure` */
  figure: Record<string, unknown>;
  numbers: Number[];
  /** In force */
  parameters: Record<string, boolean | number | string>;
  seed: number;
}

/** A request for a figure at some parameters. */
export interface FigureRequest {
  /** Values by name; missing ones are the defaults */
  parameters?: Record<string, unknown>;
  /** Random seed; left out for the lesson's own */
  seed?: number | null;
  /** Whether to show what answers the question */
  revealed?: boolean;
  /** Whether a number out of bounds becomes the nearest allowed one */
  nearest?: boolean;
}

/** A new figure of the lecturer's lesson. */
export interface FigureShown {
  version: 1;
  type: "figure";
  lesson: string;
  /** The figure, as sent to the lecturer's page */
  figure: Record<string, unknown>;
}

/** A file format for runs or comparisons. */
export interface FileKind {
  name: string;
  title: string;
  suffix: string;
  media_type: string;
  group: "numbers" | "boxes" | "truth" | "film" | "plots" | "documents" | "model";
  beside: boolean;
  short: string;
}

/** A filter file of the server's owner. */
export interface FilterPublic {
  /** Name of its tracker */
  name: string;
  file: string;
  /** Experiment whose target it follows */
  experiment: string;
  /** Hash of its text, which recipes refer to */
  digest: string;
  text: string;
  /** Whether pages may write it */
  editable: boolean;
  hints: Hint[];
  /** Columns of the states at the default parameters */
  components: Component[];
  /** Description of a frame's content for the functions */
  observed: string;
}

/** A new text for a filter file. */
export interface FilterUpdate {
  text: string;
  /** Hash of the text that it replaces */
  before: string;
}

/** The result of a fit. */
export interface Fit {
  tracker: string;
  numbers: Fitted[];
  halves: [Half, Half];
  gain: number;
  gain_error: number;
  method: "em" | "search";
  rounds: number;
  runs: number;
  seeds: number;
  lost: number;
  /** Whether what was found is better on the half that was not used. */
  kept: boolean;
  /** The new values, by name; empty if they are not kept. */
  values: Record<string, boolean | number | string>;
  /** The result, one sentence. */
  verdict: string;
  /** The method, one sentence. */
  procedure: string;
  /** Why it may mislead, one sentence; empty if nothing speaks against it. */
  caution: string;
}

/** The parameters to fit. */
export interface FitCreate {
  /** Names of the tracker's parameters */
  numbers: string[];
}

/** A fit of parameters to the data of a session's run. */
export interface FitJob {
  id: string;
  kind: "fit";
  /** Name of the file being read or written, or of what is compared, fitted or explored */
  name: string;
  state: "working" | "done" | "failed";
  /** Steps done */
  done: number;
  /** Total of steps; 0 until it is known */
  total: number;
  /** Result so far; complete once the job is done */
  result: Fit | null;
  /** Why the job failed, a sentence */
  error: string | null;
}

/** One number that was fitted. */
export interface Fitted {
  name: string;
  title: string;
  unit: string;
  before: number;
  after: number;
  at_bound: boolean;
}

/** A new class, on at least one session or a lesson. */
export interface FollowCreate {
  /** One session, or up to four to compare */
  sessions?: string[];
  lesson?: string | null;
  /** Title; left out for that of the lesson or the first session */
  title?: string | null;
  /** Arrangement on the lecturer's page, for the followers' pages */
  arrangement?: Record<string, unknown>;
  /** Followers at one time; 0 closes the class to new ones */
  most_followers?: number;
  /** Hours from now after which it ends by itself */
  hours?: number;
}

/** The class's state; `hello` is the first message to a follower. */
export interface FollowNews {
  version: 1;
  type: "hello" | "follow";
  follow: FollowPublic;
}

/** The lecturer's view of a class. */
export interface FollowOwned {
  title: string;
  sessions: FollowedPublic[];
  lesson: string | null;
  arrangement: Record<string, unknown>;
  expires: string;
  poll: PollPublic | null;
  id: string;
  /** Links for followers, the best first */
  links: LinkPublic[];
  /** Link for another device of the lecturer; gives rights over this class only */
  owner_link: string;
  /** Why others cannot follow, a sentence */
  notice: string | null;
  followers: number;
  most_followers: number;
  /** Number of followers with a copy of their own */
  forks: number;
}

/** The followers' view of a class; `mine` is null in messages to all. */
export interface FollowPublic {
  title: string;
  sessions: FollowedPublic[];
  lesson: string | null;
  arrangement: Record<string, unknown>;
  expires: string;
  poll: PollPublic | null;
  mine: MinePublic | null;
}

/** A class's content and limits; in a change, fields that are left out stay the same. */
export interface FollowUpdate {
  /** One session, or up to four to compare */
  sessions?: string[];
  lesson?: string | null;
  /** Title; left out for that of the lesson or the first session */
  title?: string | null;
  /** Arrangement on the lecturer's page, for the followers' pages */
  arrangement?: Record<string, unknown>;
  /** Followers at one time; 0 closes the class to new ones */
  most_followers?: number;
  /** Hours from now after which it ends by itself */
  hours?: number;
}

/** A followed session. */
export interface FollowedPublic {
  id: string;
  title: string;
}

/** A recording with its target. */
export interface Footage {
  sha256: string | null;
  name: string;
  path: string | null;
  start: number;
  mark: Record<string, unknown> | null;
  truth: Record<string, number[]> | null;
  labelled: boolean;
  square: boolean | null;
}

/** A recording with its target. */
export interface FootageRequest {
  sha256?: string | null;
  name?: string;
  path?: string | null;
  start?: number;
  mark?: Record<string, unknown> | null;
  truth?: Record<string, number[]> | null;
  labelled?: boolean;
  square?: boolean | null;
}

/** A follower's request for a copy of a session, or to change the lesson's figure. */
export interface ForkCreate {
  /** Session of the class to copy; left out for the lesson */
  session?: string | null;
  /** First frame of the copy; left out for the shown frame */
  frame?: number | null;
}

/** A follower's copy: a session or the lesson. */
export interface ForkPublic {
  /** Name of the session; null for the lesson */
  id: string | null;
  title: string;
  page: string;
}

/** The ancestors of the particles of the frame. */
export interface GenealogyPublic {
  /** The oldest frame */
  first: number;
  /** Number of distinct ancestors in each frame from there on */
  counts: number[];
  /** The newest frame in which one particle is the ancestor of all */
  coalesced: number | null;
  /** Heights of lines, 0 to 1, in each frame; null before a line begins */
  lines: ((number | null)[])[];
}

/** One half of a run, with random numbers that no trial had. */
export interface Half {
  first: number;
  last: number;
  before: Score;
  after: Score;
}

/** A point of a mark that a person can drag. */
export interface Handle {
  name: string;
  title: string;
  at: [number, number];
}

/** Description of a function. */
export interface Hint {
  name: string;
  arguments: string[];
  returns: string;
  about: string;
}

/** Found and expected shares of bins. */
export interface Histograms {
  title: string;
  expected: number[];
  found: number[];
  colours: string[];
  kind: "histograms";
}

/** An imported run that is being computed; its steps are frames. */
export interface ImportJob {
  id: string;
  kind: "import";
  /** Name of the file being read or written, or of what is compared, fitted or explored */
  name: string;
  state: "working" | "done" | "failed";
  /** Steps done */
  done: number;
  /** Total of steps; 0 until it is known */
  total: number;
  /** Result so far; complete once the job is done */
  result: RunPublic | null;
  /** Why the job failed, a sentence */
  error: string | null;
}

/** Inspect a place or a particle, or the estimate if neither is given; it is drawn from now on. */
export interface Inspect {
  kind: "inspect";
  /** Whether to draw the likelihood over the picture */
  likelihood?: boolean;
  /** Place in the picture, px */
  place?: [number, number] | null;
  /** Whether to inspect and follow the particle nearest to the place */
  picks?: boolean;
  /** Index of a particle to follow */
  particle?: number | null;
  /** Frame of the particle; left out for the shown one */
  frame?: number | null;
  /** Whether to return the ancestors of all particles */
  genealogy?: boolean;
  /** Whether to draw the parts of the tracker's step as arrows */
  pulls?: boolean;
}

/** Findings of an inspection in the shown frame. */
export interface InspectionPublic {
  frame: number;
  /** Inspected subject; gone is a particle without descendants here */
  subject: "estimate" | "place" | "particle" | "gone";
  place: [number, number] | null;
  /** Title of the likelihood; empty if the tracker has none to show */
  title: string;
  /** Whether the likelihood can be drawn over the picture */
  has_map: boolean;
  /** Log likelihoods of the darkest and the lightest colour */
  scale: [number, number] | null;
  /** Log likelihood at the place; null if unavailable or impossible */
  log_likelihood: number | null;
  impossible: boolean;
  parts: (Amount | Residual | Histograms | PatchesPublic | Contributions)[];
  state: StateValue[];
  particle: ParticleFinding | null;
  /** Parts of the tracker's step in this frame */
  update: (Amount | Residual | Histograms | PatchesPublic | Contributions)[];
  courses: Course[];
  genealogy: GenealogyPublic | null;
}

/** Work in progress, or its result. */
export interface Job {
  id: string;
  kind: string;
  /** Name of the file being read or written, or of what is compared, fitted or explored */
  name: string;
  state: "working" | "done" | "failed";
  /** Steps done */
  done: number;
  /** Total of steps; 0 until it is known */
  total: number;
  /** Result so far; complete once the job is done */
  result: unknown | null;
  /** Why the job failed, a sentence */
  error: string | null;
}

/** An entry of the legend. */
export interface Key {
  colour: string;
  meaning: string;
}

/** A part of a drawing that can be switched on and off. */
export interface Layer {
  name: string;
  title: string;
  shown: boolean;
  legend: Key[];
  role: "" | "through time" | "flat only";
}

/** Two to four runs next to each other. */
export interface LectureComparison {
  runs: ComparedRun[];
  position?: number;
  arrangement?: "side" | "over";
}

/** One item of a lecture, of one of the kinds. */
export interface LectureItem {
  /** Id of a lesson */
  lesson?: string | null;
  /** Id of a failure */
  failure?: string | null;
  session?: LectureRun | null;
  comparison?: LectureComparison | null;
  /** Id of a lesson whose question to ask the class */
  question?: string | null;
  /** A question of the lecturer's own */
  poll?: string | null;
  /** Answers of the poll */
  answers?: string[] | null;
  /** Title; left out for the content's own */
  title?: string | null;
  /** Minutes; left out for the usual time */
  minutes?: number | null;
}

/** The view of a lecture's item. */
export interface LectureItemPublic {
  /** The item itself, a LectureItem to send back */
  item: Record<string, unknown>;
  kind: "lesson" | "failure" | "session" | "comparison" | "question" | "poll";
  title: string;
  /** Its minutes, given or usual */
  minutes: number;
  /** Page that shows it; null for a poll, which appears over the present page */
  page: string | null;
  /** Question to the class, if it is a poll or a lesson's question */
  asks: PollCreate | null;
  /** Why it cannot be shown here, a sentence with the line in the file */
  problem: string | null;
}

/** A whole lecture. */
export interface LecturePublic {
  id: string;
  title: string;
  /** Items */
  count: number;
  minutes: number;
  created: string;
  updated: string;
  page: string;
  items: LectureItemPublic[];
  notes: string;
}

/** A run, and the first frame of its session. */
export interface LectureRun {
  /** `run`, `session:branch`, `sweep:run`[`:tracker`] */
  reference?: string | null;
  recipe?: RecipeRequest | null;
  /** Name of the upload that holds the recipe's footage */
  upload?: string | null;
  /** Frame to show; left out for that of a saved run, or the first */
  position?: number | null;
}

/** A lecture in a list. */
export interface LectureSummary {
  id: string;
  title: string;
  /** Items */
  count: number;
  minutes: number;
  created: string;
  updated: string;
  page: string;
}

/** A lecture from its page; its file has the same fields, with the notes as its text. */
export interface LectureUpdate {
  title: string;
  items?: LectureItem[];
  notes?: string;
}

/** A lesson with everything for its page; texts are HTML. */
export interface LessonDetail {
  id: string;
  /** Number in the course; 0 for a lesson outside it */
  number: number;
  title: string;
  kind: "demonstration" | "scenario";
  /** File or package that it comes from; empty for the project's own */
  origin: string;
  checks: CheckPublic[];
  uses: ScenarioPublic[];
  /** Minutes that it takes a class */
  minutes: number;
  /** Why it cannot be run here, one sentence */
  problem: string | null;
  idea: string;
  tries: string[];
  notice: string;
  declarations: Declaration[];
  defaults: Record<string, boolean | number | string>;
  /** Whether the figure depends on the seed */
  random: boolean;
  seed: number;
  question: QuestionPublic;
  /** Parameter values at which the question is asked */
  asked: Record<string, boolean | number | string>;
  scenario: ScenarioPublic | null;
  previous: NeighbourPublic | null;
  next: NeighbourPublic | null;
}

/** A problem of a lesson's or an exercise's file, or of a package of such files. */
export interface LessonProblem {
  origin: string;
  line: number;
  message: string;
}

/** A lesson in the overview. */
export interface LessonPublic {
  id: string;
  /** Number in the course; 0 for a lesson outside it */
  number: number;
  title: string;
  kind: "demonstration" | "scenario";
  /** File or package that it comes from; empty for the project's own */
  origin: string;
  checks: CheckPublic[];
  uses: ScenarioPublic[];
  /** Minutes that it takes a class */
  minutes: number;
  /** Why it cannot be run here, one sentence */
  problem: string | null;
}

/** All lessons; those of the course come first, in its order. */
export interface LessonsPublic {
  lessons: LessonPublic[];
  problems: LessonProblem[];
}

/** An address of the link for followers. */
export interface LinkPublic {
  address: string;
  /** Whether other machines can open it */
  everybody: boolean;
}

/** Leave the active branch at a frame and continue in a new one. */
export interface MakeBranch {
  kind: "branch";
  frame: number;
  /** New values by name of the parameter; `tracker` is the tracker */
  values?: Record<string, unknown>;
  /** Random seed of the tracker from there on; the scene stays the same */
  seed?: number | null;
  title?: string | null;
}

/** The cells of one method, a list for each quantity. */
export interface MapPublic {
  tracker: string;
  runs: number[];
  problems: number[];
  successes: (number | null)[];
  rate: (number | null)[];
  low: (number | null)[];
  high: (number | null)[];
  error: (number | null)[];
  lost_frames: (number | null)[];
  measures: Record<string, (number | null)[]>;
}

/** A number of a mark that a person can change. */
export interface MarkNumber {
  name: string;
  title: string;
  unit: string;
  minimum: number;
  maximum: number;
  step: number;
  default: number;
  about: string | null;
}

/** The declaration of a measure. */
export interface MeasurePublic {
  name: string;
  title: string;
  /** Its definition, one sentence */
  description: string;
  /** Share of frames, median over frames, or number of frames until the first miss */
  how: "share" | "median" | "mean" | "until";
  unit: string;
  better: "higher" | "lower";
  /** Author, title and year of its definition; empty for the project's own */
  source: string;
}

/** Evidence of a failure, in its run and in the cured one, in the frames from its loss to the end. */
export interface Measured {
  title: string;
  unit: string;
  failing: number | null;
  cured: number | null;
}

/** The part of a class's view that belongs to one follower. */
export interface MinePublic {
  fork: ForkPublic | null;
  vote: Vote | null;
}

/** Move a particle or the estimate before the next frame; in the past this makes a branch. */
export interface MoveBelief {
  kind: "move";
  /** The shown frame, in which it is moved */
  frame: number;
  /** Index of a drawn particle; left out for the estimate with all particles */
  particle?: number | null;
  /** New place in the drawing, px; the nearest allowed place is used */
  place: [number, number];
}

/** The lesson before or after. */
export interface NeighbourPublic {
  id: string;
  number: number;
  title: string;
}

/** A new title for a saved run or comparison. */
export interface NewTitle {
  title: string;
}

/** A number that a lesson shows, with its exact value where that is known. */
export interface Number {
  title: string;
  value: number | null;
  exact: number | null;
  tolerance: number | null;
  unit: string;
  digits: number;
  /** Whether the value is as close to the exact one as may be expected */
  within: boolean | null;
}

/** The method with which to open a run; by default its own. */
export interface OpenRequest {
  tracker?: string | null;
}

/** The result of one run in the compared frames. */
export interface Outcome {
  mean_error: number | null;
  success_share: number | null;
  lost_frames: number | null;
  first_lost_frame: number | null;
}

/** The class's state for the lecturer; `hello` is the first message. */
export interface OwnedNews {
  version: 1;
  type: "hello" | "follow";
  follow: FollowOwned;
}

/** A page's count of the drawings that it has painted or skipped since it connected. */
export interface Painted {
  type: "painted";
  count: number;
}

/** Mean difference of a quantity between the frames of two runs. */
export interface Paired {
  first: number;
  second: number;
  name: string;
  title: string;
  unit: string;
  better: "higher" | "lower";
  frames: number;
  mean: number | null;
  low: number | null;
  high: number | null;
}

/** Numbers of one particle. */
export interface ParticleFinding {
  particle: number;
  filter: string;
  number: number;
  count: number;
  weight: number;
  rank: number;
  sampler: string;
  ancestors: number[];
  begins: number | null;
  descendants: number[];
}

/** A patch of the picture and the expected patch, as data URLs of PNG files; null where it is outside. */
export interface PatchesPublic {
  kind: "patches";
  title: string;
  expected: string | null;
  found: string | null;
}

/** Stop playing or seeking. */
export interface Pause {
  kind: "pause";
}

/** The phase of a session; only `SessionState` derives and changes it. */
export type Phase = "starting" | "ready" | "playing" | "ended" | "suspended" | "crashed" | "closed";

/** A page's message on any stream, to measure the delay. */
export interface Ping {
  version?: 1;
  type: "ping";
  sent: number;
}

/** Play from the shown frame, or from the first frame if the last one is shown. */
export interface Play {
  kind: "play";
}

/** A plot over the frames of a run. */
export interface Plot {
  id: string;
  title: string;
  kind: "error" | "sigma" | "sample size" | "samplers" | "innovation" | "value" | "band" | "interval" | "features" | "frequency" | "hypotheses" | "tree";
  description: string;
  unit: string;
  series: string[];
  sd: string;
  truth: string;
  component: number;
  shown: string;
  visible: string;
  recognised: string;
  row_titles: string[];
  levels: number[];
  needs_truth: boolean;
}

/** An experiment that another package adds, or fails to add. */
export interface Plugin {
  name: string;
  package: string;
  /** Why it cannot be used, one sentence; empty if it can. */
  problem: string;
}

/** A question to the class: the lecturer's own with answers, a lesson's, or a stored one. */
export interface PollCreate {
  question: string | null;
  answers: string[] | null;
  /** Lesson whose question is asked; the server makes its answers */
  lesson: string | null;
  /** A stored poll, whose answers are shown again */
  kept: string | null;
  /** Lecture in which it is asked; stored with the answers */
  lecture: string | null;
}

/** A question to the class: the lecturer's own with answers, a lesson's, or a stored one. */
export interface PollCreateRequest {
  question?: string | null;
  answers?: string[] | null;
  /** Lesson whose question is asked; the server makes its answers */
  lesson?: string | null;
  /** A stored poll, whose answers are shown again */
  kept?: string | null;
  /** Lecture in which it is asked; stored with the answers */
  lecture?: string | null;
}

/** A closed poll with the votes for each answer; who voted is not stored. */
export interface PollKept {
  id: string;
  question: string;
  answers: string[];
  /** Votes for each answer */
  counts: number[];
  /** Followers who were present */
  followers: number;
  /** Title of the content that the class saw */
  title: string;
  /** The lecture in which it was asked, if any */
  lecture: string | null;
  lecture_title: string | null;
  asked: string;
  /** Number of answers */
  votes: number;
}

/** A question to the class, and its answers. */
export interface PollPublic {
  id: string;
  question: string;
  answers: string[];
  /** Number of answers; null for followers until it is revealed */
  votes: number | null;
  /** Votes for each answer; null until it is revealed */
  counts: number[] | null;
  revealed: boolean;
  /** Lesson that the question comes from, if any */
  lesson: string | null;
}

/** The answer to a ping; it returns the ping's time. */
export interface Pong {
  version: 1;
  type: "pong";
  sent: number;
}

/** A named starting point that shows something. */
export interface Preset {
  name: string;
  title: string;
  tracker: string;
  parameters: Record<string, boolean | number | string>;
  seed: number;
  watch: string;
  tour: Tour | null;
  /** Names of all parameters that it is about: those that it sets beyond the scene's, then the further ones. */
  about: string[];
}

/** Excerpt of a table that lets a user name its columns. */
export interface Preview {
  header: string[];
  rows: string[][];
  guess: Record<string, number>;
  meanings: ColumnMeaning[];
}

/** The sweep, after progress or a change of state. */
export interface Progress {
  version: 1;
  type: "progress";
  sweep: SweepPublic;
}

/** A lesson's question without its answer. */
export interface QuestionPublic {
  /** HTML */
  text: string;
  kind: "number" | "choice" | "point";
  unit: string;
  /** Lowest and highest possible answer */
  bounds: [number, number];
  choices: ChoicePublic[];
  /** For a "point": id of the figure's panel in which to place it */
  panel: string;
  along: "x" | "y";
}

/** The place of a request in the queue. */
export interface QueuePublic {
  /** Number of requests before it */
  before: number;
}

/** A line of numbers about one frame. */
export interface Reading {
  title: string;
  kind: "estimate" | "error" | "sigma" | "particles" | "samplers" | "evidence" | "time" | "value" | "interval" | "count" | "hypotheses";
  unit: string;
  series: string;
  sd: string;
}

/** Everything that determines a run, bit for bit. */
export interface Recipe {
  experiment: string;
  tracker: string | null;
  seed: number;
  frames: number | null;
  timeline: Change[];
  footage: Footage | null;
  filters: Record<string, unknown>;
  defaults: Record<string, boolean | number | string>;
}

/** Everything that determines a run, bit for bit. */
export interface RecipeRequest {
  experiment: string;
  tracker?: string | null;
  seed?: number;
  frames?: number | null;
  timeline?: Change[];
  footage?: FootageRequest | null;
  filters?: Record<string, unknown>;
  defaults?: Record<string, boolean | number | string>;
}

/** One number that summarises a series over a complete run, such as a column of a sweep. */
export interface Reduction {
  name: string;
  title: string;
  how: "mean" | "share" | "count";
  component: string;
}

/** A change that came through the scene's panel was refused. */
export interface Refused {
  message: string;
  field: string | null;
  bound: string | null;
  value: unknown;
  version: 1;
  type: "refused";
}

/** The results of all changes tried so far; its JSON has the findings as shown. */
export interface Report {
  loss: number;
  begin: number;
  end: number;
  last: number;
  judged: number;
  planned: number;
  trials: number;
  is_complete: boolean;
  first_lost_frame: number | null;
  reaches_end: boolean;
  /** The loss that is explained, in a sentence. */
  loss_sentence: string;
  /** The origin of the p-values, a sentence. */
  correction: string;
  /** The result in one or two sentences, as far as the seeds tried so far allow. */
  sentence: string;
  /** One entry a change, best first. */
  findings: ToldFinding[];
}

/** A found and an expected number. */
export interface Residual {
  title: string;
  found: number | null;
  expected: number | null;
  sd: number | null;
  unit: string;
  kind: "residual";
}

/** Start the active branch again with the current values. */
export interface Restart {
  kind: "restart";
  /** New random seed; left out for the same one */
  seed?: number | null;
}

/** One run of a sweep. */
export interface RowPublic {
  run: number;
  tracker: string;
  trial: number;
  seed: number;
  conditions: Record<string, boolean | number | string>;
  success: boolean | null;
  mean_error: number | null;
  lost_frames: number | null;
  first_lost_frame: number | null;
  measures: Record<string, number | null>;
  problem: string | null;
}

/** Some runs of a cell, failures first, and the number of all. */
export interface RowsPublic {
  total: number;
  failures: number;
  rows: RowPublic[];
}

/** A comparison; its frames are the common ones, counted from 0. */
export interface RunComparisonPublic {
  unit: string;
  frames: number;
  runs: ComparedPublic[];
  /** The settings that differ */
  settings: Setting[];
  /** Kinds of files to export it as */
  exports: FileKind[];
  /** Results of the runs, once they are computed */
  found: ComparisonResult | null;
}

/** The session whose active branch to save. */
export interface RunCreate {
  session: string;
  title?: string | null;
}

/** A saved run. */
export interface RunPublic {
  id: string;
  title: string;
  experiment: string;
  tracker: string;
  seed: number;
  frames: number;
  created: string;
  outcome: string;
  summary: Record<string, unknown>;
  /** Address of the run's picture. */
  thumbnail: string;
  /** Address of the page that lists the run. */
  page: string;
}

/** A comparison to save. */
export interface SavedComparisonCreate {
  title: string;
  runs: SavedRunRequest[];
  /** The first frame to show, among the common ones */
  position?: number;
  arrangement?: "side" | "over";
}

/** A saved comparison with its recipes. */
export interface SavedComparisonDetail {
  id: string;
  title: string;
  /** Experiments of its runs, each once */
  experiments: string[];
  /** Trackers of its runs, in order; empty for a default */
  trackers: string[];
  created: string;
  page: string;
  runs: SavedRun[];
  position: number;
  arrangement: "side" | "over";
}

/** A saved comparison. */
export interface SavedComparisonPublic {
  id: string;
  title: string;
  /** Experiments of its runs, each once */
  experiments: string[];
  /** Trackers of its runs, in order; empty for a default */
  trackers: string[];
  created: string;
  page: string;
}

/** The recipe of a run of a saved comparison. */
export interface SavedRun {
  recipe: Recipe;
}

/** The recipe of a run of a saved comparison. */
export interface SavedRunRequest {
  recipe: RecipeRequest;
}

/** A run of an experiment, with the parameters that can be changed. */
export interface ScenarioPublic {
  recipe: Recipe;
  /** Hint on what to look for, HTML */
  words: string;
  unlocked: string[];
  frame: number;
  /** Ids of the plots to show; empty for all */
  plots: string[];
  /** Names of layers to show in addition to the default ones */
  layers: string[];
  /** Title of the experiment */
  title: string;
  /** Why it cannot be run here, one sentence */
  problem: string | null;
}

/** The score of some frames, over several runs. */
export interface Score {
  log_evidence: number;
  coverage: Record<string, number>;
  nees: number | null;
  nis: number | null;
  nis_limits: [number, number] | null;
}

/** Terms that belong together. */
export interface Section {
  title: string;
  terms: Term[];
  experiment: string | null;
}

/** Go to a frame; pftrack computes the frames on the way. */
export interface Seek {
  kind: "seek";
  frame: number;
}

/** The declaration of a quantity measured in every frame. */
export interface Series {
  name: string;
  title: string;
  unit: string;
  shape: "number" | "vector" | "interval" | "hypotheses";
  role: "" | "particles" | "ess" | "resampled" | "distinct" | "share" | "flag" | "event" | "extent" | "likeness" | "model_likeness" | "misfit" | "visible" | "mirrored" | "mirror_gap" | "measured" | "loss_probability" | "excess" | "nis" | "nis_freedom" | "nis_limit";
  components: string[];
  colours: string[];
  reductions: Reduction[];
}

/** A new session. */
export interface SessionCreate {
  recipe: RecipeRequest;
  /** Name of the footage's upload; optional with its hash */
  upload?: string | null;
  position?: number;
  /** Name chosen by the client, to end it with */
  id?: string | null;
}

/** The complete state; the first message of every connection. */
export interface SessionHello {
  version: 1;
  type: "hello";
  session: SessionPublic;
  diagnostics: Record<string, unknown[]>;
}

/** Why a person's own filter cannot continue. */
export interface SessionProblem {
  file: string;
  /** Line of the fault, from 1; null if unknown */
  line: number | null;
  text: string;
}

/** The public view of a session: its description, its snapshot and its addresses. */
export interface SessionPublic {
  branch: string;
  /** Branch that is drawn together with the active one */
  second: string | null;
  recipe: Recipe;
  /** Tracker for the next frame */
  tracker: string;
  /** Parameters for the next frame */
  parameters: Record<string, boolean | number | string>;
  /** Why error bands of the next frame may be wrong, each in a sentence */
  doubts: Record<string, string>;
  timeline: ChangePublic[];
  thresholds: ThresholdPublic[];
  /** Number of restarts; each drops the past */
  restarts: number;
  /** The shown frame */
  position: number;
  /** Furthest frame computed */
  computed: number;
  /** Frame where a change branches off; null if it does not */
  branch_point: number | null;
  /** Last frame to compute, while it computes; a pause stops it */
  goal: number | null;
  /** Frame to show when the goal is reached */
  goal_position: number | null;
  playing: boolean;
  /** Times real time; 0 is as fast as possible */
  speed: number;
  /** Delay of the shown frame since it plays at this speed, s */
  behind_s: number;
  /** P(lost), 0 to 1, at which playing stops; null for never */
  stop_at: number | null;
  /** Why playing stopped by itself, a few words */
  stopped: string;
  /** Functions compiled so far, while it compiles */
  compiling: number | null;
  /** Fault in the filter file, if any */
  problem: SessionProblem | null;
  /** How well the target stands out from its surroundings, and since when */
  look: string;
  /** Measures of the branch so far, by name */
  measured: Record<string, number | null>;
  state: Phase;
  /** Why it is in this phase, if there is a reason */
  message: string | null;
  /** Name given by a person, or its clip, preset or experiment */
  name: string;
  /** Remark on the session, a sentence */
  remark: string | null;
  branches: BranchPublic[];
  bookmarks: Bookmark[];
  title: string;
  declarations: Declaration[];
  trackers: TrackerPublic[];
  layers: Layer[];
  worlds: World[];
  /** Parameters that the preset is about, to change first */
  about: string[];
  /** Its clip, or the preset that it began as; empty if it has neither */
  subject: string;
  unit: string;
  target: string;
  series: Series[];
  plots: Plot[];
  readings: Reading[];
  measures: MeasurePublic[];
  /** Name of the measure that decides success */
  success_measure: string;
  /** Kinds of files to export the run or the shown frame as */
  exports: FileKind[];
  /** Hint on where to look, if its preset has one */
  watch: string;
  /** Columns of a truth table; empty if no truth can be given */
  truth_columns: string[];
  /** How truth is marked in pictures; null if it cannot be */
  truth_mark: TruthMark | null;
  /** Parameters that can be fitted to the data, by tracker */
  fittable: Record<string, string[]>;
  width: number;
  height: number;
  frame_rate_hz: number;
  frames: number;
  id: string;
  speeds: number[];
  sweep: string | null;
  upload: string | null;
  created: string;
  page: string;
  thumbnail: string;
  viewer: string;
}

/** The changing part of a session: its run's, and the fields of the web process. */
export interface SessionSnapshot {
  branch: string;
  /** Branch that is drawn together with the active one */
  second: string | null;
  recipe: Recipe;
  /** Tracker for the next frame */
  tracker: string;
  /** Parameters for the next frame */
  parameters: Record<string, boolean | number | string>;
  /** Why error bands of the next frame may be wrong, each in a sentence */
  doubts: Record<string, string>;
  timeline: ChangePublic[];
  thresholds: ThresholdPublic[];
  /** Number of restarts; each drops the past */
  restarts: number;
  /** The shown frame */
  position: number;
  /** Furthest frame computed */
  computed: number;
  /** Frame where a change branches off; null if it does not */
  branch_point: number | null;
  /** Last frame to compute, while it computes; a pause stops it */
  goal: number | null;
  /** Frame to show when the goal is reached */
  goal_position: number | null;
  playing: boolean;
  /** Times real time; 0 is as fast as possible */
  speed: number;
  /** Delay of the shown frame since it plays at this speed, s */
  behind_s: number;
  /** P(lost), 0 to 1, at which playing stops; null for never */
  stop_at: number | null;
  /** Why playing stopped by itself, a few words */
  stopped: string;
  /** Functions compiled so far, while it compiles */
  compiling: number | null;
  /** Fault in the filter file, if any */
  problem: SessionProblem | null;
  /** How well the target stands out from its surroundings, and since when */
  look: string;
  /** Measures of the branch so far, by name */
  measured: Record<string, number | null>;
  state: Phase;
  /** Why it is in this phase, if there is a reason */
  message: string | null;
  /** Name given by a person, or its clip, preset or experiment */
  name: string;
  /** Remark on the session, a sentence */
  remark: string | null;
  branches: BranchPublic[];
  bookmarks: Bookmark[];
}

/** A session's new name. */
export interface SessionUpdate {
  /** New name; the name of its clip or preset if empty */
  name: string;
}

/** Play at a multiple of real time; 0 is as fast as possible. */
export interface SetSpeed {
  kind: "speed";
  speed: number;
}

/** A setting in which runs differ. */
export interface Setting {
  name: string;
  title: string;
  values: (string | null)[];
}

/** Show another branch. */
export interface ShowBranch {
  kind: "activate";
  branch: string;
}

/** The result of a search for a target in an upload. */
export interface SightingPublic {
  /** Frame where it was found, or the last searched frame */
  frame: number;
  /** The found target's mark; null if it was not found */
  mark: Record<string, unknown> | null;
  /** Handles of the mark placed by a model, not found in the picture */
  placed: string[];
  /** Points to check, or why nothing was found */
  remarks: string[];
  /** Number of searched frames */
  looked: number;
  /** Number of frames to search */
  of: number;
}

/** That a cause is at work. */
export interface Sign {
  since: number;
  strength: number;
  numbers: Record<string, number | null>;
  evidence: Evidence[];
  /** The cause. */
  cause: "sample-impoverishment" | "overconfident-weights" | "look-alike-capture" | "wrong-dynamics" | "occlusion-longer-than-memory" | "degenerate-resampling" | "mirror-pose" | "shrinking-covariance" | "template-drift" | "detector-seized-by-background" | "target-not-in-the-picture" | "uninformative-likelihood" | "changed-look" | "noisy-picture" | "nothing-to-measure" | "unclear";
  /** What the cause is called in a sentence. */
  title: string;
  /** The sentence with its numbers, as far as they are known. */
  words: string;
}

/** Code of a computation in two forms. */
export interface SourceCode {
  python: string;
  command: string;
}

/** The runs to write as source code: one, or several to compare. */
export interface SourceCodeRequest {
  runs: ComparedRun[];
  /** Frames per run */
  frames?: number | null;
}

/** One coordinate of the inspected state. */
export interface StateValue {
  name: string;
  unit: string;
  value: number | null;
}

/** Go one frame forward or back; at an end nothing happens. */
export interface Step {
  kind: "step" | "back";
}

/** Stop playing when the target is probably lost. */
export interface StopAt {
  kind: "stop_at";
  /** P(lost) at which playing stops; left out for never. On a recording any value stops it when a mark or the tracker itself reports a loss */
  probability?: number | null;
}

/** A judgement, before tracking, whether a target can be followed. */
export interface SuitabilityPublic {
  /** Suitability, 0 to 1, higher is better */
  value: number;
  /** Suitability in words */
  grade: "well" | "poorly" | "not at all" | "no verdict";
  /** Finding, a sentence */
  remark: string;
  /** Advice, a sentence each */
  advice: string[];
  /** A better mark of the same target; null if unknown */
  better: Record<string, unknown> | null;
  /** Likelihood over the picture as a data URL; null if unavailable */
  picture: string | null;
}

/** A varied parameter: from `start` to `stop` by `step`, both ends included, or over a list of values. */
export interface SweepAxis {
  name: string;
  start?: number | null;
  stop?: number | null;
  step?: number | null;
  values?: unknown[] | null;
}

/** A new sweep: an experiment over a grid of conditions. */
export interface SweepCreate {
  experiment: string;
  /** Title; made from the plan if it is not given. */
  title?: string | null;
  /** Axes; all values are combined. May be empty on a recording. */
  axes: SweepAxis[];
  /** Trackers; all get the same seeds. */
  trackers?: string[];
  trials?: number;
  /** Length of a run. */
  frames?: number | null;
  seed?: number;
  /** Whether to measure the probability of a loss, too. */
  loss_probability?: boolean;
  /** Parameters that differ from the defaults in every run. */
  parameters?: Record<string, unknown>;
  /** The recording of all runs; the simulated scene if not given. */
  footage?: FootageRequest | null;
  /** Name of the footage's upload; the footage's hash is enough, too. */
  upload?: string | null;
}

/** The complete state; the first message of every connection. */
export interface SweepHello {
  version: 1;
  type: "hello";
  sweep: SweepPublic;
  cells: CellsPublic;
}

/** A sweep. */
export interface SweepPublic {
  id: string;
  title: string;
  experiment: string;
  unit: string;
  judged: boolean;
  has_truth: boolean;
  axes: AxisPublic[];
  trackers: TrackerPublic[];
  measures: MeasurePublic[];
  trials: number;
  frames: number;
  recording: string | null;
  seed: number;
  loss_probability: boolean;
  parameters: Record<string, boolean | number | string>;
  fixed: AxisPublic[];
  runs: number;
  conditions: number;
  done: number;
  successes: number | null;
  problems: number;
  state: "running" | "stopped" | "done";
  message: string | null;
  rate: number | null;
  seconds: number;
  seconds_left: number | null;
  created: string;
  outcome: string;
  page: string;
}

/** The beginning of a table with unknown column names. */
export interface TableHead {
  /** Its first lines */
  text: string;
}

/** A word and what it means. */
export interface Term {
  name: string;
  meaning: string;
  also: string[];
}

/** A threshold of the tracker, with its changes over the run. */
export interface ThresholdPublic {
  name: string;
  of: string;
  steps: ThresholdStep[];
}

/** A threshold's value from a frame on; null while no tracker reads it. */
export interface ThresholdStep {
  frame: number;
  value: number | null;
}

/** One change with its share of runs that hold; the first changes nothing but the seed. */
export interface ToldFinding {
  kind: "seeds" | "particles" | "tracker" | "resampling" | "noise" | "sharpness" | "threshold" | "memory" | "world";
  title: string;
  values: Record<string, boolean | number | string>;
  parameter: string;
  holding: number;
  runs: number;
  share: number | null;
  low: number | null;
  high: number | null;
  holding_at_end: number;
  runs_to_end: number;
  shares: string;
  step_ms: number;
  corrected: number | null;
  verdict: "baseline" | "better" | "brief" | "worse" | "unclear" | "few";
  words: string;
  seed: number | null;
}

/** A preset that loses its target, explained to a first visitor. */
export interface Tour {
  begin: string;
  reason: string;
  plot: string;
  frame: number;
}

/** A tracker to choose. */
export interface TrackerPublic {
  id: string;
  title: string;
  /** It replays a recorded result; no seed or setting changes that */
  replays: boolean;
}

/** The kind of mark by which a person gives the truth of a picture. */
export interface TruthMark {
  editor: Editor;
  /** Paths in the mark of the values of the columns after the frame number */
  parts: string[];
}

/** Summary of an upload's truth. */
export interface TruthPublic {
  /** Number of frames with truth */
  frames: number;
  first: number;
  last: number;
  warnings: string[];
}

/** An upload and its content. */
export interface UploadPublic {
  id: string;
  name: string;
  kind: string;
  frames: number;
  width: number;
  height: number;
  frame_rate_hz: number;
  duration_s: number;
  sha256: string;
  warnings: string[];
  size_bytes: number;
  created: string;
}

/** The first values of a planned axis, and their number. */
export interface ValuesPublic {
  name: string;
  count: number;
  first: (boolean | number | string)[];
}

/** The verdict on a prediction. */
export interface VerdictPublic {
  right: boolean;
  given: number | string;
  exact: number | string;
  measured: number | null;
  /** Frame of the run that shows the answer, if there is a run */
  frame: number | null;
  /** The verdict and its reason, HTML */
  words: string[];
}

/** A direction from which to look at a world. */
export interface Viewpoint {
  name: string;
  title: string;
  azimuth_deg: number;
  elevation_deg: number;
}

/** A follower's answer, as an index in the list. */
export interface Vote {
  poll: string;
  answer: number;
}

/** Results of a search, newest of each kind first. */
export interface WorkPublic {
  sessions: SessionPublic[];
  runs: RunPublic[];
  comparisons: SavedComparisonPublic[];
  sweeps: SweepPublic[];
  uploads: UploadPublic[];
  /** Number of matches, including those beyond the limit */
  found: Record<string, number>;
  /** Number of all items */
  total: Record<string, number>;
}

/** A space with a unit, an extent, an upright axis and viewpoints. */
export interface World {
  name: string;
  title: string;
  unit: string;
  radius: number;
  middle: [number, number, number];
  up: [number, number, number];
  front: [number, number, number];
  viewpoints: Viewpoint[];
}

/** Each request's parameters and body, and its answer. */
export interface Requests {
  "GET experiments": { asked: {}; answer: ExperimentPublic[] };
  "GET plugins": { asked: {}; answer: Plugin[] };
  "GET experiments/{experiment}": { asked: { experiment: string; recording?: string | null }; answer: ExperimentDetail };
  "GET experiments/{experiment}/thumbnail.webp": { asked: { experiment: string }; answer: string };
  "GET glossary": { asked: {}; answer: Section[] };
  "GET filters": { asked: {}; answer: FilterPublic[] };
  "PUT filters/{name}": { asked: { name: string; body: FilterUpdate }; answer: FilterPublic };
  "GET compilation": { asked: {}; answer: CompilationPublic };
  "POST source-code": { asked: { body: SourceCodeRequest }; answer: SourceCode };
  "GET sweeps/{sweep}/source-code": { asked: { sweep: string }; answer: SourceCode };
  "POST uploads": { asked: { columns?: string | null; ticket?: string | null; body?: FormData }; answer: UploadPublic };
  "POST uploads/table": { asked: { body: TableHead }; answer: Preview };
  "GET uploads": { asked: {}; answer: UploadPublic[] };
  "GET uploads/{upload}": { asked: { upload: string }; answer: UploadPublic };
  "GET uploads/{upload}/frames/{frame}.jpg": { asked: { frame: number | string; upload: string }; answer: string };
  "GET uploads/{upload}/mark": { asked: { upload: string; frame: number | string; hint?: string | null; last?: number | string | null; looked?: number | string; experiment: string }; answer: SightingPublic };
  "GET uploads/{upload}/suitability": { asked: { upload: string; frame: number | string; mark: string; experiment: string }; answer: SuitabilityPublic };
  "PUT uploads/{upload}/truth": { asked: { upload: string; experiment: string; body?: FormData }; answer: TruthPublic };
  "GET uploads/{upload}/truth": { asked: { upload: string; experiment: string }; answer: TruthPublic | null };
  "GET uploads/{upload}/truth.csv": { asked: { upload: string; experiment: string }; answer: string };
  "DELETE uploads/{upload}/truth": { asked: { upload: string; experiment: string }; answer: null };
  "POST sessions": { asked: { body: SessionCreate }; answer: SessionPublic };
  "GET sessions": { asked: {}; answer: SessionPublic[] };
  "GET sessions/{session}": { asked: { session: string }; answer: SessionPublic };
  "PATCH sessions/{session}": { asked: { session: string; body: SessionUpdate }; answer: SessionPublic };
  "DELETE sessions/{session}": { asked: { session: string }; answer: null };
  "POST sessions/{session}/commands": { asked: { session: string; body: Play | Pause | Step | Seek | BeforeLoss | SetSpeed | StopAt | Restart | ChangeValues | MoveBelief | MakeBranch | ShowBranch | Inspect }; answer: SessionPublic | Changed | InspectionPublic };
  "POST sessions/{session}/resume": { asked: { session: string }; answer: SessionPublic };
  "GET sessions/{session}/diagnostics": { asked: { session: string; branch?: string | null }; answer: Columns };
  "PUT sessions/{session}/truth": { asked: { session: string; body?: FormData }; answer: TruthPublic };
  "GET sessions/{session}/explanation": { asked: { session: string; frame?: number | string | null; branch?: string | null }; answer: Explanation | null };
  "GET sessions/{session}/frame.png": { asked: { session: string }; answer: string };
  "GET sessions/{session}/thumbnail.png": { asked: { session: string }; answer: string };
  "POST sessions/{session}/bookmarks": { asked: { session: string; body?: BookmarkCreate | null }; answer: Bookmark };
  "DELETE sessions/{session}/bookmarks/{bookmark}": { asked: { bookmark: string; session: string }; answer: null };
  "GET jobs": { asked: {}; answer: (ExportJob | ImportJob | FitJob | ComparisonJob | ExplorationJob)[] };
  "GET jobs/{job}": { asked: { job: string }; answer: ExportJob | ImportJob | FitJob | ComparisonJob | ExplorationJob };
  "DELETE jobs/{job}": { asked: { job: string }; answer: null };
  "GET jobs/{job}/file": { asked: { job: string }; answer: null };
  "POST sessions/{session}/exports/{export}": { asked: { export: string; session: string; plot?: string | null }; answer: ExportJob };
  "POST sessions/{session}/fits": { asked: { session: string; body: FitCreate }; answer: FitJob };
  "POST sessions/{session}/explorations": { asked: { session: string; body: ExplorationCreate }; answer: ExplorationJob };
  "GET runs/{run}/exports": { asked: { run: string }; answer: ExportsPublic };
  "POST runs/{run}/exports/{export}": { asked: { export: string; run: string; plot?: string | null }; answer: ExportJob };
  "POST comparisons": { asked: { body: ComparisonCreate }; answer: ComparisonJob };
  "POST comparisons/exports/{export}": { asked: { export: string; body: ComparisonExportCreate }; answer: ExportJob };
  "GET queue/{ticket}": { asked: { ticket: string }; answer: QueuePublic };
  "POST runs": { asked: { body: RunCreate }; answer: RunPublic };
  "POST runs/import": { asked: { body?: FormData }; answer: ImportJob };
  "GET runs": { asked: {}; answer: RunPublic[] };
  "GET runs/{run}": { asked: { run: string }; answer: RunPublic };
  "PATCH runs/{run}": { asked: { run: string; body: NewTitle }; answer: RunPublic };
  "DELETE runs/{run}": { asked: { run: string }; answer: null };
  "GET runs/{run}/download": { asked: { run: string }; answer: string };
  "GET runs/{run}/thumbnail.png": { asked: { run: string }; answer: string };
  "POST runs/{run}/open": { asked: { run: string }; answer: SessionPublic };
  "POST comparisons/saved": { asked: { body: SavedComparisonCreate }; answer: SavedComparisonPublic };
  "GET comparisons/saved": { asked: {}; answer: SavedComparisonPublic[] };
  "GET comparisons/saved/{saved}": { asked: { saved: string }; answer: SavedComparisonDetail };
  "PATCH comparisons/saved/{saved}": { asked: { saved: string; body: NewTitle }; answer: SavedComparisonPublic };
  "DELETE comparisons/saved/{saved}": { asked: { saved: string }; answer: null };
  "GET work": { asked: { q?: string; show?: string | null; limit?: number | string; zone?: string }; answer: WorkPublic };
  "DELETE uploads/{upload}": { asked: { upload: string }; answer: null };
  "GET failures": { asked: {}; answer: FailurePublic[] };
  "GET failures/{failure}": { asked: { failure: string }; answer: FailurePublic };
  "GET failures/{failure}/course": { asked: { failure: string }; answer: FailureResult };
  "GET experiments/{experiment}/sweep": { asked: { experiment: string }; answer: SweepCreate };
  "POST sweeps/estimate": { asked: { body: EstimateRequest }; answer: EstimatePublic };
  "POST sweeps": { asked: { body: SweepCreate }; answer: SweepPublic };
  "GET sweeps": { asked: {}; answer: SweepPublic[] };
  "GET sweeps/{sweep}": { asked: { sweep: string }; answer: SweepPublic };
  "DELETE sweeps/{sweep}": { asked: { sweep: string }; answer: null };
  "POST sweeps/{sweep}/cancel": { asked: { sweep: string }; answer: SweepPublic };
  "POST sweeps/{sweep}/resume": { asked: { sweep: string }; answer: SweepPublic };
  "GET sweeps/{sweep}/cells": { asked: { sweep: string; x?: string | null; y?: string | null; first?: string | null; second?: string | null; measure?: string; test?: string; level?: number | string; correction?: string }; answer: CellsPublic };
  "GET sweeps/{sweep}/rows": { asked: { sweep: string; i?: number | string; j?: number | string; x?: string | null; y?: string | null; tracker?: string | null; offset?: number | string; limit?: number | string }; answer: RowsPublic };
  "POST sweeps/{sweep}/rows/{run}/open": { asked: { run: number | string; sweep: string; body?: OpenRequest | null }; answer: SessionPublic };
  "GET sweeps/{sweep}/download": { asked: { sweep: string; format?: string }; answer: string };
  "GET lessons": { asked: {}; answer: LessonsPublic };
  "GET lessons/{lesson}": { asked: { lesson: string }; answer: LessonDetail };
  "POST lessons/{lesson}/figure": { asked: { lesson: string; body: FigureRequest }; answer: FigurePublic };
  "POST lessons/{lesson}/answer": { asked: { lesson: string; body: AnswerRequest }; answer: VerdictPublic | ComputingPublic };
  "GET lessons/{lesson}/notebook.ipynb": { asked: { lesson: string }; answer: string };
  "GET lessons/{lesson}/checks": { asked: { lesson: string }; answer: ChecksPublic };
  "POST follows": { asked: { body: FollowCreate }; answer: FollowOwned };
  "GET follows": { asked: {}; answer: FollowOwned[] };
  "GET follows/{follow}": { asked: { follow: string }; answer: FollowOwned };
  "PATCH follows/{follow}": { asked: { follow: string; body: FollowUpdate }; answer: FollowOwned };
  "DELETE follows/{follow}": { asked: { follow: string }; answer: null };
  "GET follows/{follow}/qr.svg": { asked: { follow: string; link?: number | string }; answer: string };
  "POST follows/{follow}/figure": { asked: { follow: string; body: FigureRequest }; answer: FigurePublic };
  "PUT follows/{follow}/poll": { asked: { follow: string; body: PollCreateRequest }; answer: FollowOwned | ComputingPublic };
  "POST follows/{follow}/poll/reveal": { asked: { follow: string }; answer: FollowOwned };
  "DELETE follows/{follow}/poll": { asked: { follow: string }; answer: null };
  "GET follow": { asked: {}; answer: FollowPublic };
  "PUT follow/vote": { asked: { body: Vote }; answer: Vote };
  "POST follow/fork": { asked: { body: ForkCreate }; answer: ForkPublic };
  "DELETE follow/fork": { asked: {}; answer: null };
  "GET polls": { asked: { lecture?: string | null }; answer: PollKept[] };
  "GET polls/answers.csv": { asked: { lecture?: string | null }; answer: string };
  "DELETE polls/{poll}": { asked: { poll: string }; answer: null };
  "GET lectures": { asked: {}; answer: LectureSummary[] };
  "POST lectures": { asked: { body: LectureUpdate }; answer: LecturePublic };
  "POST lectures/import": { asked: { body: Blob }; answer: LecturePublic };
  "GET lectures/{lecture}": { asked: { lecture: string }; answer: LecturePublic };
  "PUT lectures/{lecture}": { asked: { lecture: string; body: LectureUpdate }; answer: LecturePublic };
  "DELETE lectures/{lecture}": { asked: { lecture: string }; answer: null };
  "GET lectures/{lecture}/file": { asked: { lecture: string }; answer: string };
  "WS sessions/{session}/stream": { asked: { session: string; paints?: boolean; has_picture?: boolean }; answer: null };
  "WS sweeps/{sweep}/stream": { asked: { sweep: string; x?: string | null; y?: string | null }; answer: null };
  "WS follows/{follow}/stream": { asked: { follow: string }; answer: null };
  "WS follow/stream": { asked: {}; answer: null };
}

/** A page's command to a session's run. */
export type Command = Play | Pause | Step | Seek | BeforeLoss | SetSpeed | StopAt | Restart | ChangeValues | MoveBelief | MakeBranch | ShowBranch | Inspect;

/** The answer to a command. */
export type CommandAnswer = SessionPublic | Changed | InspectionPublic;

/** A message of a session's stream. */
export type SessionMessage = Pong | Changes | SessionHello | Refused;

/** A message of a sweep's stream. */
export type SweepMessage = Cells | SweepHello | Progress;

/** A message of a follower's stream. */
export type FollowMessage = FigureShown | FollowNews;

/** A message of a lecturer's stream. */
export type OwnedMessage = OwnedNews;
