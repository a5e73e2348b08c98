"""Lesson 11: a filter's response to a wild measurement depends on its noise model.

The prior is N(0, 1). Under Gaussian noise of scale s the posterior's mean is z / (1 + s^2). Under Cauchy noise it is
z - s Im w / Re w of Faddeeva's function w at (z + i s) / sqrt(2), since the density of z is Voigt's profile and the
mean is minus the derivative of its logarithm.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import wofz

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.experiments.trajectories.scene import FRAMES, REFERENCE_PX, true_path
from pftrack.filters.trajectories.whole import Method, Settings, follow, track_error
from pftrack.teaching.lessons.course.probability import normal
from pftrack.teaching.lessons.figure import Panel, Shown, ceiling, look
from pftrack.teaching.lessons.lesson import Answer, Computed, Demonstration, Outcome

LOOK = look(__file__)
LEAST_Z, MOST_Z = -5.0, 20.0
GRID: Floats = np.linspace(-10.0, 30.0, 4001)
"""Over which posteriors are integrated."""
CELL = 0.01
SEEN: NDArray[np.intp] = np.flatnonzero((GRID >= LEAST_Z) & (GRID <= MOST_Z + 1.0))[::5]
"""The part of it that is drawn."""
SURPRISES: Floats = np.linspace(LEAST_Z, MOST_Z, 251)
DRIVE = 1.0
"""Variance of the change of velocity on the track, px^2."""
PARTICLES = 500
RUNS, CHECKED_PARTICLES = 15, 2000
MEASURED_PX: Floats = REFERENCE_PX[:, None].copy()
TRUTH_PX: Floats = true_path(FRAMES)
OUTLIERS = 15, 45, 75, 90
"""Frames in which the track's measurement is far off."""
EXACTLY, NEARLY = 1e-6, 1e-3
"""Tolerances of integrals: in a check, and on a screen."""


class OutliersParameters(Parameters):
    """A measurement, and its assumed noise."""

    z: float = parameter(5, "Measurement z", within=(LEAST_Z, MOST_Z, 0.1))
    """The measurement; the prior expects it near 0."""
    scale: float = parameter(1, "Scale of the noise", within=(0.2, 5, 0.1))
    """Standard deviation of the Gaussian noise, and scale of the Cauchy noise; on the track in px."""


def show(parameters: OutliersParameters, seed: int) -> Shown:
    """Condition on one measurement, and follow a track, under either noise."""
    z, scale = parameters.z, parameters.scale
    gaussian, cauchy = (posterior(z, scale, heavy=heavy) for heavy in (False, True))
    means = gaussian_mean(z, scale), float(cauchy_mean(z, scale))
    paths = _filtered_positions("lg", scale, 0), _filtered_positions("lng", scale, seed)
    numbers = {"cauchy": (_mean(cauchy), means[1], NEARLY), "gaussian": (_mean(gaussian), means[0], NEARLY)}
    panels = (_posteriors(parameters, gaussian, cauchy, means), _influence(parameters, means), _track(paths))
    return LOOK.show(panels, numbers)


def posterior(z: float, scale: float, *, heavy: bool) -> Floats:
    """Return the posterior on the grid, given z = x + v, x ~ N(0, 1), and v Cauchy or Gaussian of a scale."""
    off = (GRID - z) / scale
    logs = -0.5 * GRID * GRID - (np.log1p(off * off) if heavy else 0.5 * off * off)
    density = np.exp(logs - logs.max())
    return np.asarray(density / (density.sum() * CELL))


def gaussian_mean(z: float, scale: float) -> float:
    """Return the posterior's mean under Gaussian noise."""
    return z / (1.0 + scale * scale)


def cauchy_mean(z: ArrayLike, scale: float) -> Floats:
    """Return the posterior's mean under Cauchy noise, at each z."""
    here = np.asarray(z, dtype=np.float64)
    profile = wofz((here + 1j * scale) / np.sqrt(2.0))
    return np.asarray(here - scale * profile.imag / profile.real)


def _mean(density: Floats) -> float:
    return float(density @ GRID * CELL)


@lru_cache(maxsize=64)
def _filtered_positions(method: Method, scale: float, seed: int) -> Floats:
    """Return the filtered positions (FRAMES, 2) on the reference track, px."""
    settings = Settings(noise=scale * scale, drive=DRIVE, lag=1, count=PARTICLES, seed=seed)
    return follow(method, MEASURED_PX, settings).filtered[:, 0]


def _posteriors(
    parameters: OutliersParameters,
    gaussian: Floats,
    cauchy: Floats,
    means: tuple[float, float],
) -> Panel:
    here = GRID[SEEN]
    return LOOK.draw(
        "posteriors",
        {
            "prior": (here, normal(here, 0.0, 1.0)),
            "gaussian": (here, gaussian[SEEN]),
            "gaussian mean": means[:1],
            "cauchy": (here, cauchy[SEEN]),
            "cauchy mean": means[1:],
        },
        turned=parameters,
        x=(LEAST_Z, MOST_Z + 1.0),
        y=(0.0, ceiling(max(float(gaussian.max()), float(cauchy.max())))),
        z=parameters.z,
        gaussian=means[0],
        cauchy=means[1],
        peaks=_peaks(cauchy),
    )


