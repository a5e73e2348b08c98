"""What an experiment tells a filter that a person writes in a file, and what takes over what the file leaves out."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame, Target
from pftrack.core.model.likelihood import ObservationLikelihood
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.numerics.random import Generator, Stream
from pftrack.filters.particles import ParticleSet

__all__ = ["FilterInterface", "Update"]


@dataclass(frozen=True, slots=True)
class Update:
    """What a step of a filter came to.

    Attributes:
        particles: The posterior.
        log_evidence: log p(z_t | z_{1:t-1}) up to the constant that the likelihood leaves out.
        resampled: Whether parents were drawn.
        repeatable: Whether it came to the same whenever it was computed again, as far as that was tried.
    """

    particles: ParticleSet
    log_evidence: float
    resampled: bool
    repeatable: bool = True


class Begin(Protocol):
    """Begin to track."""

    def __call__(self, target: Target, frame: Frame, parameters: Any, rng: Stream) -> Any:  # noqa: ANN401
        """Return the state of frame 0, with particles."""


def _sample_count(parameters: Any) -> int:  # noqa: ANN401 - the experiment's own model
    return int(parameters.sample_count)


def _resample_below(parameters: Any) -> float:  # noqa: ANN401
    return float(getattr(parameters, "resampling_threshold", 1.0))


@dataclass(frozen=True)
class FilterInterface:
    """The states of an experiment as arrays, for filters that come from a file.

    Attributes:
        likelihood: What stands in for a file's own likelihood; it names the coordinates of a state, and brings a state
            up to the frame before particles take it.
        observed: What the functions find in a frame, as a sentence.
        example: Address of the module whose text is a file to begin with; nothing imports it.
        reads: Name of the tracker whose parameters those functions read that stand in for what a file leaves out.
        start: Begin; the state has particles (N, d).
        particles: (state, parameters, rng) -> its particles, drawn from its belief if it has none.
        propagate: (state, states (N, d), frame, parameters, rng) -> states (N, d), drawn from p(x_t | x_{t-1}).
        believe: (state before, update, frame, parameters) -> the state of the frame.
        series: What it reports of its states beside particles.
        measure: (state) -> the values of these series, particles' included.
        count: (parameters) -> how many particles there are to be.
        resample_below: (parameters) -> below which share of N the effective sample size calls for resampling.
        see: (state, frame) -> the frame as the functions of a file see it; as it is, without its truth, if None.
        project: (state, states (N, d)) -> where each sees the F points of a solid, (F, N, 2) px; None without such.
    """

    likelihood: ObservationLikelihood
    observed: str
    example: str
    reads: str
    start: Begin
    particles: Callable[[Any, Any, Any], ParticleSet]
    propagate: Callable[[Any, NDArray[np.float64], Frame, Any, Generator], NDArray[np.float64]]
    believe: Callable[[Any, Update, Frame, Any], Any]
    series: tuple[Series, ...]
    measure: Callable[[Any], Mapping[str, SeriesValue]]
    count: Callable[[Any], int] = _sample_count
    resample_below: Callable[[Any], float] = _resample_below
    see: Callable[[Any, Frame], Frame] | None = None
    project: Callable[[Any, NDArray[np.float64]], NDArray[np.float64]] | None = None
