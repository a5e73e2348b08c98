"""Coverage: how often the bands of a tracker hold the truth, over many runs.

The frames of one run are alike: where the truth is outside of a band, it is likely to be outside of the next one too.
So the standard error treats each run as one observation, which is the estimator of a ratio over clusters.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from pftrack.core.model.band import EstimateBand
from pftrack.core.model.parameters import Parameters, Value, revise
from pftrack.core.model.recipe import Change
from pftrack.core.numerics.statistics import chi_square_limit
from pftrack.experiments.experiment import Experiment
from pftrack.runs.run import Run

Counts: TypeAlias = Mapping[str, Mapping[float, tuple[int, int]]]
"""Counts of one run: numbers held by a band, and all numbers, by the band's subject and share."""


@dataclass(frozen=True, slots=True)
class Coverage:
    """Share of the reports in which one band held the truth.

    Attributes:
        of: The band's subject.
        promised: Its nominal share of the reports.
        share: Its measured share.
        error: Standard error of that, with each run as one observation.
        runs: Number of runs.
    """

    of: str
    promised: float
    share: float
    error: float
    runs: int


def measured_parameters(experiment: Experiment, preset: str, seed: int) -> Any:  # noqa: ANN401 - the experiment's own model
    """Return the parameters that are in force in a run of `measured_run`."""
    defaults = experiment.simulate().parameters
    return revise(defaults, _chosen(experiment, preset, seed, defaults))


def _chosen(experiment: Experiment, preset: str, seed: int, defaults: Parameters) -> dict[str, Value]:
    chosen = dict(experiment.preset_named(preset).parameters) if preset else {}
    scene = experiment.quality.calibration.scene
    if scene:
        chosen[scene] = int(chosen.get(scene, getattr(defaults, scene))) + seed
    return chosen


def measured_run(experiment: Experiment, tracker: str, preset: str, seed: int, frames: int) -> Run:
    """Return the run for measuring bands, at its frame 0.

    Args:
        experiment: The wiring.
        tracker: Name of the tracker.
        preset: Name of the preset whose parameters are in force; empty for the default scene.
        seed: Seed of the run; it also chooses the scene, where scenes have a number.
        frames: Length at most.
    """
    setup = experiment.simulate()
    chosen = _chosen(experiment, preset, seed, setup.parameters)
    parameters = revise(setup.parameters, chosen)
    longest = setup.open_source(seed, parameters).frame_count or experiment.frames
    timeline = (Change(0, chosen),) if chosen else ()
    return Run(experiment, setup, tracker=tracker, seed=seed, frames=min(frames, longest), timeline=timeline)


def count_held(run: Run, first: int = 1, end: int | None = None) -> Counts:
    """Return how often each band has held the truth in some frames of a run, lost ones included.

    Args:
        run: The run.
        first: The first frame that counts.
        end: The frame after the last; after all that were computed if not given.
    """
    counts: dict[str, dict[float, tuple[int, int]]] = {}
    for row in run.diagnostics[first:end]:
        tracker = run.tracker_at(row.frame)
        for band in run.experiment.quality.calibration.bands:
            if not band.trackers or tracker in band.trackers:
                known = counts.setdefault(band.of, {})
                for share, held in band.held(row).items():
                    before = known.get(share, (0, 0))
                    known[share] = before[0] + int(np.count_nonzero(held)), before[1] + len(held)
    return counts


def pool_counts(runs: Iterable[Counts]) -> tuple[Coverage, ...]:
    """Return the coverage of each band over runs; bands without data are left out."""
    found: dict[tuple[str, float], list[tuple[int, int]]] = {}
    for counts in runs:
        for of, shares in counts.items():
            for share, counted in shares.items():
                if counted[1] > 0:
                    found.setdefault((of, share), []).append(counted)
    return tuple(_pool(of, share, pairs) for (of, share), pairs in found.items())


