"""Filters beside what is known exactly or published of signals: Bando 2007, ch. 2, and one step by quadrature.

The Kalman filter follows a sine, the particle filter a cosine.
"""

import math
from collections.abc import Mapping

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.geometry import paint_disc
from pftrack.core.model.parameters import Value
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.filters import auxiliary, bootstrap
from pftrack.filters.auxiliary import WeightRule
from pftrack.filters.dynamics import autoregression
from pftrack.filters.particles import ParticleSet
from pftrack.reproduce.finding import Findings, References, three_errors
from pftrack.reproduce.pool import Pool, recipe, rows_of, seeded
from pftrack.runs.run import Run
from pftrack.vision.likelihoods import chromaticity

REFERENCES = References(__file__)
MEDIAN_TRIALS, QUICK_TRIALS = 100, 16
KALMAN_TRIALS, QUICK_KALMAN_TRIALS = 1000, 40


def kalman_sine(pool: Pool, full: bool) -> Findings:
    """Mean errors of the Kalman filter on a sine, and its posterior spread."""
    values: dict[str, Value] = {"waveform": "sine", "initial_sd": 1.0}
    seeds = range(KALMAN_TRIALS if full else QUICK_KALMAN_TRIALS)
    outcomes = np.array(pool.runs(_kalman_errors, [recipe("sine", "kalman", values, seed=seed) for seed in seeds]))
    for name, column in zip(REFERENCES.table("kalman"), outcomes.T, strict=True):
        stated = REFERENCES.statements["kalman"].tolerance[name]
        wider = {} if full else {"tolerance": max(stated, three_errors(column, KALMAN_TRIALS)), "ground": "trials"}
        yield REFERENCES.judge("kalman", column.mean(), name, **wider)


def sample_count(pool: Pool, full: bool) -> Findings:
    """Median error of the particle filter on a cosine over the number of particles."""
    counts = list(REFERENCES.table("count")) if full else [10, 20, 50]
    medians = _medians(pool, {count: {"sample_count": count} for count in counts}, full=full)
    holds = medians[10] >= medians[20] >= medians[50]
    yield from REFERENCES.judge_all("count", medians, wider=_wider(full))
    yield REFERENCES.judge("falls", medians[10] - medians[50], holds=holds)


def dimension(pool: Pool, full: bool) -> Findings:
    """Median error of the particle filter over the dimension of the state, for three numbers of particles."""
    dimensions = (1, 2, 3, 4, 5) if full else (1, 5)
    for count in REFERENCES.table("dimension"):
        settings: dict[int, dict[str, Value]] = {it: {"sample_count": count, "dimension": it} for it in dimensions}
        medians = _medians(pool, settings, full=full)
        yield from REFERENCES.judge_all("dimension", medians, count, wider=_wider(full))
        growth = medians[dimensions[-1]] / medians[dimensions[0]]
        holds = growth > 1.25 and (count == 1000 or bool((np.diff(list(medians.values())) > 0).all()))
        yield REFERENCES.judge("grows", growth, count, holds=holds)


def _medians(pool: Pool, settings: Mapping[int, dict[str, Value]], *, full: bool) -> dict[int, float]:
    """Return the median over trials of the mean error for each setting."""
    seeds = range(MEDIAN_TRIALS if full else QUICK_TRIALS)
    groups = {key: seeded(recipe("sine", "condensation", setting), seeds) for key, setting in settings.items()}
    return {key: float(np.median(errors)) for key, errors in pool.run_groups(mean_error, groups).items()}


def _wider(full: bool) -> float:
    """Return by how much medians of fewer trials scatter more."""
    return 1.0 if full else math.sqrt(MEDIAN_TRIALS / QUICK_TRIALS)


def mean_error(run: Run) -> float:
    """Return the mean error over all frames but the first."""
    return float(np.mean([row.error for row in rows_of(run) if row.error is not None]))


def _kalman_errors(run: Run) -> tuple[float, float, float, float]:
    rows = rows_of(run)
    errors = np.array([row.error for row in rows], dtype=np.float64)
    observed = [abs(row.observation[0] - row.truth[0]) for row in rows if row.observation and row.truth]
    return float(errors.mean()), float(errors[60:].mean()), float(np.mean(observed)), rows[-1].sigma[0]


# The exact answer of one step is known by quadrature (docs/methods/filters.md). Parents of equal weight lie at rest
# around (160, 120) with a spread of 10 px, constant velocity, process noise 3 px, and one red disc of radius 5 px at
# (170, 120). With a million particles every sampler must be within 0.05 px of the posterior that its weight rule aims
# at.

PARTICLES = 1_000_000
SAMPLERS: Mapping[str, tuple[float, WeightRule]] = {
    "Condensation": (0.0, "corrected"),
    "APF, corrected": (1.0, "corrected"),
    "APF, sharpened": (1.0, "sharpened"),
    "s-SPF half and half, corrected": (0.5, "corrected"),
    "s-SPF half and half, balanced": (0.5, "balanced"),
    "s-SPF half and half, sharpened": (0.5, "sharpened"),
}
"""Share of the particles that are drawn by observation, and rule of the weights."""


def one_step(pool: Pool, full: bool) -> Findings:
    """Mean and spread of the posterior of one step, for each sampler and weight rule."""
    del full
    for name, (mean, spread) in zip(SAMPLERS, pool.map(_moments, range(len(SAMPLERS))), strict=True):
        yield from REFERENCES.judge_all("one-step", {"mean": mean, "sd": spread}, name)


def _moments(case: int) -> tuple[float, float]:
    share, rule = list(SAMPLERS.values())[case]
    image = np.full((240, 320, 3), 100, dtype=np.uint8)
    paint_disc(image, 170.0, 120.0, 5.0, (200, 50, 50))
    model = chromaticity.ColourModel((2 / 3, 1 / 6), (0.05, np.inf))
    one = np.eye(2)
    dynamics = autoregression(2 * one, -one, np.zeros(2), 3 * one)
    positions = np.array([160.0, 120.0]) + 10 * Stream(0, case, Purpose.START).standard_normal((PARTICLES, 2))
    parents = ParticleSet.uniform(np.hstack([positions, positions]))
    rng = Stream(0, case, Purpose.TRACK)
    observed = round(PARTICLES * share)

    def log_likelihood(states: Floats) -> Floats:
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
