"""One step of the ball trackers whose exact answer is known by quadrature (docs/methods/filters.md).

Parents of equal weight at rest around (160, 120) with a spread of 10 px, constant velocity, process noise 3 px, and
one red disc of radius 5 px at (170, 120). With a million particles every sampler must come within 0.05 px of the
posterior that its weight rule aims at.
"""

import numpy as np

from pftrack.core.numerics.random import Purpose, Stream
from pftrack.filters import auxiliary, bootstrap
from pftrack.filters.auxiliary import WeightRule
from pftrack.filters.dynamics import autoregression
from pftrack.filters.particles import ParticleSet
from pftrack.reproduce.finding import PROTOCOL, Finding, compare
from pftrack.reproduce.pool import Pool
from pftrack.sources.overlay import paint_disc
from pftrack.vision.likelihoods import chromaticity

__all__ = ["one_step"]

SOURCE = "quadrature"
PARTICLES = 1_000_000

POSTERIOR = (3.953, 9.352)
SHARPENED = (8.181, 5.861)
SHARPENED_HALF = (6.861, 7.395)
"""Mean and standard deviation of u - 160, px; the last for one half of the particles by observation."""

CASES: tuple[tuple[str, float, WeightRule, tuple[float, float]], ...] = (
    ("Condensation", 0.0, "corrected", POSTERIOR),
    ("APF, corrected", 1.0, "corrected", POSTERIOR),
    ("APF, sharpened", 1.0, "sharpened", SHARPENED),
    ("s-SPF half and half, corrected", 0.5, "corrected", POSTERIOR),
    ("s-SPF half and half, balanced", 0.5, "balanced", POSTERIOR),
    ("s-SPF half and half, sharpened", 0.5, "sharpened", SHARPENED_HALF),
)


def one_step(pool: Pool, full: bool) -> list[Finding]:
    """Mean and spread of the posterior of one step, for each sampler and weight rule."""
    del full
    findings = []
    for (name, _, _, (mean, spread)), outcome in zip(CASES, pool.map(_moments, range(len(CASES))), strict=True):
        findings.append(compare(f"one-step: mean, {name}", outcome[0], mean, 0.05, SOURCE, ground=PROTOCOL))
        findings.append(compare(f"one-step: sd, {name}", outcome[1], spread, 0.05, SOURCE, ground=PROTOCOL))
    return findings


def _moments(case: int) -> tuple[float, float]:
    _, share, rule, _ = CASES[case]
    image = np.full((240, 320, 3), 100, dtype=np.uint8)
    paint_disc(image, 170.0, 120.0, 5.0, (200, 50, 50))
    model = chromaticity.ColourModel((2 / 3, 1 / 6), (0.05, np.inf))
    one = np.eye(2)
    dynamics = autoregression(2 * one, -one, np.zeros(2), 3 * one)
    positions = np.array([160.0, 120.0]) + 10 * Stream(0, case, Purpose.START).standard_normal((PARTICLES, 2))
    parents = ParticleSet.uniform(np.hstack([positions, positions]))
    rng = Stream(0, case, Purpose.TRACK)
    observed = round(PARTICLES * share)

    def log_likelihood(
        states: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
    ) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        return chromaticity.log_likelihood(image, states, model, 0.1)

    posterior = (
        bootstrap.step(parents, dynamics, log_likelihood, rng)
        if observed == 0
        else auxiliary.step(
            parents,
            dynamics,
            log_likelihood,
            rng,
            weights=rule,
            prediction_count=PARTICLES - observed,
            observation_count=observed,
        )
    )
    mean, covariance = posterior.particles.moments
    return float(mean[0] - 160.0), float(np.sqrt(covariance[0, 0]))
