"""Every public function of filters, particles, resampling and dynamics refuses what does not fit, in one sentence."""

from collections.abc import Callable
from importlib import import_module
from inspect import isclass
from pkgutil import iter_modules

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from pftrack import filters
from pftrack.core.model.model import LinearChain
from pftrack.core.numerics.random import Gaussian
from pftrack.filters import (
    adaptive,
    affine,
    agreement,
    auxiliary,
    beam,
    bootstrap,
    disturbances,
    dynamics,
    extended,
    kalman,
    particles,
    perspective,
    rao_blackwell,
    resampling,
    sequential,
    truncation,
    unscented,
    unscented_particle,
)
from pftrack.filters.dynamics import LinearDynamics, random_walk
from pftrack.filters.particles import ParticleSet
from pftrack.filters.trajectories import cloud as clouds
from pftrack.filters.trajectories import gaussian, whole
from pftrack.vision import matching
from pftrack.vision.likelihoods import chromaticity, counting, edges, histogram, points, template

SIZES = {"N": 6, "d": 4, "k": 2, "m": 3, "F": 5, "T": 7, "n": 8, "M": 6, "K": 9}
"""How long each side is; all differ, but for those that are the same."""

PARENTS = np.arange(SIZES["N"])
HOLD = np.linspace(-1.0, 0.0, SIZES["N"])
WALK = random_walk(SIZES["d"], 0.1)
PICTURE = np.random.default_rng(0).integers(0, 99, (16, 20, 3), np.uint8)
GREY = np.ascontiguousarray(PICTURE[:, :, 0])
TEMPLATES = template.cut(GREY, np.full((5, 2), 8.0), np.full((5, 2), 6))
WINDOW = histogram.Window(2, 2)


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


def cloud(states: np.ndarray) -> ParticleSet:
    return ParticleSet(states, np.zeros(len(states)), np.arange(len(states)))


def linear(transition: np.ndarray, offset: np.ndarray, noise: np.ndarray) -> LinearDynamics:
    return LinearDynamics(transition, offset, noise)


def within(function: Callable[..., object]) -> Callable[..., object]:
    """Return a function of bounds that takes their three arrays one by one."""
    return lambda mean, covariance, *bounds: function(mean, covariance, bounds)


GUARDS = {"alone", "answers"}
"""Modules that look at what a stranger's functions return, and take no arrays."""

Door = tuple[Callable[..., object], dict[str, str]]

MODEL = {"transition": "d d", "offset": "d", "noise": "d k"}
PRIOR = {"mean": "d", "covariance": "d d"}
SEEN = {"z": "m", "slope": "m d", "r": "m m"}
CAMERA = {"mean": "2 8", "covariance": "2 8 8"}
LAYER = {"points": "F 3", "reference": "2 4", "noise": "4"}
BOUNDS = PRIOR | {"rows": "m d", "low": "m", "high": "m"}
POSE = {"mean": "3", "covariance": "3 3", "measured": "6", "r": "6 6", "reference": "2 3"}


def layer(points: np.ndarray, reference: np.ndarray, noise: np.ndarray) -> affine.AffineLayer:
    return affine.AffineLayer(points, reference, noise)


def pinhole(points: np.ndarray, start: np.ndarray, noise: np.ndarray) -> perspective.PerspectiveLayer:
    return perspective.PerspectiveLayer(points, 500.0, start, noise_sd=noise)


def features(coordinates: np.ndarray, log_likelihoods: np.ndarray) -> adaptive.Features:
    parents = np.zeros(np.shape(coordinates)[::2], np.int64)
    drawn = adaptive.Draw(coordinates, np.zeros(len(coordinates), np.int64), parents)
    return adaptive.weigh(drawn, log_likelihoods, rng())


FEATURES = features(np.zeros((5, 4, 6)), np.zeros((5, 6)))
SEEN_BY = unscented.update_batch

CHAIN = {
    "mean": "d",
    "covariance": "d d",
    "transitions": "T d d",
    "offsets": "T d",
    "noises": "T d k",
    "measurements": "T m",
    "observations": "T m d",
    "covariances": "T m m",
}


def _draw(means: np.ndarray, covariances: np.ndarray, ratios: np.ndarray) -> object:
    projection = adaptive.Projection(means, covariances)
    return adaptive.draw(FEATURES, projection, ratios, 1.0, 6, rng())