def _peaks(density: Floats) -> str:
    inside = density[1:-1]
    count = int(np.count_nonzero((inside > density[:-2]) & (inside > density[2:])))
    return "one peak" if count == 1 else f"{count} peaks"


def _influence(parameters: OutliersParameters, means: tuple[float, float]) -> Panel:
    scale, here = parameters.scale, np.array([parameters.z])
    straight = SURPRISES / (1.0 + scale * scale)
    bent = cauchy_mean(SURPRISES, scale)
    low, high = min(straight.min(), bent.min()), max(straight.max(), bent.max())
    return LOOK.draw(
        "influence",
        {
            "straight": (SURPRISES, straight),
            "straight here": (here, np.array(means[:1])),
            "bent": (SURPRISES, bent),
            "bent here": (here, np.array(means[1:])),
        },
        turned=parameters,
        x=(LEAST_Z, MOST_Z + 1.0),
        y=(1.1 * float(low), 1.1 * float(high)),
        most=bent.max(),
        where=SURPRISES[np.argmax(bent)],
    )


def _track(paths: tuple[Floats, Floats]) -> Panel:
    frames, measured, truth = np.arange(float(FRAMES)), REFERENCE_PX[:, 0], TRUTH_PX[:, 0]
    worst = max(OUTLIERS, key=lambda frame: abs(measured[frame] - truth[frame]))
    # E has the root of the sum of squares over T, not over the root of T.
    rms = [math.sqrt(FRAMES) * float(track_error(path, TRUTH_PX)) for path in paths]
    gaussian, cauchy = (path[:, 0] for path in paths)
    return LOOK.draw(
        "track",
        {
            "truth": (frames, truth),
            "measured": (frames, measured),
            "gaussian": (frames, gaussian),
            "cauchy": (frames, cauchy),
        },
        x=(0.0, FRAMES - 1.0),
        gaussian=rms[0],
        cauchy=rms[1],
        worst=worst,
        off=abs(measured[worst] - truth[worst]),
        gaussian_off=abs(float(gaussian[worst] - truth[worst])),
        cauchy_off=abs(float(cauchy[worst] - truth[worst])),
    )


def _answer(parameters: OutliersParameters, seed: int) -> Answer:
    del seed
    ours = _mean(posterior(parameters.z, parameters.scale, heavy=True))
    exact = float(cauchy_mean(parameters.z, parameters.scale))
    straight = gaussian_mean(parameters.z, parameters.scale)
    words = f"Integrated on a grid it is {ours:.4f}. Gaussian noise gives {straight:.4g}."
    return Answer(exact, ours, words)


def _at_20(*, heavy: bool, exact: float, tolerance: float) -> Outcome:
    return Outcome(_mean(posterior(20.0, 1.0, heavy=heavy)), exact, tolerance)


def _bend() -> Floats:
    """Return the mean under Cauchy noise against z, integrated on the grid."""
    return np.array([_mean(posterior(z, 1.0, heavy=True)) for z in SURPRISES])


def _greatest() -> Outcome:
    return Outcome(float(_bend().max()), 0.748, 0.001)


def _where_greatest() -> Outcome:
    return Outcome(float(SURPRISES[np.argmax(_bend())]), 2.5, 0.06)


def _formula() -> Outcome:
    return Outcome(float(np.abs(_bend() - cauchy_mean(SURPRISES, 1.0)).max()), 0.0, EXACTLY)


def _gaussian_track() -> Outcome:
    found = follow("lg", MEASURED_PX, Settings(noise=10.0, drive=DRIVE))
    return Outcome(float(track_error(found.filtered[:, 0], TRUTH_PX)), 0.338, 0.0005)


def _cauchy_track() -> Outcome:
    tracks = np.repeat(MEASURED_PX, RUNS, axis=1)
    found = follow("lng", tracks, Settings(noise=1.0, drive=DRIVE, count=CHECKED_PARTICLES, lag=1))
    return Outcome(float(np.median(track_error(found.filtered, TRUTH_PX[:, None]))), 0.134, 0.02)


COMPUTED = Computed(
    _answer,
    {
        "gaussian-at-20": lambda: _at_20(heavy=False, exact=10.0, tolerance=1e-6),
        "cauchy-at-20": lambda: _at_20(heavy=True, exact=0.1, tolerance=0.003),
        "largest-mean": _greatest,
        "where-largest": _where_greatest,
        "closed-form": _formula,
        "gaussian-track": _gaussian_track,
        "cauchy-track": _cauchy_track,
    },
    Demonstration(OutliersParameters(), show, random=True),
)
