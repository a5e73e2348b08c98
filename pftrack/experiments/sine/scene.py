"""One-dimensional signals in noise: the sine and cosine of Bando 2007, ch. 2 sections 2 and 3.

The truth turns once in 360 frames; what is seen is the truth plus white noise. Several dimensions are independent
copies of the same signal with noise of their own, which is how Bando shows what dimension costs a particle
filter.
"""

from typing import Literal

import numpy as np

from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.source import Frame, History, Target
from pftrack.core.numerics.random import Purpose, Stream

GROUP = "Signal"


class SignalParameters(Parameters, group=GROUP):
    """The signal and its noise."""

    waveform: Literal["sine", "cosine"] = parameter("cosine", "Waveform", "The true signal.", live=False)
    dimension: int = parameter(
        1, "Dimension", "How many independent copies of the signal are tracked together.", within=(1, 10, 1), live=False
    )
    observation_noise_sd: float = parameter(
        0.1,
        "Observation noise",
        "Standard deviation of the noise on what is seen.",
        within=(0.001, 10, 0.01),
        useful=(0.01, 1),
        role="world",
    )


class SignalSource:
    """Endless samples of the signal.

    Attributes:
        size: Width and height that a drawing of the signal takes, px.
        frame_rate_hz: Frames a second.
        frame_count: None; the signal never ends.
        start: The true value at frame 0.
    """

    frame_rate_hz = 60.0
    period_frames = 360

    def __init__(self, seed: int, parameters: SignalParameters) -> None:
        """Set the signal up; the seed is that of the observation noise."""
        self._seed = seed
        self.size = (720, 400)
        self.frame_count: int | None = None
        self.start = self._target(0, parameters)
        self.noisy = True

    def frame(self, index: int, history: History[SignalParameters]) -> Frame:
        """Return what is seen at an instant; the same arguments give the same frame, to the bit."""
        parameters = history.at(index)
        target = self._target(index, parameters)
        noise = Stream(self._seed, index, Purpose.SCENE).standard_normal(parameters.dimension)
        return Frame(
            index,
            index / self.frame_rate_hz,
            signal=target.position + parameters.observation_noise_sd * noise,
            target=target,
        )

    def _target(self, index: int, parameters: SignalParameters) -> Target:
        angle = 2 * np.pi * index / self.period_frames
        value = np.sin(angle) if parameters.waveform == "sine" else np.cos(angle)
        return Target(np.full(parameters.dimension, value), hidden=None)