def _rao_blackwell(values: np.ndarray) -> object:
    upper = layer(np.ones((5, 3)), np.ones((2, 4)), np.ones(4))
    return rao_blackwell.step(rao_blackwell.begin(upper, 6), upper, lambda _: values, rng())


def _auxiliary(states: np.ndarray, values: np.ndarray) -> object:
    counts = {"prediction_count": 3, "observation_count": 3}
    return auxiliary.step(cloud(states), WALK, lambda _: values, rng(), weights="corrected", **counts)


def _unscented_particle(states: np.ndarray, values: np.ndarray, z: np.ndarray, r: np.ndarray) -> object:
    return unscented_particle.step(
        cloud(states), WALK, lambda _: values, rng(), measurement=z, observe=lambda x: x[..., :3], noise_covariance=r
    )


def _follow_cloud(
    measurements: np.ndarray, v: np.ndarray, w: np.ndarray, means: np.ndarray, covariances: np.ndarray
) -> object:
    start, numbers = (means, covariances, np.zeros(9, np.int64)), np.arange(9)
    more = {"count": 4, "lag": 2, "by_mode": False, "numbers": numbers, "stream": (0, 0, 0)}
    return clouds.step(clouds.nothing(9), measurements, clouds.Law(v, w), start, **more)  # type: ignore[arg-type]


