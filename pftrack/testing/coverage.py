"""Checks of bands: the truth lies in them as often as they say, or the experiment declares that it does not.

A band of 50 % should hold the truth in 45 to 55 % of the reports, one of 95 % in 92 to 98 %, and a region that promises
to hold it in all. What is further off than three standard errors, over seeds, must be declared
(`pftrack.core.model.band.Miscalibration`), with the direction in which it is: too narrow, if any of a band's
shares is; else too wide. A declaration that is needed no more must go.

The quick check looks at the first frames of a few runs of the default scene, where trackers still know how they began.
It finds what is gross. The thorough one has as many seeds as `SEEDS`, and the presets of the calibration as well.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from pftrack.core.model.band import ALL, HALF, MOST, Direction, Miscalibration
from pftrack.experiments.experiment import Experiment
from pftrack.runs.coverage import Coverage, count_held, measured_parameters, measured_run, pool_counts
from pftrack.testing.check import FRAMES, Check, demand, each_tracker

LIMITS: Mapping[float, tuple[float, float]] = {HALF: (0.45, 0.55), MOST: (0.92, 0.98), ALL: (1.0, 1.0)}
"""The least and the greatest share of the reports that counts as what a band says."""

SEEDS = range(40)
"""Of the thorough check."""

FEW = range(3)
SLACK = 0.25
"""Of the quick check, on top of three standard errors: the first frames are not like the others."""

SURELY, WELL = 3.0, 1.0
"""Standard errors: so far outside a share is for sure, and so far within it is well inside."""


def thorough_checks(experiment: Experiment) -> Iterator[Check]:
    """Yield checks over forty seeds of the default scene, and of the presets that the calibration names."""
    for tracker in experiment.trackers:
        for preset in ("", *experiment.quality.calibration.presets):
            name = f"bands of many runs hold the truth as often as they say ({tracker}, {preset or 'default'})"
            yield Check(name, partial(_demand, experiment, tracker, preset))


def judge(shares: Sequence[Coverage], slack: float = 0.0) -> Direction | None:
    """Return in which direction a band is surely off, by all of its shares; None if it is not for sure."""
    narrow, wide = False, False
    for one in shares:
        low, high = LIMITS[one.promised]
        margin = 0.0 if one.promised == ALL else SURELY * np.nan_to_num(one.error) + slack
        narrow |= one.share + margin < low
        wide |= one.share - margin > high
    return "overconfident" if narrow else "underconfident" if wide else None


def find_contradictions(
    faults: Sequence[Miscalibration], measured: Sequence[Coverage], *, slack: float = 0.0
) -> Iterator[str]:
    """Yield what was measured of the bands of a tracker and is declared otherwise, a clause each.

    Args:
        faults: What is declared of the tracker in this setting.
        measured: Of all its bands.
        slack: What else is allowed beside standard errors; with any, nothing is said of needless declarations.
    """
    bands: dict[str, list[Coverage]] = {}
    for one in measured:
        bands.setdefault(one.of, []).append(one)
    for of, shares in bands.items():
        declared = {fault.direction for fault in faults if not fault.bands or of in fault.bands}
        found = judge(shares, slack)
        if found is not None and found not in declared and not (declared and _is_excused(found, shares, slack)):
            yield f"the band of the {of} {_words(shares)}, which must be declared as {found}"
    for fault in faults if slack == 0.0 else ():
        about = [shares for of, shares in bands.items() if not fault.bands or of in fault.bands]
        if about and all(_is_well(one) for shares in about for one in shares):
            told = "; ".join(f"that of the {shares[0].of} {_words(shares)}" for shares in about)
            yield f"a band is declared as {fault.direction} and is not: {told}"


def _is_excused(found: Direction, shares: Sequence[Coverage], slack: float) -> bool:
    """Return whether a band may be found too wide that is declared as too narrow.

    Where some runs are lost, its smaller shares may be too wide and its larger ones too narrow, though not for sure;
    and no run is lost yet in the first frames.
    """
    return found == "underconfident" and (slack > 0.0 or any(one.share < one.promised for one in shares))


def _is_well(one: Coverage) -> bool:
    low, high = LIMITS[one.promised]
    margin = WELL * np.nan_to_num(one.error)
    return bool(low <= one.share - margin and one.share + margin <= high) or one.share == one.promised == ALL


def _words(shares: Sequence[Coverage]) -> str:
    told = [f"{100 * one.promised:.0f} % holds the truth in {100 * one.share:.1f} %" for one in shares]
    return f"of {' and that of '.join(told)} of the reports"


@each_tracker("bands hold the truth as often as they say")
def _few_runs_hold(experiment: Experiment, tracker: str) -> None:
    _demand(experiment, tracker, "", FEW, FRAMES, SLACK)


def declared_of(experiment: Experiment, tracker: str, preset: str) -> list[Miscalibration]:
    """Return what is declared of a tracker with the values of a preset, or in the default scene if it is empty."""
    parameters = measured_parameters(experiment, preset, SEEDS[0])
    return [fault for fault in experiment.quality.calibration.faults if fault.holds(tracker, parameters)]


def _demand(
    experiment: Experiment,
    tracker: str,
    preset: str,
    seeds: range = SEEDS,
    frames: int | None = None,
    slack: float = 0.0,
) -> None:
    counts = []
    for seed in seeds:
        run = measured_run(experiment, tracker, preset, seed, frames or experiment.quality.calibration.frames)
        run.finish()
        counts.append(count_held(run))
    declared = declared_of(experiment, tracker, preset)
    wrong = list(find_contradictions(declared, pool_counts(counts), slack=slack))
    demand(not wrong, f"{tracker}: {'; '.join(wrong)}")
