"""The numbers of every tracker of every experiment, as hashes; `python tests/same_bits.py` prints them.

`tests/data/same_bits.json` holds what this printed. It is made again only when numbers are meant to change or a
tracker is added, and the changelog reports a change:

    python tests/same_bits.py > tests/data/same_bits.json
"""

import hashlib
import json
import os
import sys
from collections.abc import Iterator

import pftrack

if __name__ == "__main__" and "COMPILE_FOR" in os.environ:
    # What `import pftrack` has settled is undone, to see whether numbers depend on it.
    name, _, features = os.environ["COMPILE_FOR"].partition(" ")
    os.environ |= {"NUMBA_CPU_NAME": name, "NUMBA_CPU_FEATURES": features}

import numpy as np

from pftrack.core.model.parameters import Value, declarations
from pftrack.core.model.recipe import Change
from pftrack.experiments import EXPERIMENTS
from pftrack.experiments.experiment import Experiment
from pftrack.runs.run import Run

FRAMES, FEW, SEED = 12, 6, 3
"""Frames of default trackers with their defaults, and of all else; the seed of all."""

LATE = {"face_model", "frozen", "learn_dynamics", "model_frozen"}
"""Switches and choices that show in more frames only."""


def cases(experiment: Experiment) -> Iterator[tuple[str, dict[str, Value]]]:
    """Every tracker with its defaults, and every switch and choice with a tracker that reads it."""
    yield from ((tracker, {}) for tracker in experiment.trackers)
    for item in declarations(type(experiment.simulate().parameters)):
        others: tuple[Value, ...] = item.choices if item.kind == "choice" else ()
        if item.kind == "boolean":
            others = (not item.default,)
        trackers = item.trackers[:1] or (experiment.default_tracker,)
        for value in others:
            if value != item.default:
                more = {"warm_up_frames": 2} if item.name == "learn_dynamics" else {}
                yield trackers[0], {item.name: value, **more}


def digest(experiment: Experiment, tracker: str, values: dict[str, Value]) -> str:
    """Hash everything that a run computes: frames, estimates, deviations, evidence and particles."""
    timeline = (Change(0, values),) if values else ()
    frames = FRAMES if tracker == experiment.default_tracker else FEW
    frames = FEW if values and not LATE & values.keys() else max(frames, experiment.warm_frames)
    run = Run(experiment, experiment.simulate(), tracker=tracker, seed=SEED, frames=frames, timeline=timeline)
    seen = hashlib.sha256()
    for step in run:
        frame, state = step.frame, step.state
        arrays = [frame.image_rgb, frame.signal, state.estimate, state.sigma, np.array(state.log_evidence)]
        if frame.measurements is not None:
            arrays.append(frame.measurements.points_px)
        for array in (*arrays, *(array for _, array in sorted(state.arrays().items()))):
            if array is not None:
                seen.update(np.ascontiguousarray(array).tobytes())
    return seen.hexdigest()[:16]


def hashes() -> dict[str, str]:
    """The hash of every case of the project's own experiments."""
    return {
        " ".join([name, tracker, *(f"{key}={value}" for key, value in values.items())]): digest(
            EXPERIMENTS[name], tracker, values
        )
        for name in EXPERIMENTS.own
        for tracker, values in cases(EXPERIMENTS[name])
    }


if __name__ == "__main__":
    assert pftrack.__version__
    json.dump(hashes(), sys.stdout, indent=1)
    sys.stdout.write("\n")