DOORS: dict[str, Door] = {
    "particles.ParticleSet": (ParticleSet, {"states": "N d", "log_weights": "N", "ancestors": "N"}),
    "particles.ParticleSet.uniform": (ParticleSet.uniform, {"states": "N d"}),
    **{
        f"resampling.{name}": (lambda w, it=it: it(rng(), w, 5), {"w": "N"})
        for name, it in resampling.RESAMPLERS.items()
    },
    "dynamics.LinearDynamics": (linear, MODEL),
    "dynamics.LinearDynamics.predict": (WALK.predict, {"states": "N d"}),
    "dynamics.LinearDynamics.diffuse": (lambda means: WALK.diffuse(rng(), means, PARENTS), {"means": "N d"}),
    "dynamics.autoregression": (
        dynamics.autoregression,
        {"newer": "d d", "older": "d d", "offset": "d", "noise": "d k"},
    ),
    "bootstrap.step": (lambda s, v: bootstrap.step(cloud(s), WALK, lambda _: v, rng()), {"s": "N d", "v": "N"}),
    "auxiliary.step": (_auxiliary, {"states": "N d", "values": "N"}),
    "unscented_particle.step": (_unscented_particle, {"states": "N d", "values": "N", "z": "m", "r": "m m"}),
    "unscented_particle.UnscentedParticles": (
        lambda means, c: unscented_particle.UnscentedParticles(means, HOLD, PARENTS, c),
        {"means": "N d", "c": "N d d"},
    ),
    "kalman.predict": (lambda mean, covariance: kalman.predict(Gaussian(mean, covariance), WALK), PRIOR),
    "kalman.update": (
        lambda mean, covariance, **s: kalman.update(Gaussian(mean, covariance), *s.values()),
        PRIOR | SEEN,
    ),
    "kalman.innovate": (
        lambda mean, covariance, **s: kalman.innovate(Gaussian(mean, covariance), *s.values()),
        PRIOR | SEEN,
    ),
    "kalman.condition": (
        lambda mean, covariance, z, p, slope, r: kalman.condition(Gaussian(mean, covariance), z, p, slope, r),
        PRIOR | {"z": "m", "p": "m", "slope": "m d", "r": "m m"},
    ),
    "extended.predict": (
        lambda mean, covariance, moved, slope, q: extended.predict(
            Gaussian(mean, covariance), lambda _: moved, lambda _: slope, q
        ),
        PRIOR | {"moved": "d", "slope": "d d", "q": "d d"},
    ),
    "extended.update": (
        lambda mean, covariance, z, h, slope, r: extended.update(
            Gaussian(mean, covariance), z, lambda _: h, lambda _: slope, r
        ),
        PRIOR | {"z": "m", "h": "m", "slope": "m d", "r": "m m"},
    ),
    "unscented.transform": (
        lambda m, c: unscented.transform(m, c, lambda x: x),
        {"m": "n d", "c": "n d d"},
    ),
    "unscented.predict": (
        lambda mean, covariance, q: unscented.predict(Gaussian(mean, covariance), lambda x: x, q),
        PRIOR | {"q": "d d"},
    ),
    "unscented.update": (
        lambda mean, covariance, z, r: unscented.update(Gaussian(mean, covariance), z, lambda x: x[..., :3], r),
        PRIOR | {"z": "m", "r": "m m"},
    ),
    "unscented.update_batch": (
        lambda m, c, z, r: SEEN_BY(m, c, z, lambda x: x[..., :3], r),
        {"m": "n d", "c": "n d d", "z": "m", "r": "m m"},
    ),
    "dynamics.augment": (lambda mean, covariance: dynamics.augment(Gaussian(mean, covariance), 2), PRIOR),
    "dynamics.smooth": (
        lambda paths: dynamics.smooth(dynamics.Lineage(paths), cloud(np.zeros((6, 4))), 0),
        {"paths": "T N d"},
    ),
    "disturbances.smooth_disturbances": (
        lambda **arrays: disturbances.smooth_disturbances(LinearChain(**arrays)),
        CHAIN,
    ),
    "adaptive.begin": (lambda positions: adaptive.begin(positions, 1.0, 6, rng()), {"positions": "F 2"}),
    "adaptive.draw": (_draw, {"means": "F 2 2", "covariances": "F 2 2 2", "ratios": "F"}),
    "adaptive.weigh": (features, {"coordinates": "F 4 N", "log_likelihoods": "F N"}),
    "affine.AffineLayer": (layer, LAYER),
    "affine.AffineLayer.update": (
        lambda p, v: (it := layer(np.ones((5, 3)), np.ones((2, 4)), np.ones(4))).update(it.begin(), p, v, rng()),
        {"p": "F 2", "v": "F 2"},
    ),
    "affine.entries": (affine.entries, CAMERA),
    "affine.extended_step": (
        lambda mean, covariance, measured, r, reference: affine.extended_step(
            Gaussian(mean, covariance), measured, r, reference, 0.1
        ),
        POSE,
    ),
    "affine.particle": (
        lambda p, measured, r, reference: affine.particle(p, measured, r, reference, 0.1, rng(), 6),
        {"p": "N 3", "measured": "6", "r": "6 6", "reference": "2 3"},
    ),
    "perspective.PerspectiveLayer": (pinhole, {"points": "F 3", "start": "6", "noise": "6"}),
    "rao_blackwell.step": (_rao_blackwell, {"values": "F N"}),
    "chromaticity.log_likelihood": (
        lambda places: chromaticity.log_likelihood(
            PICTURE, places, chromaticity.ColourModel((0.5, 0.2), (0.1, 0.1)), 0.1
        ),
        {"places": "N d"},
    ),
    "beam.Beam": (lambda w, parents: beam.Beam(tuple("abcdef"), w, parents), {"w": "6", "parents": "6"}),
    "beam.select_best": (
        lambda w, parents: beam.select_best("abcdef", w, parents, 2, lambda one, other: one == other),
        {"w": "6", "parents": "6"},
    ),
    "agreement.agreeing": (
        lambda **arrays: agreement.agreeing(*arrays.values(), 1.0, 1.0),
        {"places": "F N 2", "w": "F N", "at": "F 2", "doubts": "F"},
    ),
    "gaussian.Gaussians": (gaussian.Gaussians, {"means": "T K 2 2", "covariances": "T K 3", "drives": "T K"}),
    "gaussian.begin": (
        lambda means, covariances, measurements: gaussian.begin(means, covariances, measurements, 1.0),
        {"means": "K 2 2", "covariances": "K 3", "measurements": "K 2"},
    ),
    "gaussian.step": (
        lambda measurements, v, w: gaussian.step(gaussian.nothing(SIZES["K"]), measurements, v, w, lag=2),
        {"measurements": "K 2", "v": "K", "w": "K"},
    ),
    "cloud.step": (_follow_cloud, {"measurements": "9 2", "v": "9", "w": "9", "means": "9 2 2", "covariances": "9 3"}),
    "whole.follow": (
        lambda paths, v, w: whole.follow("lg", paths, whole.Settings(), noise=v, drive=w),
        {"paths": "T K 2", "v": "K", "w": "K"},
    ),
    "whole.likelihood_surface": (
        lambda measurements, grid: whole.likelihood_surface("lg", measurements, whole.Settings(), grid),
        {"measurements": "T 2", "grid": "m"},
    ),
    "histogram.shares": (lambda place: histogram.shares(PICTURE, place, WINDOW, "hsv"), {"place": "2"}),
    "histogram.similarity": (
        lambda place, model: histogram.similarity(PICTURE, place, WINDOW, "hsv", model),
        {"place": "2", "model": "110"},
    ),
    "histogram.log_likelihood": (
        lambda places, model: histogram.log_likelihood(PICTURE, places, WINDOW, "hsv", model),
        {"places": "N d", "model": "110"},
    ),
    "edges.log_likelihood": (
        lambda places, outline: edges.log_likelihood(PICTURE, places, outline),
        {"places": "N d", "outline": "F 2"},
    ),
    "histogram.rho_map": (lambda model: histogram.rho_map(PICTURE, WINDOW, "hsv", model, 2), {"model": "110"}),
    "histogram.background_of": (
        lambda p, model: histogram.background_of(PICTURE, p, (1, 1), "hsv", model, weigh=True, contrast=0.1),
        {"p": "2", "model": "110"},
    ),
    "template.cut": (lambda places: template.cut(GREY, places, np.full((5, 2), 6)), {"places": "5 2"}),
    "template.renew": (lambda places: template.renew(TEMPLATES, GREY, places, 0.5), {"places": "5 2"}),
    "template.correlations": (lambda places: template.correlations(GREY, places, TEMPLATES), {"places": "5 N 2"}),
    "template.log_likelihood": (lambda places: template.log_likelihood(GREY, places, TEMPLATES), {"places": "5 N 2"}),
}
"""Public functions for the interpreter, with the sides of their arrays; numbers for which they get are drawn."""