def _pool(of: str, promised: float, pairs: Sequence[tuple[int, int]]) -> Coverage:
    held, total = np.array(pairs, dtype=np.float64).T
    share = float(held.sum() / total.sum())
    runs = len(pairs)
    spread = float(np.square(held - share * total).sum())
    error = float(np.sqrt(spread * runs / (runs - 1)) / total.sum()) if runs > 1 else float("nan")
    return Coverage(of, promised, share, error, runs)


# The squares of a filter's errors in its own standard deviations show whether it is consistent.
#
# - NEES, the normalised estimation error squared, compares the estimate with the truth, where that is known;
# - NIS, the normalised innovation squared, compares each measurement with its prediction, and does not need the truth.
#
# Both are given per number, so each is 1 on average for a consistent filter: above 1 it is overconfident, below 1
# underconfident. Innovations of a right filter are independent, so the mean NIS has limits, from the chi-square
# distribution of the sum. Errors of the estimate in frames in a row are alike, so a mean NEES of one run has none
# (Bar-Shalom, Li, Kirubarajan 2001, section 5.4).

LIMIT_DIGITS = 6
"""The last digits of a quantile hang on the library that computes it."""


@dataclass(frozen=True, slots=True)
class Consistency:
    """Squared errors in the filter's own standard deviations.

    Attributes:
        nees: Mean over frames and coordinates; None where no truth is known, or the estimate has no deviation.
        nis: Mean over all numbers that were measured; None for a tracker without innovations.
        nis_limits: Between which the mean NIS of a right filter is with a probability of 95 %; None without.
    """

    nees: float | None = None
    nis: float | None = None
    nis_limits: tuple[float, float] | None = None


def measure_consistency(runs: Sequence[Run], first: int = 1, end: int | None = None) -> Consistency:
    """Return how consistent some frames of several runs are.

    Args:
        runs: Runs of the same recording and settings with other random numbers.
        first: The first frame that counts.
        end: The frame after the last; after all that were computed if not given.
    """
    squares = [square for run in runs for square in _squared_errors(run, first, end)]
    nees = float(np.mean(squares)) if squares else None
    innovations = [_sum_innovations(run, first, end) for run in runs]
    # Runs of the same recording share the measurements, so together they are no more informative than one.
    freedom = round(float(np.mean([count for _, count in innovations]))) if innovations else 0
    if freedom < 1:
        return Consistency(nees)
    low, high = (round(chi_square_limit(freedom, level) / freedom, LIMIT_DIGITS) for level in (0.025, 0.975))
    return Consistency(nees, float(np.mean([total for total, _ in innovations])) / freedom, (low, high))


def _squared_errors(run: Run, first: int, end: int | None) -> list[float]:
    """Return the square of each coordinate's error in its deviations, where both are known."""
    bands = [band for band in run.experiment.quality.calibration.bands if isinstance(band, EstimateBand)]
    found: list[float] = []
    for row in run.diagnostics[first:end]:
        tracker = run.tracker_at(row.frame)
        if row.truth is None or not any(not band.trackers or tracker in band.trackers for band in bands):
            continue
        for estimate, sigma, truth in zip(row.estimate, row.sigma, row.truth, strict=False):
            square = ((estimate - truth) / sigma) ** 2 if sigma > 0 else np.nan
            if np.isfinite(square):
                found.append(square)
    return found


def _sum_innovations(run: Run, first: int, end: int | None) -> tuple[float, float]:
    """Return the sum of the normalised innovations squared, and of their degrees of freedom."""
    total = count = 0.0
    for row in run.diagnostics[first:end]:
        known = {series.role: series.name for series in run.experiment.trackers[run.tracker_at(row.frame)].series}
        if "nis" in known and "nis_freedom" in known:
            squared, freedom = row.number(known["nis"]), row.number(known["nis_freedom"])
            if np.isfinite(squared) and freedom > 0:
                total, count = total + squared, count + freedom
    return total, count
