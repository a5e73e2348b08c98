"""The exact moments of a signal of one dimension by brute force: a grid over its two newest values.

The model is of second order, x_t = 2 x_{t-1} - x_{t-2} + b u, so the belief is a density over pairs (x_t, x_{t-1}), and
a step is one sum over x_{t-2} for each pair. The values of each frame have a grid of their own, around their
prediction. The likelihood is the experiment's, and may be of any form.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.source import History
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.teaching.exercises.submission import Submission

__all__ = ["moments_on_grid"]

CELLS = 81
REACH = 6.0
"""Of a grid on either side of the predicted mean, in standard deviations of the prediction."""


def moments_on_grid(submission: Submission, seed: int, *, noise: str) -> tuple[float, float]:
    """Return mean and standard deviation of the newest value in the last frame, given all frames.

    Args:
        submission: Its exercise says what scene; it must begin in one known place.
        seed: Of the scene.
        noise: Name of the parameter with the standard deviation b of the motion's noise.

    Raises:
        ValueError: The signal has more dimensions, or begins in a place that is not known.
    """
    interface, parameters = submission.interface, submission.setup.parameters
    source, history = submission.setup.open_source(seed, parameters), History(((0, parameters),))
    first = source.frame(0, history)
    state = interface.start(source.start, first, parameters, Stream(seed, 0, Purpose.START))
    known = interface.particles(state, parameters, Stream(seed, 0, Purpose.START)).states
    if known.shape[1] != 2 or np.ptp(known, axis=0).any():
        raise ValueError("a grid takes a signal of one dimension that begins in a place which is known")
    sd = float(getattr(parameters, noise))
    newest, before = known[:1, 0], known[:1, 1]
    joint = np.ones((1, 1))
    for index in range(1, submission.exercise.frames):
        values = _grid(joint, newest, before, sd)
        means = 2.0 * newest[:, None] - before[None, :]
        moves = np.exp(-0.5 * ((values[:, None, None] - means[None]) / sd) ** 2)
        moved = np.einsum("xyz,yz->xy", moves, joint)
        states = np.stack([values, values], axis=1)
        logs = interface.likelihood.log_likelihood(state, states, source.frame(index, history), parameters)
        joint = moved * np.exp(logs - logs.max())[:, None]
        joint /= joint.sum()
        newest, before = values, newest
    density = joint.sum(axis=1)
    mean = float(density @ newest)
    return mean, float(np.sqrt(density @ (newest - mean) ** 2))


def _grid(
    joint: NDArray[np.float64], newest: NDArray[np.float64], before: NDArray[np.float64], sd: float
) -> NDArray[np.float64]:
    """Return the values (CELLS,) of a frame, around what is predicted from the joint density of the two before."""
    moved = 2.0 * newest[:, None] - before[None, :]
    mean = float(np.sum(joint * moved))
    reach = REACH * float(np.sqrt(np.sum(joint * (moved - mean) ** 2) + sd**2))
    return np.linspace(mean - reach, mean + reach, CELLS)
