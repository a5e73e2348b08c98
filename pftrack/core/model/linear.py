"""What a tracker says of its model where that is linear and all noise Gaussian.

    x_t = A_t x_{t-1} + d_t + B_t u_t,  u_t ~ N(0, I)
    z_t = C_t x_t + v_t,                v_t ~ N(0, R_t)

For such a model more can be computed than by running the filter: how large the noises were, given all frames, in
closed form (`pftrack.filters.learning.noise_em`). A tracker declares which of its numbers scale which noise, and lays
the model of some frames open as chains. One chain is one such recursion; a tracker of many points has one for each.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame

__all__ = ["LinearChain", "LinearModel", "NoiseKind", "NoiseScale"]

NoiseKind: TypeAlias = Literal["process", "observation"]

POWERS: Final[Mapping[bool, float]] = {False: 2.0, True: 1.0}
"""Of a number, that its noise's covariance is in proportion to, by whether it is a variance."""


@dataclass(frozen=True, slots=True)
class NoiseScale:
    """A number of a tracker that scales the covariance of one of its noises, and enters nothing else.

    Attributes:
        kind: "process" if all B_t B_t^T are in proportion to it, "observation" if all R_t are.
        is_variance: Whether it is a variance; else it is a standard deviation.
    """

    kind: NoiseKind
    is_variance: bool = False

    def factor(self, before: float, after: float) -> float:
        """Return by what the covariance is multiplied when the number changes."""
        return float((after / before) ** POWERS[self.is_variance])

    def scale(self, before: float, factor: float) -> float:
        """Return the number after the covariance was multiplied by a factor."""
        return float(before * factor ** (1.0 / POWERS[self.is_variance]))


@dataclass(frozen=True, slots=True, eq=False)
class LinearChain:
    """A linear Gaussian model over T frames, and what was measured in them.

    Attributes:
        mean: (d,) of the state before the first of these frames.
        covariance: (d, d) of the same, which may be singular.
        transitions: (T, d, d) A_t.
        offsets: (T, d) d_t.
        noises: (T, d, k) B_t.
        measurements: (T, m) z_t; a row that is not finite is missing.
        observations: (T, m, d) C_t.
        covariances: (T, m, m) R_t, positive definite.
    """

    mean: NDArray[np.float64]
    covariance: NDArray[np.float64]
    transitions: NDArray[np.float64]
    offsets: NDArray[np.float64]
    noises: NDArray[np.float64]
    measurements: NDArray[np.float64]
    observations: NDArray[np.float64]
    covariances: NDArray[np.float64]

    @classmethod
    def steady(
        cls,
        mean: NDArray[np.float64],
        covariance: NDArray[np.float64],
        transition: NDArray[np.float64],
        offset: NDArray[np.float64],
        noise: NDArray[np.float64],
        measurements: NDArray[np.float64],
        observation: NDArray[np.float64],
        measurement_covariance: NDArray[np.float64],
    ) -> "LinearChain":
        """Return the chain of a model that is the same in all frames.

        Args:
            mean: (d,).
            covariance: (d, d).
            transition: A, (d, d).
            offset: (d,).
            noise: B, (d, k).
            measurements: (T, m).
            observation: C, (m, d).
            measurement_covariance: R, (m, m).
        """

        def repeat(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.array(np.broadcast_to(matrix, (len(measurements), *matrix.shape)))

        parts = repeat(transition), repeat(offset), repeat(noise)
        return cls(mean, covariance, *parts, measurements, repeat(observation), repeat(measurement_covariance))


@dataclass(frozen=True)
class LinearModel:
    """That a tracker computes the exact posterior of a linear Gaussian model.

    Attributes:
        scales: What scales its noises, by the names of parameters; one of each kind at most.
        chains: (state of frame 0, frames from 0 on, parameters) -> the model of these frames; None if it is not linear
            with these parameters, or on such frames. What a chain begins with depends on no noise that is scaled, and
            the sum of the chains' log evidence is that of the tracker.
    """

    scales: Mapping[str, NoiseScale]
    chains: Callable[[Any, Sequence[Frame], Any], tuple[LinearChain, ...] | None]
