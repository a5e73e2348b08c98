"""Logistic regression: the probability of one of two outcomes by a weighted sum of features.

P(lost | x) = 1 / (1 + exp(-(a + sum_i w_i z_i))), with z_i a feature less its mean in standard deviations. The weights
are those of greatest likelihood under a Gaussian prior around zero (ridge), found by Newton's method, which is
iteratively reweighted least squares (McCullagh and Nelder, Generalized linear models, 1989, section 2.5).
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pftrack.core.numerics.elementary import exponential

__all__ = ["Logistic", "fit"]

CLIP = 4.0
"""A feature counts as no more standard deviations from its mean: nothing is known of what lies beyond."""

STEPS, SETTLED = 50, 1e-8

CONSTANT, ENDLESS = 1e-6, 1e300
"""A deviation that is smaller than the one counts as the other, and a curvature is no smaller than the first."""


@dataclass(frozen=True, slots=True)
class Logistic:
    """A fitted regression on F features.

    Attributes:
        means: Of the features.
        deviations: Their standard deviations; endless for one that never changes, so that it counts for nothing.
        weights: Of the features in standard deviations.
        intercept: What is added.
    """

    means: tuple[float, ...]
    deviations: tuple[float, ...]
    weights: tuple[float, ...]
    intercept: float

    def probabilities(self, features: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (L,) probabilities by (L, F) features; the same bits on every machine, since sums are exact."""
        if not len(features):
            return np.zeros(0)
        terms = _scale(features, np.array(self.means), np.array(self.deviations)) * np.array(self.weights)
        return 1.0 / (1.0 + exponential([-math.fsum((self.intercept, *row)) for row in terms.tolist()]))


def fit(features: NDArray[np.float64], outcomes: NDArray[np.bool_], *, ridge: float) -> Logistic:
    """Return the regression that explains outcomes best.

    Args:
        features: (L, F), all known.
        outcomes: (L,) what came of each.
        ridge: Precision of the prior of each weight: 0 trusts the observations alone.
    """
    means, deviations = features.mean(axis=0), features.std(axis=0)
    deviations = np.where(deviations > CONSTANT, deviations, ENDLESS)
    design = np.column_stack([_scale(features, means, deviations), np.ones(len(features))])
    prior = np.diag([ridge] * features.shape[1] + [0.0])
    solution = np.zeros(design.shape[1])
    for _ in range(STEPS):
        chance = 1.0 / (1.0 + np.exp(-np.clip(design @ solution, -30.0, 30.0)))
        curvature = np.maximum(chance * (1.0 - chance), CONSTANT)
        gradient = design.T @ (outcomes - chance) - prior @ solution
        step = np.linalg.lstsq(design.T @ (design * curvature[:, None]) + prior, gradient, rcond=None)[0]
        solution += step
        if np.abs(step).max() < SETTLED:
            break
    return Logistic(
        tuple(means.tolist()), tuple(deviations.tolist()), tuple(solution[:-1].tolist()), float(solution[-1])
    )


def _scale(
    features: NDArray[np.float64], means: NDArray[np.float64], deviations: NDArray[np.float64]
) -> NDArray[np.float64]:
    return np.clip((features - means) / deviations, -CLIP, CLIP)
