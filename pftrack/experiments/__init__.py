"""Experiments: source, tracker, parameters, drawing and measure wired together under a name.

Each experiment is a package here and an entry of the registry below; everything else (command line, server, sweeps)
finds it through `find`.

- `ball`: switching particle filters on a ball behind an occluder (document 1, ch. 3);
- `head`: the pose of a head by its features, simulated or on a recording (document 1, ch. 4);
- `prism`: a solid's pose by adaptive sampling of its corners (document 1, ch. 4);
- `sine`: the Kalman filter beside the particle filter on a signal in noise (document 1, ch. 2).
"""

from pftrack.experiment import Experiment, Preset, Setup, Step
from pftrack.experiments.ball.experiment import EXPERIMENT as BALL
from pftrack.experiments.head.experiment import EXPERIMENT as HEAD
from pftrack.experiments.prism.experiment import EXPERIMENT as PRISM
from pftrack.experiments.sine.experiment import EXPERIMENT as SINE
from pftrack.plot import Plot, Reading

__all__ = ["EXPERIMENTS", "Experiment", "Plot", "Preset", "Reading", "Setup", "Step", "find"]

EXPERIMENTS: dict[str, Experiment] = {experiment.id: experiment for experiment in (BALL, HEAD, PRISM, SINE)}
"""All experiments by name, in the order in which they are shown."""


def find(experiment_id: str) -> Experiment:
    """Return an experiment by name.

    Raises:
        LookupError: There is none of that name; the sentence lists those that there are.
    """
    if experiment_id not in EXPERIMENTS:
        raise LookupError(f"there is no experiment {experiment_id!r}; there are {', '.join(EXPERIMENTS)}")
    return EXPERIMENTS[experiment_id]
