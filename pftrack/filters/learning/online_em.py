"""Online expectation maximisation of second-order dynamics, with forgetting.

While a tracker runs, its posterior means are taken as measurements y_t of the true path with the tracker's sigma, and
the model x_{t+2} = A1 x_{t+1} + A0 x_t + d + B u is estimated from them (Bando 2007, ch. 3 section 2.3 and Appendix B,
eqs. A.17 to A.20):

- *E step*: a fixed-lag Kalman smoother with the current model gives the joint posterior of three consecutive positions
  a few frames ago;
- *statistics*: their second moments, averaged with a weight that discounts the past by a factor per frame (Sato and
  Ishii 2000);
- *M step*: the regression of the newest of the three on the two older ones and a constant, with a small ridge towards
  the initial model, which directions without any motion need.

A tracker with a poor first model learns from a wrong track. The guard refuses a model that is not finite or whose
spectral radius implies divergence; without it learning breaks Condensation (docs/methods/switching.md).

Regression works in coordinates of order one, xi = (x - centre) / 100 px.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.model import LinearChain, NoiseKind
from pftrack.core.numerics.elementary import exponential, logarithm
from pftrack.core.numerics.matrices import product, solve_system
from pftrack.core.numerics.random import Gaussian
from pftrack.filters import kalman
from pftrack.filters.disturbances import Disturbances, smooth_disturbances
from pftrack.filters.dynamics import LinearDynamics, augment, augment_dynamics, autoregression, block

LAG = 5
"""Frames from the newest measurement to the oldest of the smoothed triple."""

SCALE_PX = 100.0
RUNAWAY = 5.0
"""Statistics are not updated while the estimate is further than this from the centre, in units of 100 px."""


@dataclass(frozen=True, slots=True)
class Settings:
    """How to learn.

    Attributes:
        forgetting: lambda, 0..1; the memory is about 1 / (1 - lambda) frames.
        warm_up: Triples to collect before the first M step.
        ridge: kappa, the pull towards the initial model.
        largest_spectral_radius: Limit for accepted models.
    """

    forgetting: float
    warm_up: int
    ridge: float
    largest_spectral_radius: float


@dataclass(frozen=True, slots=True)
class Learner:
    """The learned state, immutable; positions in units of 100 px from the centre of the picture.

    Attributes:
        theta: (2, 5) the model [A1 A0 d] in force.
        positions: Fixed-lag posterior of the last six positions, (12,), newest first.
        regressors: (5, 5) discounted mean of phi phi^T, phi = (x_{t-1}, x_{t-2}, 1).
        products: (2, 5) discounted mean of x_t phi^T.
        weight: eta of the last triple; 0 before the first.
        triples: Number of counted triples.
        frames: Number of measurements used.
        centre_px: (2,) origin of the coordinates.
    """

    theta: Floats
    positions: Gaussian
    regressors: Floats
    products: Floats
    weight: float
    triples: int
    frames: int
    centre_px: Floats


def begin(model: LinearDynamics, position_px: Floats, sigma_px: float, size: tuple[int, int]) -> Learner:
    """Begin with a model and one known position.

    Args:
        model: Initial second-order dynamics of (x_t, x_{t-1}) in px, as from `autoregression`.
        position_px: (2,) where the target is, and is taken to have been.
        sigma_px: Its standard deviation.
        size: Width and height of the picture, px.
    """
    centre = np.array(size) / 2.0
    known = Gaussian((position_px - centre) / SCALE_PX, np.eye(2) * (sigma_px / SCALE_PX) ** 2)
    return Learner(
        theta=_normalise(model, centre),
        positions=augment(known, LAG),
        regressors=np.zeros((5, 5)),
        products=np.zeros((2, 5)),
        weight=0.0,
        triples=0,
        frames=0,
        centre_px=centre,
    )


def learn(
    learner: Learner,
    initial: LinearDynamics,
    estimate_px: Floats,
    sigma_px: Floats,
    settings: Settings,
) -> Learner:
    """Take one frame's estimate in.

    Args:
        learner: The learner after the last frame.
        initial: The model that the ridge pulls towards; its noise B is the model's, which is not learned.
        estimate_px: (2,) posterior mean of the tracker; a value that is not finite changes nothing.
        sigma_px: (2,) posterior standard deviations.
        settings: How to learn.
    """
    if not (np.isfinite(estimate_px).all() and np.isfinite(sigma_px).all()):
        return learner
    measurement = (estimate_px - learner.centre_px) / SCALE_PX
    positions = _smooth(learner, initial.noise[:2], measurement, (sigma_px / SCALE_PX) ** 2 + 1e-8)
    watched = replace(learner, positions=positions, frames=learner.frames + 1)
    if watched.frames < LAG or float(np.hypot(*measurement)) > RUNAWAY or not np.isfinite(positions.mean).all():
        return watched
    weight = 1.0 if learner.triples == 0 else 1.0 / (1.0 + settings.forgetting / learner.weight)
    seen_regressors, seen_products = _second_moments(positions)
    regressors = learner.regressors + weight * (seen_regressors - learner.regressors)
    products = learner.products + weight * (seen_products - learner.products)
    counted = replace(watched, regressors=regressors, products=products, weight=weight, triples=learner.triples + 1)
    if counted.triples < settings.warm_up:
        return counted
    theta = _solve(regressors, products, _normalise(initial, learner.centre_px), settings.ridge)
    if np.isfinite(theta).all() and stays_within(theta, settings.largest_spectral_radius):
        return replace(counted, theta=theta)
    return counted


def dynamics(learner: Learner, noise: Floats) -> LinearDynamics:
    """Return the learned model on (x_t, x_{t-1}) in px, with the given process noise B, (2, k)."""
    newer, older = learner.theta[:, :2], learner.theta[:, 2:4]
    offset = SCALE_PX * learner.theta[:, 4] + product(np.eye(2) - newer - older, learner.centre_px)
    return autoregression(newer, older, offset, noise)


def period_frames(model: LinearDynamics, axis: int = 0) -> float:
    """Return the period of oscillation along an axis, frames; NaN where the roots are real."""
    newer, older = model.transition[axis, axis], model.transition[axis, 2 + axis]
    if older >= 0 or abs(newer) >= 2.0 * np.sqrt(-older):
        return float("nan")
    return 2.0 * math.pi / math.acos(newer / (2.0 * math.sqrt(-older)))


def stays_within(theta: Floats, radius: float) -> bool:
    """Return whether all roots of a model [A1 A0 d] (2, 5) lie within a circle around 0.

    They are those of det(z^2 - A1 z - A0), a polynomial of the fourth degree, and lie within the unit circle exactly if
    the last coefficient is smaller than the first, and so on after each step of Schur and Cohn's reduction. Dividing
    the roots by the radius first covers any circle.
    """
    (a, b), (c, d) = theta[:, :2].tolist()
    (e, f), (g, h) = theta[:, 2:4].tolist()
    trace, cross = a + d, a * h + d * e - b * g - c * f
    coefficients = [1.0, -trace, a * d - b * c - e - h, cross, e * h - f * g]
    coefficients = [value / radius**power for power, value in enumerate(coefficients)]
    while len(coefficients) > 1:
        first, last = coefficients[0], coefficients[-1]
        if not abs(last) < abs(first):
            return False
        pairs = zip(coefficients, reversed(coefficients), strict=True)
        coefficients = [first * one - last * other for one, other in pairs][:-1]
    return True


def _smooth(
    learner: Learner,
    noise_px: Floats,
    measurement: Floats,
    variances: Floats,
) -> Gaussian:
    """Return the posterior of the last six positions, the oldest of them smoothed by five later measurements."""
    theta = learner.theta
    model = autoregression(theta[:, :2], theta[:, 2:4], theta[:, 4], noise_px / SCALE_PX)
    prior = kalman.predict(learner.positions, augment_dynamics(model, 2, LAG))
    observation = np.eye(2, len(prior.mean))
    posterior, _ = kalman.update(prior, measurement, observation, np.diag(variances))
    return posterior


def _second_moments(positions: Gaussian) -> tuple[Floats, Floats]:
    """Return E[phi phi^T] (5, 5) and E[x2 phi^T] (2, 5) of the oldest triple."""
    triple = block(positions, LAG - 2, 2, 3)
    extended = np.append(triple.mean, 1.0)
    second = np.outer(extended, extended)
    second[:6, :6] += triple.covariance
    return second[2:, 2:], second[:2, 2:]


def _normalise(model: LinearDynamics, centre_px: Floats) -> Floats:
    """Return [A1 A0 d] (2, 5) of a model in px, in the learner's coordinates."""
    newer, older = model.transition[:2, :2], model.transition[:2, 2:]
    drift = (model.offset[:2] - product(np.eye(2) - newer - older, centre_px)) / SCALE_PX
    return np.hstack([newer, older, drift[:, None]])