LOOPS: dict[str, Door] = {
    "particles.moments": (particles.moments, {"states": "N d", "weights": "N"}),
    "dynamics.predict": (dynamics.predict, {"states": "N d", "transition": "d d", "offset": "d"}),
    "dynamics.diffuse": (
        lambda means, noise, normals: dynamics.diffuse(means, PARENTS, noise, normals),
        {"means": "N d", "noise": "d k", "normals": "k M"},
    ),
    "kalman.condition_on_innovation": (
        kalman.condition_on_innovation,
        PRIOR | {"z": "m", "slope": "m d", "r": "m m"},
    ),
    "sequential.condition": (sequential.condition, PRIOR | {"z": "m", "slope": "m d", "variances": "m"}),
    "sequential.decorrelate": (sequential.decorrelate, {"z": "m", "slope": "m d", "r": "m m"}),
    "sequential.predict_second_order": (
        sequential.predict_second_order,
        {"mean": "d", "covariance": "d d", "noise_sd": "2"},
    ),
    "affine.predict": (affine.predict, CAMERA | {"noise": "4"}),
    "affine.project": (affine.project, CAMERA | {"points": "F 3"}),
    "affine.observe": (
        affine.observe,
        CAMERA | {"points": "F 3", "positions": "F 2", "variances": "F 2"},
    ),
    "perspective.features": (lambda q, p: perspective.features(q, p, 500.0), {"q": "6", "p": "F 3"}),
    "perspective.project": (
        lambda mean, covariance, p, c: perspective.project(mean, covariance, p, 500.0, c),
        {"mean": "12", "covariance": "12 12", "p": "F 3", "c": "2"},
    ),
    "agreement.fit_gain": (agreement.fit_gain, {"slope": "m d", "w": "m"}),
    "agreement.excess_variance": (
        agreement.excess_variance,
        {"z": "m", "slope": "m d", "v": "m", "shown": "m"},
    ),
    "agreement.fit_covariance": (agreement.fit_covariance, {"gain": "d m", "v": "m"}),
    "truncation.least_room": (within(truncation.least_room), BOUNDS),
    "truncation.log_share": (within(truncation.log_share), BOUNDS),
    "truncation.truncate": (within(truncation.truncate), BOUNDS),
    "gaussian.log_likelihoods": (
        lambda track, v, w: gaussian.log_likelihoods(track, v, w, 1.0),
        {"track": "T 2", "v": "m", "w": "m"},
    ),
    "gaussian.locate": (lambda nodes, counts: gaussian.locate(nodes, counts, True), {"nodes": "n 2", "w": "n"}),
    "counting.windows_around": (
        lambda *sides: counting.windows_around(*sides, 20, 16),
        {"columns": "N", "rows": "N", "across": "N", "down": "N"},
    ),
    "counting.coefficients": (
        lambda windows, roots, weights: counting.coefficients(
            PICTURE[:, :, 0], windows.astype(np.int64), roots, weights, False, (1, 1)
        ),
        {"windows": "N 8", "roots": "110", "weights": "110"},
    ),
    "template.ncc": (
        lambda places, pixels: template.ncc(GREY, places, pixels.astype(np.float32), TEMPLATES.sizes),
        {"places": "5 N 2", "pixels": "180"},
    ),
    "points.log_likelihood": (points.log_likelihood, {"x": "F N 2", "y": "F 2", "s": "F"}),
}
"""Public functions of compiled loops, which look at sizes."""

