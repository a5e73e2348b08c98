"""Coverage: how often the bands of a tracker hold the truth, over many runs.

The frames of one run are alike: where the truth is outside of a band, it is likely to be outside of the next one too.
So the standard error treats each run as one observation, which is the estimator of a ratio over clusters.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from pftrack.core.model.parameters import Parameters, Value, revise
from pftrack.experiments.experiment import Experiment
from pftrack.runs.run import Change, Run

__all__ = ["Counts", "Coverage", "count_held", "measured_parameters", "measured_run", "pool_counts"]

Counts: TypeAlias = Mapping[str, Mapping[float, tuple[int, int]]]
"""Of one run: how many numbers a band has held, and how many there were, by what it is about and by its share."""


@dataclass(frozen=True, slots=True)
class Coverage:
    """How often one band has held the truth.

    Attributes:
        of: What the band is about.
        promised: The share of the reports in which it says that it holds it.
        share: In which it held it.
        error: Standard error of that, with each run as one observation.
        runs: How many runs there were.
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
    chosen = dict(next(one.parameters for one in experiment.presets if one.name == preset)) if preset else {}
    scene = experiment.calibration.scene
    if scene:
        chosen[scene] = int(chosen.get(scene, getattr(defaults, scene))) + seed
    return chosen


def measured_run(experiment: Experiment, tracker: str, preset: str, seed: int, frames: int) -> Run:
    """Return the run of which the bands are looked at, at its frame 0.

    Args:
        experiment: The wiring.
        tracker: Name of the tracker.
        preset: Name of the preset whose parameters are in force; empty for the default scene.
        seed: Of the run; it chooses the scene too, where scenes have a number.
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
        for band in run.experiment.calibration.bands:
            if not band.trackers or tracker in band.trackers:
                known = counts.setdefault(band.of, {})
                for share, held in band.held(row).items():
                    before = known.get(share, (0, 0))
                    known[share] = before[0] + int(np.count_nonzero(held)), before[1] + len(held)
    return counts


def pool_counts(runs: Iterable[Counts]) -> tuple[Coverage, ...]:
    """Return the coverage of each band over runs; a band of which nothing is known is left out."""
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