def _solve(regressors: Floats, products: Floats, anchor: Floats, ridge: float) -> Floats:
    """Return the model that fits the statistics, pulled towards the anchor (eqs. A.17-A.19 with a ridge)."""
    try:
        return solve_system(regressors + ridge * np.eye(5), (products + ridge * anchor).T).T
    except np.linalg.LinAlgError:
        return np.full_like(anchor, np.nan)


# Given all frames, the smoother returns the average size of the noises of a linear Gaussian model, in assumed standard
# deviations (the E step). The covariance under which they are 1 is the old one times that average (the M step; Shumway
# and Stoffer 1982, section 3, for covariances whose scale alone is unknown). No step makes the evidence smaller.
#
# EM is slow where the data hardly determine a noise. So two steps are taken at once and extrapolated on logarithms
# (Varadhan and Roland 2008, scheme S3), and the extrapolation is replaced by the two steps if its evidence is smaller:
# the evidence never falls.

MOST_STEPS: Final = 300
TOLERANCE: Final = 1e-6
"""Change of a covariance's logarithm below which EM has converged."""


@dataclass(frozen=True, slots=True)
class NoiseFit:
    """The result of EM.

    Attributes:
        factors: Factors for the covariance of each fitted noise.
        log_evidence: Log evidence at the beginning and after each accepted step, nats; it never falls.
        steps: Number of passes over the frames.
        converged: Whether EM has converged.
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
) -> NoiseFit:
    """Return the factors of the noises' covariances that make the chains most probable.

    Args:
        chains: The model, and what was measured.
        bounds: Least and largest factor of each noise that is to be fitted, positive.
        begin: Factors to begin at; 1 if not given.
        most_steps: Largest number of passes over the frames.

    Raises:
        numpy.linalg.LinAlgError: An innovation covariance is singular.
        ValueError: There is nothing to fit, or a bound is not positive.
    """
    if not (chains and bounds) or any(not 0 < low < high for low, high in bounds.values()):
        raise ValueError(f"chains and positive bounds are needed, got {len(chains)} and {dict(bounds)}")
    kinds = tuple(bounds)
    limits = logarithm([bounds[kind] for kind in kinds])
    search = _Ascent(chains, kinds, limits, most_steps)
    start = logarithm([(begin or {}).get(kind, 1.0) for kind in kinds])
    place, converged = search.climb(np.clip(start, limits[:, 0], limits[:, 1]))
    factors = {kind: float(it) for kind, it in zip(kinds, exponential(place), strict=True)}
    return NoiseFit(factors, tuple(search.kept), search.steps, converged)


class _Ascent:
    """The way up, on logarithms of factors."""

    def __init__(
        self, chains: Sequence[LinearChain], kinds: tuple[NoiseKind, ...], limits: Floats, most_steps: int
    ) -> None:
        self.kept: list[float] = []
        self.steps = 0
        self._chains, self._kinds, self._limits = chains, kinds, limits
        self._most_steps = most_steps

    def climb(self, place: Floats) -> tuple[Floats, bool]:
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

    def _step(self, place: Floats) -> tuple[float, Floats]:
        """Return the log evidence at a place, and where one EM step leads from it."""
        factors = dict(zip(self._kinds, exponential(place).tolist(), strict=True))
        scales = factors.get("process", 1.0), factors.get("observation", 1.0)
        found = [smooth_disturbances(chain, *scales) for chain in self._chains]
        self.steps += 1
        evidence = float(sum(each.log_evidence.sum() for each in found))
        means = [_mean(found, kind) for kind in self._kinds]
        return evidence, self._clip(place + logarithm(means))

    def _clip(self, place: Floats) -> Floats:
        return np.clip(place, self._limits[:, 0], self._limits[:, 1])


def _mean(found: Sequence[Disturbances], kind: NoiseKind) -> float:
    """Return the mean squared noise, in standard deviations, over all chains; 1 without any data."""
    pairs = [
        (each.process, each.process_count) if kind == "process" else (each.observation, each.observation_count)
        for each in found
    ]
    count = sum(number for _, number in pairs)
    return sum(mean * number for mean, number in pairs) / count if count else 1.0


def _extrapolate(start: Floats, first: Floats, second: Floats) -> Floats:
    """Return the extrapolated limit of the steps from start to first and to second."""
    stride = first - start
    bend = second - first - stride
    size = np.sqrt(np.square(bend).sum())
    length = max(1.0, float(np.sqrt(np.square(stride).sum()) / size)) if size > 0.0 else 1.0
    return np.asarray(start + 2.0 * length * stride + length**2 * bend)
