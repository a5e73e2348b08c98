"""The exact moments of a signal of one dimension by brute force: a grid over its two newest values.

The model is of second order, x_t = 2 x_{t-1} - x_{t-2} + b u, so the belief is a density over pairs (x_t, x_{t-1}), and
a step is one sum over x_{t-2} for each pair. The likelihood is the experiment's own, and may be of any form.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.exercises.submission import Submission
from pftrack.model.source import History
from pftrack.numerics.random import Purpose, Stream

__all__ = ["moments_on_grid"]

CELLS = 121
REACH = 7.0
"""Of the grid on either side of the values that were seen, in standard deviations of what they are off the exact mean."""


def moments_on_grid(submission: Submission, seed: int, *, noise: str) -> tuple[float, float]:
    """Return mean and standard deviation of the newest value in the last frame, given all frames.

    Args:
        submission: Its exercise says what scene; it must begin in one known place.
        seed: Of the scene.
        noise: Name of the parameter with the standard deviation b of the motion's noise.
    """
    interface, setup = submission.interface, submission.setup
    parameters = setup.parameters
    source, history = setup.open_source(seed, parameters), History(((0, parameters),))
    first = source.frame(0, history)
    state = interface.start(source.start, first, parameters, Stream(seed, 0, Purpose.START))
    known = interface.particles(state, parameters, Stream(seed, 0, Purpose.START)).states
    if known.shape[1] != 2 or np.ptp(known, axis=0).any():
        raise ValueError("a grid takes a signal of one dimension that begins in a place which is known")
    newest, before = (float(value) for value in known[0])
    sd = float(getattr(parameters, noise))
    frames = [source.frame(index, history) for index in range(1, submission.exercise.frames)]
    centre, reach = _reach(newest, before, sd, len(frames))
    values = np.linspace(centre - reach, centre + reach, CELLS)
    moves = np.exp(-0.5 * ((values[:, None, None] - 2 * values[None, :, None] + values[None, None, :]) / sd) ** 2)

    def weigh(frame: object) -> NDArray[np.float64]:
        logs = interface.log_likelihood(state, np.stack([values, values], axis=1), frame, parameters)  # type: ignore[arg-type] # a frame
        return np.asarray(np.exp(logs - logs.max()))

    alone = np.exp(-0.5 * ((values - 2 * newest + before) / sd) ** 2) * weigh(frames[0])
    joint = alone[:, None]
    for number, frame in enumerate(frames[1:]):
        if number == 0:  # the value before the first is known
            step = np.exp(-0.5 * ((values[:, None] - 2 * values[None, :] + newest) / sd) ** 2)
            joint = step * alone[None, :] * weigh(frame)[:, None]
        else:
            joint = np.einsum("xyz,yz->xy", moves, joint) * weigh(frame)[:, None]
        joint /= joint.sum()
    density = joint.sum(axis=1) / joint.sum()
    mean = float(density @ values)
    return mean, float(np.sqrt(density @ (values - mean) ** 2))


def _reach(newest: float, before: float, sd: float, steps: int) -> tuple[float, float]:
    """Return the middle of the grid and how far it goes: REACH deviations of what the motion alone may come to."""
    spread = sd * float(np.sqrt(np.sum(np.arange(1, steps + 1) ** 2)))
    return newest + 0.5 * steps * (newest - before), REACH * spread + 0.5 * steps * abs(newest - before)
