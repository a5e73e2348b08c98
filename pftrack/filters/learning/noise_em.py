"""How large the noises of a linear Gaussian model are, by expectation maximisation (EM).

Given all frames, the smoother says how large the noises were on average in deviations of what they were taken to be
(the E step). The covariance under which they come to 1 is the old one times that average (the M step; Shumway and
Stoffer 1982, section 3, for covariances of which a scale alone is unknown). No step makes the evidence smaller.

Where a noise is hardly seen EM creeps. So two steps are taken at once and extrapolated on logarithms (Varadhan and
Roland 2008, scheme S3), and the place is given up for that of the two steps if the evidence there is smaller: what is
kept never falls.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.linear import LinearChain, NoiseKind
from pftrack.core.numerics.elementary import exponential, logarithm
from pftrack.filters.disturbances import Disturbances, smooth_disturbances

__all__ = ["MOST_STEPS", "NoiseFit", "fit_noise"]

MOST_STEPS: Final = 300
TOLERANCE: Final = 1e-6
"""Of a covariance's logarithm: where an EM step moves it by less, it has arrived."""


@dataclass(frozen=True, slots=True)
class NoiseFit:
    """What EM has found.

    Attributes:
        factors: By what the covariance of each noise that was fitted is to be multiplied.
        log_evidence: Of the beginning and of each place that was kept after it, nats; it never falls.
        steps: How many times the frames were smoothed.
        converged: Whether a further step would change nothing.
    """

    factors: Mapping[NoiseKind, float]
    log_evidence: tuple[float, ...]
    steps: int
    converged: bool


def fit_noise(
    chains: Sequence[LinearChain],
    bounds: Mapping[NoiseKind, tuple[float, float]],
    *,
    begin: Mapping[NoiseKind, float] | None = None,
    most_steps: int = MOST_STEPS,
    on_step: Callable[[int], object] = lambda _: None,
) -> NoiseFit:
    """Return by what factors the covariances of noises make the chains most probable.

    Args:
        chains: The model, and what was measured.
        bounds: Least and largest factor of each noise that is to be fitted, positive.
        begin: Factors to begin at; 1 if not given.
        most_steps: How many times the frames may be smoothed at most.
        on_step: Called after each time with how many there were.

    Raises:
        numpy.linalg.LinAlgError: An innovation covariance is singular.
        ValueError: There is nothing to fit, or a bound is not positive.
    """
    if not (chains and bounds) or any(not 0 < low < high for low, high in bounds.values()):
        raise ValueError(f"chains and positive bounds are needed, got {len(chains)} and {dict(bounds)}")
    kinds = tuple(bounds)
    limits = logarithm([bounds[kind] for kind in kinds])
    search = _Ascent(chains, kinds, limits, most_steps, on_step)
    start = logarithm([(begin or {}).get(kind, 1.0) for kind in kinds])
    place, converged = search.climb(np.clip(start, limits[:, 0], limits[:, 1]))
    factors = {kind: float(it) for kind, it in zip(kinds, exponential(place), strict=True)}
    return NoiseFit(factors, tuple(search.kept), search.steps, converged)


class _Ascent:
    """The way up, on logarithms of factors."""

    def __init__(
        self,
        chains: Sequence[LinearChain],
        kinds: tuple[NoiseKind, ...],
        limits: NDArray[np.float64],
        most_steps: int,
        on_step: Callable[[int], object],
    ) -> None:
        self.kept: list[float] = []
        self.steps = 0
        self._chains, self._kinds, self._limits = chains, kinds, limits
        self._most_steps, self._on_step = most_steps, on_step

    def climb(self, place: NDArray[np.float64]) -> tuple[NDArray[np.float64], bool]:
        """Return the last place that was kept, and whether it has arrived."""
        evidence, first = self._step(place)
        self.kept.append(evidence)
        while np.abs(first - place).max() >= TOLERANCE:
            if self.steps + 2 > self._most_steps:
                return place, False
            evidence, second = self._step(first)
            self.kept.append(evidence)
            beyond = self._clip(_extrapolate(place, first, second))
            found = self._step(beyond)
            if found[0] < evidence:
                if self.steps >= self._most_steps:
                    return first, False
                beyond, found = second, self._step(second)
            place, (evidence, first) = beyond, found
            self.kept.append(evidence)
        return place, True

    def _step(self, place: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        """Return the log evidence at a place, and where one EM step leads from it."""
        factors = dict(zip(self._kinds, exponential(place).tolist(), strict=True))
        scales = factors.get("process", 1.0), factors.get("observation", 1.0)
        found = [smooth_disturbances(chain, *scales) for chain in self._chains]
        self.steps += 1
        self._on_step(self.steps)
        evidence = float(sum(each.log_evidence.sum() for each in found))
        means = [_mean(found, kind) for kind in self._kinds]
        return evidence, self._clip(place + logarithm(means))

    def _clip(self, place: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.clip(place, self._limits[:, 0], self._limits[:, 1])


def _mean(found: Sequence[Disturbances], kind: NoiseKind) -> float:
    """Return the mean squared noise in deviations over all chains; 1 where there is none to be seen."""
    pairs = [
        (each.process, each.process_count) if kind == "process" else (each.observation, each.observation_count)
        for each in found
    ]
    count = sum(number for _, number in pairs)
    return sum(mean * number for mean, number in pairs) / count if count else 1.0


def _extrapolate(
    start: NDArray[np.float64], first: NDArray[np.float64], second: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return where the steps from start to first and on to second lead in the end, if they go on like that."""
    stride = first - start
    bend = second - first - stride
    size = np.sqrt(np.square(bend).sum())
    length = max(1.0, float(np.sqrt(np.square(stride).sum()) / size)) if size > 0.0 else 1.0
    return np.asarray(start + 2.0 * length * stride + length**2 * bend)
