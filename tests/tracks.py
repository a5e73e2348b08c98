"""A table of tracks of the simulated prism, for tests of whatever takes recordings."""

from functools import cache

import numpy as np

from pftrack.experiments import find
from pftrack.runs.run import Run
from pftrack.sources.tracks import write


@cache
def table(frames: int = 26) -> str:
    """The first frames of the prism's 14 points, in the long form."""
    experiment = find("structure")
    run = Run(experiment, experiment.simulate(), tracker="svd", frames=frames)
    measured = [step.frame.measurements for step in run]
    points = np.array([one.points_px for one in measured if one is not None])
    sd = np.array([one.sd_px for one in measured if one is not None])
    names = [f"p{number}" for number in range(points.shape[1])]
    return write(names, points, np.repeat(sd[..., None] ** 2, 2, axis=2))
