"""Lesson 3: from a measurement back to the state, by Bayes' rule.

The posterior is computed on a grid, as any posterior could be, and compared with the closed form that it has where
prior and noise are normal.
"""

import math
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import log_ndtr, ndtr

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Parameters, Value, parameter
from pftrack.teaching.lessons.course.probability import normal
from pftrack.teaching.lessons.figure import Panel, Shown, ceiling, look
from pftrack.teaching.lessons.lesson import Answer, Computed, Demonstration, Outcome

# In closed form: mean and variance of what is left of a normal prior after one measurement. A measured position leaves
# a normal posterior. A measured distance leaves one to either side of the camera, both cut off there. All is in m.


def after_position(prior_mean: float, prior_sd: float, noise_sd: float, measured: float) -> tuple[float, float]:
    """Return mean and variance after a position was measured."""
    _, mean, variance = _product(prior_mean, prior_sd, noise_sd, measured)
    return mean, variance


def after_distance(
    prior_mean: float, prior_sd: float, noise_sd: float, measured: float, camera: float
) -> tuple[float, float]:
    """Return mean and variance after the distance to a camera was measured."""
    sides = [_one_side(prior_mean, prior_sd, noise_sd, measured, camera, side) for side in (-1.0, 1.0)]
    log_areas, means, variances = np.array(sides).T
    shares = np.exp(log_areas - log_areas.max())
    shares /= shares.sum()
    mean = float(shares @ means)
    return mean, float(shares @ (variances + np.square(means - mean)))


def _product(prior_mean: float, prior_sd: float, noise_sd: float, centre: float) -> tuple[float, float, float]:
    """Multiply the prior by N(x; centre, noise^2): logarithm of the product's area, its mean and its variance."""
    prior, noise = prior_sd**2, noise_sd**2
    both = prior + noise
    mean = (prior_mean * noise + centre * prior) / both
    return -0.5 * ((centre - prior_mean) ** 2 / both + math.log(both)), mean, prior * noise / both


def _one_side(
    prior_mean: float, prior_sd: float, noise_sd: float, measured: float, camera: float, side: float
) -> tuple[float, float, float]:
    """Return the same of the part right (1) or left (-1) of the camera: a normal density that is cut off there."""
    log_area, mean, variance = _product(prior_mean, prior_sd, noise_sd, camera + side * measured)
    sd, away = math.sqrt(variance), side * (mean - camera)
    cut = -away / sd
    log_kept = float(log_ndtr(-cut))
    ratio = math.exp(-0.5 * cut * cut - log_kept) / math.sqrt(2.0 * math.pi)
    return log_area + log_kept, camera + side * (away + sd * ratio), variance * (1.0 + cut * ratio - ratio * ratio)


LOOK = look(__file__)
LOW, HIGH = -5.0, 15.0
CAMERA = 5.0
"""Place of the camera in m, from which distances are measured."""
STEP = 0.02
GRID: Floats = np.linspace(-60.0, 70.0, 6_501)
"""In m; far beyond the drawn range, so sums over it are integrals. The camera stands on one of its points."""
DRAWN = slice(2750, 3751, 2)
"""The drawn part of the grid, LOW to HIGH."""


class BayesParameters(Parameters):
    """The prior, the noise of the measurement, and the measurement."""

    mode: Literal["position", "distance"] = parameter("position", "Measured quantity")
    """The position itself, z = x + noise, or the distance to a camera at 5 m, z = |x - 5 m| + noise."""
    prior_mean: float = parameter(2, "Prior mean", unit="m", within=(-4, 14, 0.1))
    """Mean of the prior."""
    prior_sd: float = parameter(2, "Prior width", unit="m", within=(0.2, 20, 0.1))
    """Standard deviation of the prior."""
    noise_sd: float = parameter(1, "Noise", unit="m", within=(0.2, 5, 0.1))
    """Standard deviation of the measurement's error."""
    measured: float = parameter(5, "Measured z", unit="m", within=(0, 10, 0.1))
    """The measured position or distance."""


def expected_measurement(x: ArrayLike, mode: str) -> Floats:
    """Return what would be measured without noise at each state x: the easy direction."""
    at = np.asarray(x, dtype=np.float64)
    return at if mode == "position" else np.abs(at - CAMERA)


def posterior(p: BayesParameters) -> Floats:
    """Return p(x | z) over the grid: prior times likelihood, divided by the area of that.

    The product is made of logarithms, since both may be far too small for a number where the other is large.
    """
    logs = -0.5 * np.square((GRID - p.prior_mean) / p.prior_sd)
    logs -= 0.5 * np.square((p.measured - expected_measurement(GRID, p.mode)) / p.noise_sd)
    product = np.exp(logs - logs.max())
    return np.asarray(product / (STEP * product.sum()))


def moments(density: Floats) -> tuple[float, float]:
    """Return mean and variance of a density over the grid, in m and m^2."""
    weights = STEP * density
    mean = float(weights @ GRID)
    return mean, float(weights @ np.square(GRID - mean))