MISSING = {
    "log_weights",
    "w",
    "values",
    "v",
    "log_likelihoods",
    "measurements",
    "c",
    "paths",
    "coordinates",
    "means",
} | {"covariances", "places", "place", "drives", "at", "doubts"}
"""What may be NaN, or is not looked through since that takes longer than a step may."""

WITHOUT_ARRAYS = {
    *("resampling.decide", "resampling.parents", "resampling.systematic_parents"),
    *("kalman.expected_coverage", "dynamics.random_walk", "dynamics.constant_velocity"),
    *("particles.normalise", "particles.count_unique", "particles.evaluate"),
    *("auxiliary.correction", "auxiliary.exceeds", "auxiliary.hard", "auxiliary.soft", "rao_blackwell.begin"),
    *("dynamics.augment_dynamics", "dynamics.block", "dynamics.begin_lineage", "dynamics.extend_lineage"),
    *("adaptive.hold", "adaptive.orphan", "adaptive.propagate", "adaptive.surviving"),
    *("beam.backtrack", "agreement.middle", "truncation.mills_ratio", "gaussian.logs_mode", "whole.track_error"),
    *("gaussian.nothing", "gaussian.without", "gaussian.select", "gaussian.smooth", "whole.beginnings"),
    *("cloud.nothing", "cloud.without", "cloud.select", "counting.bin_table", "counting.bin_colours"),
    *("counting.assign_bins", "counting.count_window", "counting.shift"),
    *("template.score", "template.likeness", "template.luma", "template.scaled_sizes", "histogram.fit"),
    *("histogram.roots_of", "histogram.similarities"),
}
"""What takes only numbers, one array of any length, or what other doors have let in."""


LARGE = LinearDynamics(np.eye(4) * 1e308, np.zeros(4), np.zeros((4, 1)))
FIFTY = np.random.default_rng(1).normal(size=(50, 4))


def weighed(values: object) -> object:
    return bootstrap.step(ParticleSet.uniform(FIFTY), WALK, lambda _: values, rng())  # type: ignore[return-value, arg-type]


