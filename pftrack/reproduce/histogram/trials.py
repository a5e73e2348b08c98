"""Runs on one scene: who holds the target in the end, and how far off the estimate is while the target is seen."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.source import History
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments import find
from pftrack.experiments.histogram.scene import LawnSource, visible_share

FRAMES, LAST, LOST_PX, SEEN = 120, 10, 14.0, 0.7
"""A success is within 14 px in each of the last 10 frames; errors are taken where 70 % of the target are seen."""


SETTINGS: Mapping[str, Value] = MappingProxyType(
    {
        "look_alike_red": 0.68,
        "occlusion_width_px": 46,
        "occlusion_offset_px": 69,
        "column_colours": "lawn",
        "lighting_amplitude": 0.08,
        "image_noise_sd": 4,
        "sample_count": 300,
        "apf_weights": "sharpened",
        "resampling": "systematic",
        "resampling_threshold": 1,
        "process_noise_px": 1.5,
        "velocity_noise_px": 0.3,
        "initial_velocity_px": 1,
        "search_reach_px": 8,
        "window_width_px": 25,
        "window_height_px": 33,
    }
)
"""What the reference's protocol says besides the lecture's settings; nothing is left to defaults, which may change."""


@dataclass(frozen=True)
class Case:
    """A condition.

    Attributes:
        scene: Number of the scene.
        tracker: Name of the tracker.
        values: Of parameters that differ from `lecture` and `SETTINGS`.
        count: Runs, with the seeds from 0 on.
    """

    scene: int
    tracker: str
    values: Mapping[str, Value]
    count: int


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of the runs of a case.

    Attributes:
        success: Share of the runs that end on the target.
        error_px: Median over the runs of the mean error while the target is seen.
    """

    success: float
    error_px: float


def lecture() -> Mapping[str, Value]:
    """Return the lecture's settings, which are those of the preset of that name."""
    return next(preset.parameters for preset in find("histogram").presets if preset.name == "lecture")


def runs(case: Case) -> Outcome:
    """Carry out the runs of a case."""
    experiment = find("histogram")
    parameters: Any = revise(
        experiment.simulate().parameters, {**lecture(), **SETTINGS, "scene_number": case.scene, **case.values}
    )
    history = History(((0, parameters),))
    source = LawnSource(0, parameters)
    frames = [source.frame(index, history) for index in range(FRAMES)]
    seen = np.array([visible_share(index, parameters) >= SEEN for index in range(FRAMES)])
    pictures = np.array([frame.image_rgb for frame in frames[1:]])
    truths = np.array([frame.target.position for frame in frames if frame.target])
    tracker = experiment.trackers[case.tracker]
    held, errors = [], []
    for seed in range(case.count):
        state = tracker.start(source.start, frames[0], parameters, Stream(seed, 0, Purpose.START))
        estimates = [state.estimate]
        folded = tracker.fold and tracker.fold(state, pictures, parameters, seed, 1)
        if folded:
            estimates.extend(folded.estimates)
        for frame in () if folded else frames[1:]:
            state = tracker.step(state, frame, parameters, Stream(seed, frame.index, Purpose.TRACK))
            estimates.append(state.estimate)
        off = np.array(estimates) - truths
        distances = np.hypot(off[:, 0], off[:, 1])
        held.append(bool((distances[-LAST:] < LOST_PX).all()))
        errors.append(distances[seen].mean())
    return Outcome(float(np.mean(held)), float(np.median(errors)))
