"""Properties: what a file should do, each a function that looks and returns a verdict.

Those of single functions call these with arrays made for it; those of a filter compare runs with an exact answer, with
another tracker, or with the truth. `weights` has those of weights, of resampling and of a whole tracker, `exact` those
with an exact answer and those of how functions go about it; `PROPERTIES` has all by name, with their options.
"""

from collections.abc import Mapping

from pftrack.teaching.exercises.properties import exact, weights
from pftrack.teaching.exercises.properties.weights import Option, Property

__all__ = ["PROPERTIES", "Option", "Property"]

PROPERTIES: Mapping[str, Property] = {
    each.name: each
    for each in (
        Property(
            "keeps-count",
            "Resampling returns as many parents as are asked for, and none of weight zero",
            weights.keeps_count,
            {"draws": 20},
        ),
        Property(
            "unbiased",
            "Resampling is unbiased",
            weights.unbiased,
            {"draws": 3000},
            "Bernstein's bound for sums of 0-or-1 numbers: a right solution fails with a probability below 1e-6.",
        ),
        Property(
            "even",
            "Each particle has N times its weight children, rounded up or down",
            weights.even,
            {"draws": 100},
        ),
        Property(
            "threshold",
            "Parents are drawn just when the effective sample size is too low",
            weights.threshold,
            {"share": 0.5, "cases": 60},
        ),
        Property(
            "distribution",
            "Weights are a distribution, also for -inf and ties",
            weights.distribution,
            margin="Rounding, 1e-9.",
        ),
        Property(
            "evidence",
            "The log evidence is the exact filter's",
            exact.evidence,
            {"exact": "", "runs": 30, "most_spread": 0.6},
            "Student's t over the runs at 1e-6, and the variance of a run for the bias of a logarithm.",
        ),
        Property(
            "moments",
            "Mean and standard deviation are a grid's",
            exact.moments,
            {"noise": "", "runs": 16, "most_spread": 0.4, "rounding": 0.03},
            "Student's t over the runs at 1e-6, and 0.03 for the bias of finitely many particles.",
        ),
        Property(
            "steadier",
            "The log evidence scatters less than without looking ahead",
            exact.steadier,
            {"exact": "", "than": "", "runs": 60, "most": 0.6},
            "The ratio of two deviations over 60 runs is known to 13 %; a right solution has 0.25, 0.6 is due.",
        ),
        Property(
            "held",
            "The target is held",
            weights.held,
            {"runs": 20, "needed": 19, "largest_error": 0.0},
            "Two of 20 runs have to fail; the page on exercises says how seldom a right solution loses one.",
        ),
        Property(
            "linear",
            "The cost grows linearly",
            exact.linear,
            {"small": 500, "large": 32_000, "most_exponent": 1.5},
            "Processor time, the least of seven calls; one that seems too long is measured three times.",
        ),
        Property("unchanged", "Nothing is mutated", exact.unchanged),
        Property("replays", "It replays: all randomness is that of the seed", exact.replays),
    )
}