SENTENCES: dict[str, tuple[Callable[[], object], str]] = {
    "dynamics of another dimension": (
        lambda: bootstrap.step(ParticleSet.uniform(FIFTY), random_walk(1, 0.1), lambda x: x.sum(1), rng()),
        r"states must be \(N, d\) with N = 50 and d = 1, got \(50, 4\)",
    ),
    "ten values": (lambda: weighed(np.zeros(10)), r"log_likelihood must be \(N\) with N = 50, got \(10,\)"),
    "a column": (lambda: weighed(np.zeros((50, 1))), r"log_likelihood must be \(N\), got \(50, 1\)"),
    "a list": (lambda: weighed([0.0] * 50), "log_likelihood must be an array .* got list"),
    "a strange ancestor": (lambda: WALK.diffuse(rng(), FIFTY, np.array([50])), "ancestors between 0 and N - 1"),
    **{
        f"{name}, {what}": (lambda it=it, w=w: it(rng(), w, 5), "got")
        for name, it in resampling.RESAMPLERS.items()
        for what, w in {
            "NaN first": np.array([np.nan, 0.0]),
            "NaN last": np.array([0.0, np.nan]),
            "+inf": np.array([0.0, np.inf]),
            "nothing possible": np.full(3, -np.inf),
            "empty": np.zeros(0),
        }.items()
    },
    "no weights": (lambda: particles.normalise(np.zeros(0)), "at least one log weight, got none"),
    "no parents": (lambda: resampling.systematic(rng(), np.zeros(3), 0), "count must be at least 1, got 0"),
    "an infinite state": (
        lambda: ParticleSet.uniform(np.where(FIFTY > 2.0, np.inf, FIFTY)),
        "states must be finite, got NaN or infinity",
    ),
    "dynamics that overflow": (
        lambda: bootstrap.step(ParticleSet.uniform(np.full((50, 4), 9.0)), LARGE, lambda x: x[:, 0], rng()),
        "states must be finite, got NaN or infinity",
    ),
    "a list in a compiled loop": (
        lambda: particles.normalise([0.0, 0.0]),  # type: ignore[arg-type]
        "normalise takes arrays and numbers, got list; turn lists into arrays",
    ),
    "a matrix in a compiled loop": (
        lambda: particles.moments(FIFTY, FIFTY),
        "moments takes arrays and numbers of other types or dimensions, got 2-D float64, 2-D float64",
    ),
    "a colour picture of numbers": (
        lambda: matching.small_grey(PICTURE.astype(float)),  # type: ignore[arg-type]
        "the picture must be an array .* of uint8, got an array of float64",
    ),
    "a strange space": (
        lambda: counting.bin_table("cmyk"),  # type: ignore[arg-type]
        "a space of colour is one of hsv, lab, chromaticity, got 'cmyk'",
    ),
    "a window beyond the picture": (
        lambda: counting.assign_bins(PICTURE, counting.bin_table("hsv"), 0, 0, 21, 16),
        "expected a rectangle within the picture, got",
    ),
    "half a window": (lambda: counting.shift(np.zeros(4, np.int64), 1, 1), "expected a window of 8 numbers, got"),
    "no parts": (
        lambda: counting.count_window(PICTURE, 1.0, 1.0, 1, 1, False, (0, 1), counting.bin_table("hsv")),
        "expected a part at least",
    ),
    "a window without a size": (
        lambda: histogram.shares(PICTURE, np.ones(2), histogram.Window(-1, 2), "hsv"),
        "reach_across_px must be at least 0, got -1",
    ),
    "half a cloud": (
        lambda: clouds.Cloud(
            np.full((1, 3), 7), *(np.zeros(0) for _ in range(2)), np.zeros(0), np.zeros((0, 2)), np.zeros(1)
        ),
        "a cloud needs nodes",
    ),
    "a sigma of NaN": (lambda: auxiliary.soft(np.array([np.nan]), 1.0, 2.0, 5), "got none or NaN"),
}
"""What was read beyond its end or taken for numbers, and what is said of it now."""


@pytest.mark.parametrize("name", SENTENCES)
def test_both_sides_are_named(name: str) -> None:
    """One sentence says what is expected and what was got."""
    call, sentence = SENTENCES[name]
    with pytest.raises((ValueError, TypeError), match=sentence):
        call()


def made(sides: str) -> np.ndarray:
    """Return positive numbers, an identity in the last two sides where these are equal."""
    shape = [SIZES.get(side) or int(side) for side in sides.split()]
    if len(shape) > 1 and shape[-1] == shape[-2]:
        return np.broadcast_to(np.eye(shape[-1]), shape).copy()
    return np.linspace(0.1, 0.9, int(np.prod(shape))).reshape(shape)


INDICES = {"ancestors", "parents"}


def arrays_of(door: Door) -> dict[str, np.ndarray]:
    return {name: PARENTS if name in INDICES else made(sides) for name, sides in door[1].items()}


def test_every_public_function_is_asked() -> None:
    """What a module lists is a door, a function of loops, or takes no arrays that have to fit together."""
    found = [each.name for each in iter_modules(filters.__path__) if not each.ispkg and each.name not in GUARDS]
    modules = {name: import_module(f"pftrack.filters.{name}") for name in found}
    others = gaussian, clouds, whole, counting, edges, histogram, template
    modules |= {module.__name__.rpartition(".")[2]: module for module in others}
    public = {
        f"{module}.{name}"
        for module, where in modules.items()
        for name, it in vars(where).items()
        if callable(it) and not isclass(it) and getattr(it, "__module__", "") == where.__name__ and name[0] != "_"
    }
    assert public - DOORS.keys() - LOOPS.keys() == WITHOUT_ARRAYS


