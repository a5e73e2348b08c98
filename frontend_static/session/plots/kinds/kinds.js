/** The kinds of plots that an experiment can declare. */

import { BandPlot, IntervalPlot } from "./band.js";
import { ErrorPlot, InnovationPlot, SampleSizePlot, SigmaPlot, ValuePlot } from "./curve.js";
import { FeaturesPlot } from "./features.js";
import { FrequencyPlot } from "./frequency.js";
import { HypothesesPlot } from "./hypotheses.js";
import { SamplersPlot } from "./samplers.js";
import { TreePlot } from "./tree.js";

/** Those that draw a line for each branch, and so for each of several runs. */
export const OVERLAID = /** @type {readonly string[]} */ (["error", "sigma", "sample size", "innovation", "value", "band", "frequency"]);

export const KINDS = {
  error: ErrorPlot,
  sigma: SigmaPlot,
  "sample size": SampleSizePlot,
  samplers: SamplersPlot,
  innovation: InnovationPlot,
  value: ValuePlot,
  band: BandPlot,
  interval: IntervalPlot,
  features: FeaturesPlot,
  frequency: FrequencyPlot,
  hypotheses: HypothesesPlot,
  tree: TreePlot,
};
