"""Comparisons: two trackers of a sweep against each other by one quantity, cell by cell.

The difference of the means is what a map shows. Both trackers met the same scenes, so that the difference within pairs
of runs, scene by scene, is known better than either mean; its interval says how well. The tests are those of Bando
2007, ch. 3 sections 3.1 and 3.2: of success by counts, of everything else by ranks.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.numerics.statistics import paired_mean_interval, paired_rate_interval, rank_sum
from pftrack.sweep.axis import SweepError
from pftrack.sweep.cells import (
    CONFIDENCE,
    CellMap,
    Correction,
    Quantity,
    Samples,
    Significance,
    Test,
    code_significance,
    significance,
)

UsedTest: TypeAlias = Literal["chi-square", "fisher", "rank-sum"]

TEST_TITLES: dict[UsedTest, str] = {"chi-square": "Chi-square", "fisher": "Fisher's exact", "rank-sum": "Rank-sum"}
"""What people call the tests; "test" follows."""


@dataclass(frozen=True)
class Paired:
    """Differences between runs on the same scenes; every array is (values of y, values of x).

    Attributes:
        mean: Positive where the first tracker is better; NaN where there is no pair.
        low: Lower end of its 95 % interval, NaN where that is not applicable.
        high: Upper end.
        pairs: How many scenes there are of which both runs have the quantity.
    """

    mean: Floats
    low: Floats
    high: Floats
    pairs: Ints


@dataclass(frozen=True)
class Comparison:
    """Two trackers by one quantity; every array is (values of y, values of x).

    Attributes:
        quantity: By what.
        first: Name of one tracker.
        second: Name of the other.
        difference: Of the means over the runs that have the quantity, positive where the first is better.
        paired: Of the runs on the same scenes.
        test: The one that was used.
        p_values: As tested; NaN where not applicable.
        effect: Difference of the success rates, or rank-biserial correlation; positive where the first is better.
    """

    quantity: Quantity
    first: str
    second: str
    difference: Floats
    paired: Paired
    test: UsedTest
    p_values: Floats
    effect: Floats

    def significance(self, level: float = 0.01, correction: Correction = "none") -> Significance:
        """Say in which cells one is better.

        Args:
            level: Of significance.
            correction: "holm" for the whole map at the level, "none" for every cell by itself.
        """
        return code_significance(self.p_values, self.effect, level=level, correction=correction)


def compare(
    quantity: Quantity,
    maps: Mapping[str, CellMap],
    samples: Samples,
    first: str,
    second: str,
    *,
    test: Test = "chi-square",
) -> Comparison:
    """Compare two trackers by a quantity.

    Success is tested by its counts. Everything else is tested by the rank-sum test, the error over successful runs
    alone, a measure over all runs that have it.

    Args:
        quantity: Of the sweep.
        maps: Cells of its trackers.
        samples: The quantity's, on the same axes.
        first: Name of one tracker.
        second: Name of the other.
        test: Of success: "chi-square" as in Bando 2007, "fisher" for small counts too.

    Raises:
        SweepError: The sweep has no such tracker.
    """
    for name in (first, second):
        if name not in maps:
            raise SweepError(f"the sweep has no tracker {name!r}; it has {', '.join(maps)}")
    difference = quantity.gain(quantity.means(maps[first]), quantity.means(maps[second]))
    paired = _pair(quantity, samples, first, second)
    if quantity.name == "success":
        counted = significance(maps[first], maps[second], test=test)
        return Comparison(quantity, first, second, difference, paired, test, counted.p_values, counted.effect)
    # The effect is positive where the first values are smaller.
    found = [rank_sum(*pair) for pair in zip(samples.values[first], samples.values[second], strict=True)]
    p_values, effect = (
        np.array([getattr(each, name) for each in found]).reshape(samples.shape)
        for name in ("p_value", "rank_biserial")
    )
    effect = -effect if quantity.better == "higher" else effect
    return Comparison(quantity, first, second, difference, paired, "rank-sum", p_values, effect)


def _pair(quantity: Quantity, samples: Samples, first: str, second: str) -> Paired:
    gains = [
        quantity.gain(one[in_one], other[in_other])
        for one, other, (_, in_one, in_other) in zip(
            samples.values[first],
            samples.values[second],
            map(_common, samples.scenes[first], samples.scenes[second]),
            strict=True,
        )
    ]
    pairs = np.array([len(each) for each in gains], dtype=np.int64)
    mean = np.array([each.mean() if len(each) else np.nan for each in gains])
    if quantity.name == "success":
        only_first, only_second = (np.array([int((sign * each > 0).sum()) for each in gains]) for sign in (1, -1))
        low, high = paired_rate_interval(only_first, only_second, pairs, CONFIDENCE)
    else:
        deviation = np.array([_deviation(each) for each in gains])
        low, high = paired_mean_interval(mean, deviation, pairs, CONFIDENCE)
    shape = samples.shape
    return Paired(mean.reshape(shape), low.reshape(shape), high.reshape(shape), pairs.reshape(shape))


def _deviation(values: Floats) -> float:
    if len(values) < 2:
        return np.nan
    # Differences of shares that are equal differ in their last digits.
    return 0.0 if np.allclose(values, values[0], rtol=1e-9, atol=1e-12) else float(values.std(ddof=1))


def _common(first: Ints, second: Ints) -> tuple[Ints, Ints, Ints]:
    """Return the numbers that two lists have in common, and where they are in each."""
    numbers, in_first, in_second = np.intersect1d(first, second, assume_unique=True, return_indices=True)
    return numbers, in_first, in_second