@pytest.mark.parametrize("name", [*DOORS, *LOOPS])
def test_what_fits_is_let_in(name: str) -> None:
    """Arrays of the sides that are written down are accepted."""
    door = {**DOORS, **LOOPS}[name]
    door[0](**arrays_of(door)) if name not in LOOPS else door[0](*arrays_of(door).values())


def _resized(draw: st.DrawFn, door: Door, name: str, array: np.ndarray) -> np.ndarray:
    """Return an array with a side that no longer agrees with that of another."""
    sides = door[1][name].split()
    every = [side for other in door[1].values() for side in other.split()]
    fixed = [axis for axis, side in enumerate(sides) if side.isdecimal() or every.count(side) > 1]
    assume(fixed)
    axis = draw(st.sampled_from(fixed))
    return np.take(array, range(array.shape[axis] - 1), axis) if draw(st.booleans()) else np.repeat(array, 2, axis)


LISTS_TOO = {"dynamics.LinearDynamics.predict", "extended.update"} | {
    f"kalman.{name}" for name in ("predict", "update", "condition")
}
"""Steps, which take a list as well: they look at arrays only where something fails."""

WRONG = ("resized", "deeper", "flat", "list", "text", "complex", "empty", "nan")


@settings(max_examples=150)
@given(st.data())
def test_what_does_not_fit_is_refused(data: st.DataObject) -> None:
    """Another size, number of axes or kind of numbers, nothing at all and NaN give one sentence of what was got."""
    place = data.draw(st.sampled_from(list(DOORS)))
    door = DOORS[place]
    given_arrays = arrays_of(door)
    name, wrong = data.draw(st.sampled_from(list(given_arrays))), data.draw(st.sampled_from(WRONG))
    array = given_arrays[name]
    assume(not (wrong == "nan" and (name in MISSING or array.dtype.kind != "f")))
    assume(not (wrong == "flat" and array.ndim == 1))
    assume(not (wrong == "nan" and door[0] == WALK.predict))
    assume(not (wrong == "list" and place in LISTS_TOO))
    made_wrong: dict[str, Callable[[], object]] = {
        "resized": lambda: _resized(data.draw, door, name, array),
        "deeper": lambda: array[..., None],
        "flat": array.ravel,
        "list": array.tolist,
        "text": lambda: array.astype(str),
        "complex": lambda: array.astype(complex),
        "empty": lambda: array[:0],
        "nan": lambda: np.full_like(array, np.nan),
    }
    with pytest.raises((ValueError, TypeError)) as refused:
        door[0](**{**given_arrays, name: made_wrong[wrong]()})
    assert "\n" not in str(refused.value)
    assert "got" in str(refused.value)


@pytest.mark.parametrize("place", sorted(LISTS_TOO - {"dynamics.LinearDynamics.predict"}))
def test_what_is_not_looked_at_beforehand_is_refused_as_well(place: str) -> None:
    """Each array of a step in turn: too long, of one more axis, complex, empty, and not finite."""
    door = DOORS[place]
    for name, array in arrays_of(door).items():
        nothing = np.full_like(array, np.nan)
        for each in (np.repeat(array, 2, 0), array[:1], array[..., None], array.astype(complex), array[:0], nothing):
            with pytest.raises((ValueError, TypeError), match="got"):
                door[0](**{**arrays_of(door), name: each})


@given(st.data())
def test_compiled_loops_look_at_sizes(data: st.DataObject) -> None:
    """A function of compiled loops reads nothing beyond the end of an array."""
    door = LOOPS[data.draw(st.sampled_from(list(LOOPS)))]
    given_arrays = arrays_of(door)
    name = data.draw(st.sampled_from(list(given_arrays)))
    wrong = _resized(data.draw, door, name, given_arrays[name])
    with pytest.raises(ValueError, match="expected"):
        door[0](*{**given_arrays, name: np.ascontiguousarray(wrong)}.values())