def exact_moments(p: BayesParameters) -> tuple[float, float]:
    """Return mean and variance of the posterior in closed form."""
    if p.mode == "position":
        return after_position(p.prior_mean, p.prior_sd, p.noise_sd, p.measured)
    return after_distance(p.prior_mean, p.prior_sd, p.noise_sd, p.measured, CAMERA)


def likelihood_area(p: BayesParameters) -> float:
    """Return the exact area of the likelihood over x."""
    return 1.0 if p.mode == "position" else 2.0 * float(ndtr(p.measured / p.noise_sd))


def peaks(density: Floats) -> Floats:
    """Return the places in m at which a density over the grid has a peak."""
    inner = density[1:-1]
    return np.asarray(GRID[1:-1][(inner > density[:-2]) & (inner >= density[2:]) & (inner > 1e-12)])


def show(parameters: BayesParameters, seed: int) -> Shown:
    """Multiply prior and likelihood, and compare the posterior's moments with the closed form."""
    del seed
    p = parameters
    density = posterior(p)
    likelihood = normal(expected_measurement(GRID, p.mode), p.measured, p.noise_sd)
    mean, variance = moments(density)
    exact_mean, exact_variance = exact_moments(p)
    tolerance = 1e-6 if p.mode == "position" else 1e-3
    numbers = {
        "mean": (mean, exact_mean, tolerance),
        "variance": (variance, exact_variance, tolerance),
        "area": (STEP * float(likelihood.sum()), likelihood_area(p), 1e-3),
    }
    prior = normal(GRID, p.prior_mean, p.prior_sd)
    top = ceiling(1.02 * float(max(prior.max(), density[DRAWN].max())))
    x, across, up = GRID[DRAWN], (LOW, HIGH), (0.0, top)
    after = {"x": x, "y": density[DRAWN], "area": across}
    panels = (
        LOOK.draw("prior", {"prior": (x, prior[DRAWN])}, turned=p, x=across, y=up, mean=p.prior_mean, sd=p.prior_sd),
        _likelihood(p, likelihood),
        LOOK.draw("posterior", {"prior": (x, prior[DRAWN]), "posterior": after, "mean": (mean,)}, x=across, y=up),
    )
    return LOOK.show(panels, numbers)


def _likelihood(p: BayesParameters, likelihood: Floats) -> Panel:
    at_position = p.mode == "position"
    left, right = CAMERA - p.measured, CAMERA + p.measured
    two = f"Two bumps, at {left:g} m and {right:g} m, each {p.measured:g} m from the camera at {CAMERA:g} m."
    traces = {"likelihood": (GRID[DRAWN], likelihood[DRAWN]), **({} if at_position else {"camera": (CAMERA,)})}
    return LOOK.draw(
        "likelihood",
        traces,
        turned=p if at_position else None,
        x=(LOW, HIGH),
        y=(0.0, ceiling(1.02 * float(likelihood.max()))),
        measured=p.measured,
        bumps=f"One bump at the measured {p.measured:g} m." if at_position else two,
    )


def _answer(parameters: BayesParameters, seed: int) -> Answer:
    del seed
    found = peaks(posterior(parameters))
    words = f"The posterior has {len(found)} peak{'s' if len(found) > 1 else ''}, at {_join(found)}."
    return Answer("two" if len(found) == 2 else "one", words=words)


def _join(places: Floats) -> str:
    return " and ".join(f"{place:.2f} m" for place in places)


AT_A_DISTANCE: dict[str, Value] = {
    "mode": "distance",
    "prior_mean": 6.0,
    "prior_sd": 4.0,
    "noise_sd": 0.5,
    "measured": 3.0,
}
"""Parameters of the question."""


def _distance() -> BayesParameters:
    return BayesParameters.model_validate(AT_A_DISTANCE)


def _grid() -> Outcome:
    p = BayesParameters()
    mean, variance = exact_moments(p)
    off = np.abs(posterior(p) - normal(GRID, mean, math.sqrt(variance))).max()
    return Outcome(float(off), 0.0, 1e-9)


def _area() -> Outcome:
    p = _distance()
    return Outcome(STEP * float(normal(expected_measurement(GRID, p.mode), p.measured, p.noise_sd).sum()), 2.0, 1e-3)


COMPUTED = Computed(
    _answer,
    {
        "mean": lambda: Outcome(moments(posterior(BayesParameters()))[0], 4.4, 1e-6),
        "variance": lambda: Outcome(moments(posterior(BayesParameters()))[1], 0.8, 1e-6),
        "grid": _grid,
        "two-peaks": lambda: Outcome(len(peaks(posterior(_distance()))), 2, 0),
        "left-peak": lambda: Outcome(float(peaks(posterior(_distance()))[0]), 2.06, 0.1),
        "right-peak": lambda: Outcome(float(peaks(posterior(_distance()))[-1]), 7.97, 0.1),
        "likelihood-area": _area,
    },
    Demonstration(BayesParameters(), show),
)
