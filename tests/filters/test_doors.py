"""Every public function of filters, particles, resampling and dynamics refuses what does not fit, in one sentence."""

from collections.abc import Callable
from functools import partial
from importlib import import_module
from inspect import isclass
from operator import attrgetter, eq
from pkgutil import iter_modules
from typing import Any

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
WALK = random_walk(SIZES["d"], 0.1)
PICTURE = np.random.default_rng(0).integers(0, 99, (16, 20, 3), np.uint8)
PICTURE.flags.writeable = False  # as pictures of sources are, for which these functions are compiled
GREY = np.ascontiguousarray(PICTURE[:, :, 0])
TEMPLATES = template.cut(GREY, np.full((5, 2), 8.0), np.full((5, 2), 6))
WINDOW = histogram.Window(2, 2)

GUARDS = {"alone", "answers"}
"""Modules that look at what a stranger's functions return, and take no arrays."""

FOUND = [f"filters.{it.name}" for it in iter_modules(filters.__path__) if it.name not in GUARDS and not it.ispkg]
OTHERS = [f"filters.trajectories.{name}" for name in ("gaussian", "cloud", "whole")]
OTHERS += [f"vision.likelihoods.{name}" for name in ("counting", "edges", "histogram", "template")]
MODULES = {name.rpartition(".")[2]: import_module(f"pftrack.{name}") for name in FOUND + OTHERS}

Call = Callable[..., Any]


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


def cloud(states: np.ndarray) -> ParticleSet:
    return ParticleSet(states, np.zeros(len(states)), np.arange(len(states)))


def belief(function: Call, *more: object) -> Call:
    """Return a function of a Gaussian that takes its mean and covariance one by one."""
    return lambda mean, covariance, *arrays: function(Gaussian(mean, covariance), *arrays, *more)


def followed(function: Call, *more: object) -> Call:
    """Return a function of arrays alone, which are followed by the same arguments each time."""
    return lambda *arrays: function(*arrays, *more)


def within(function: Call) -> Call:
    """Return a function of bounds that takes their three arrays one by one."""
    return lambda mean, covariance, *bounds: function(mean, covariance, bounds)


PRIOR = "mean: d, covariance: d d"
CAMERA = "mean: 2 8, covariance: 2 8 8"
BOUNDS = f"{PRIOR}, rows: m d, low: m, high: m"
OBSERVED = "measurements: T m, observations: T m d, covariances: T m m"
MEASURED = "measured: 6, r: 6 6, reference: 2 3"


def features(coordinates: np.ndarray, log_likelihoods: np.ndarray) -> adaptive.Features:
    parents = np.zeros(np.shape(coordinates)[::2], np.int64)
    drawn = adaptive.Draw(coordinates, np.zeros(len(coordinates), np.int64), parents)
    return adaptive.weigh(drawn, log_likelihoods, rng())


FEATURES = features(np.zeros((5, 4, 6)), np.zeros((5, 6)))
LAYER = affine.AffineLayer(np.ones((5, 3)), np.ones((2, 4)), np.ones(4))
BEGUN = rao_blackwell.begin(LAYER, 6)
WHOLE = whole.Settings()


def three(states: np.ndarray) -> np.ndarray:
    return states[..., :3]


def _draw(means: np.ndarray, covariances: np.ndarray, ratios: np.ndarray) -> object:
    return adaptive.draw(FEATURES, adaptive.Projection(means, covariances), ratios, 1.0, 6, rng())


def _auxiliary(states: np.ndarray, values: np.ndarray) -> object:
    counts: Any = {"prediction_count": 3, "observation_count": 3}
    return auxiliary.step(cloud(states), WALK, lambda _: values, rng(), weights="corrected", **counts)


def _unscented_particle(states: np.ndarray, values: np.ndarray, z: np.ndarray, r: np.ndarray) -> object:
    given: Any = {"measurement": z, "observe": three, "noise_covariance": r}
    return unscented_particle.step(cloud(states), WALK, lambda _: values, rng(), **given)


def _follow_cloud(seen: np.ndarray, v: np.ndarray, w: np.ndarray, means: np.ndarray, covariances: np.ndarray) -> object:
    start, numbers = (means, covariances, np.zeros(9, np.int64)), np.arange(9)
    more = {"count": 4, "lag": 2, "by_mode": False, "numbers": numbers, "stream": (0, 0, 0)}
    return clouds.step(clouds.nothing(9), seen, clouds.Law(v, w), start, **more)  # type: ignore[arg-type]


Door = tuple[Call, dict[str, list[str]]]
Entry = str | tuple[str, Call]


def doors(table: dict[str, Entry]) -> dict[str, Door]:
    """Return functions with the sides of their arrays; one that is not given is that of the name."""
    found = {}
    for name, entry in table.items():
        module, _, path = name.partition(".")
        sides, call = (entry, attrgetter(path)(MODULES[module])) if isinstance(entry, str) else entry
        each = (one.partition(": ") for one in sides.split(", "))
        found[name] = call, {array: shape.split() for array, _, shape in each}
    return found


COLOURS = chromaticity.ColourModel((0.5, 0.2), (0.1, 0.1))
TAKEN: dict[str, Entry] = {
    "particles.ParticleSet": "states: N d, log_weights: N, ancestors: N",
    "particles.ParticleSet.uniform": "states: N d",
    **{f"resampling.{name}": ("w: N", lambda w, it=it: it(rng(), w, 5)) for name, it in resampling.RESAMPLERS.items()},
    "dynamics.LinearDynamics": "transition: d d, offset: d, noise: d k",
    "dynamics.LinearDynamics.predict": ("states: N d", WALK.predict),
    "dynamics.LinearDynamics.diffuse": ("means: N d", lambda means: WALK.diffuse(rng(), means, PARENTS)),
    "dynamics.autoregression": "newer: d d, older: d d, offset: d, noise: d k",
    "bootstrap.step": ("s: N d, v: N", lambda s, v: bootstrap.step(cloud(s), WALK, lambda _: v, rng())),
    "auxiliary.step": ("states: N d, values: N", _auxiliary),
    "unscented_particle.step": ("states: N d, values: N, z: m, r: m m", _unscented_particle),
    "unscented_particle.UnscentedParticles": (
        "means: N d, c: N d d",
        lambda means, c: unscented_particle.UnscentedParticles(means, np.linspace(-1.0, 0.0, 6), PARENTS, c),
    ),
    "kalman.predict": (PRIOR, belief(kalman.predict, WALK)),
    "kalman.update": (f"{PRIOR}, z: m, slope: m d, r: m m", belief(kalman.update)),
    "kalman.innovate": (f"{PRIOR}, z: m, slope: m d, r: m m", belief(kalman.innovate)),
    "kalman.condition": (f"{PRIOR}, z: m, p: m, slope: m d, r: m m", belief(kalman.condition)),
    "extended.predict": (
        f"{PRIOR}, moved: d, slope: d d, q: d d",
        belief(lambda it, moved, slope, q: extended.predict(it, lambda _: moved, lambda _: slope, q)),
    ),
    "extended.update": (
        f"{PRIOR}, z: m, h: m, slope: m d, r: m m",
        belief(lambda it, z, h, slope, r: extended.update(it, z, lambda _: h, lambda _: slope, r)),
    ),
    "unscented.transform": ("m: n d, c: n d d", lambda m, c: unscented.transform(m, c, lambda x: x)),
    "unscented.predict": (f"{PRIOR}, q: d d", belief(lambda it, q: unscented.predict(it, lambda x: x, q))),
    "unscented.update": (f"{PRIOR}, z: m, r: m m", belief(lambda it, z, r: unscented.update(it, z, three, r))),
    "unscented.update_batch": (
        "m: n d, c: n d d, z: m, r: m m",
        lambda m, c, z, r: unscented.update_batch(m, c, z, three, r),
    ),
    "dynamics.augment": (PRIOR, belief(dynamics.augment, 2)),
    "dynamics.smooth": ("paths: T N d", lambda it: dynamics.smooth(dynamics.Lineage(it), cloud(np.zeros((6, 4))), 0)),
    "disturbances.smooth_disturbances": (
        f"{PRIOR}, transitions: T d d, offsets: T d, noises: T d k, {OBSERVED}",
        lambda *arrays: disturbances.smooth_disturbances(LinearChain(*arrays)),
    ),
    "adaptive.begin": ("positions: F 2", lambda positions: adaptive.begin(positions, 1.0, 6, rng())),
    "adaptive.draw": ("means: F 2 2, covariances: F 2 2 2, ratios: F", _draw),
    "adaptive.weigh": ("coordinates: F 4 N, log_likelihoods: F N", features),
    "affine.AffineLayer": "points: F 3, reference: 2 4, noise: 4",
    "affine.AffineLayer.update": ("p: F 2, v: F 2", lambda p, v: LAYER.update(LAYER.begin(), p, v, rng())),
    "affine.entries": CAMERA,
    "affine.extended_step": (f"mean: 3, covariance: 3 3, {MEASURED}", belief(affine.extended_step, 0.1)),
    "affine.particle": (f"p: N 3, {MEASURED}", lambda *arrays: affine.particle(*arrays, 0.1, rng(), 6)),
    "perspective.PerspectiveLayer": (
        "points: F 3, start: 6, noise: 6",
        lambda points, start, noise: perspective.PerspectiveLayer(points, 500.0, start, noise_sd=noise),
    ),
    "rao_blackwell.step": ("v: F N", lambda v: rao_blackwell.step(BEGUN, LAYER, lambda _: v, rng())),
    "chromaticity.log_likelihood": ("at: N d", lambda at: chromaticity.log_likelihood(PICTURE, at, COLOURS, 0.1)),
    "beam.Beam": ("w: 6, parents: 6", lambda w, parents: beam.Beam(tuple("abcdef"), w, parents)),
    "beam.select_best": ("w: 6, parents: 6", followed(partial(beam.select_best, "abcdef"), 2, eq)),
    "agreement.agreeing": ("places: F N 2, w: F N, at: F 2, doubts: F", followed(agreement.agreeing, 1.0, 1.0)),
    "gaussian.Gaussians": "means: T K 2 2, covariances: T K 3, drives: T K",
    "gaussian.begin": ("means: K 2 2, covariances: K 3, measurements: K 2", followed(gaussian.begin, 1.0)),
    "gaussian.step": ("measurements: K 2, v: K, w: K", partial(gaussian.step, gaussian.nothing(SIZES["K"]), lag=2)),
    "cloud.step": ("measurements: 9 2, v: 9, w: 9, means: 9 2 2, covariances: 9 3", _follow_cloud),
    "whole.follow": ("at: T K 2, v: K, w: K", lambda at, v, w: whole.follow("lg", at, WHOLE, noise=v, drive=w)),
    "whole.likelihood_surface": ("at: T 2, grid: m", lambda at, grid: whole.likelihood_surface("lg", at, WHOLE, grid)),
    "histogram.shares": ("place: 2", lambda place: histogram.shares(PICTURE, place, WINDOW, "hsv")),
    "histogram.similarity": ("at: 2, m: 110", lambda at, m: histogram.similarity(PICTURE, at, WINDOW, "hsv", m)),
    "histogram.log_likelihood": (
        "at: N d, m: 110",
        lambda at, m: histogram.log_likelihood(PICTURE, at, WINDOW, "hsv", m),
    ),
    "edges.log_likelihood": ("places: N d, outline: F 2", partial(edges.log_likelihood, PICTURE)),
    "histogram.rho_map": ("model: 110", lambda model: histogram.rho_map(PICTURE, WINDOW, "hsv", model, 2)),
    "histogram.background_of": (
        "p: 2, model: 110",
        lambda p, model: histogram.background_of(PICTURE, p, (1, 1), "hsv", model, weigh=True, contrast=0.1),
    ),
    "template.cut": ("places: 5 2", lambda places: template.cut(GREY, places, np.full((5, 2), 6))),
    "template.renew": ("places: 5 2", lambda places: template.renew(TEMPLATES, GREY, places, 0.5)),
    "template.correlations": ("places: 5 N 2", lambda places: template.correlations(GREY, places, TEMPLATES)),
    "template.log_likelihood": ("places: 5 N 2", lambda places: template.log_likelihood(GREY, places, TEMPLATES)),
}
DOORS = doors(TAKEN)
"""Public functions for the interpreter, with the sides of their arrays; numbers for which they get are drawn."""

COMPILED: dict[str, Entry] = {
    "particles.moments": "states: N d, weights: N",
    "dynamics.predict": "states: N d, transition: d d, offset: d",
    "dynamics.diffuse": ("x: N d, b: d k, z: k M", lambda x, b, z: dynamics.diffuse(x, PARENTS, b, z)),
    "kalman.condition_on_innovation": f"{PRIOR}, z: m, slope: m d, r: m m",
    "sequential.condition": f"{PRIOR}, z: m, slope: m d, variances: m",
    "sequential.decorrelate": "z: m, slope: m d, r: m m",
    "sequential.predict_second_order": "mean: d, covariance: d d, noise_sd: 2",
    "affine.predict": f"{CAMERA}, noise: 4",
    "affine.project": f"{CAMERA}, points: F 3",
    "affine.observe": f"{CAMERA}, points: F 3, positions: F 2, variances: F 2",
    "perspective.features": ("q: 6, p: F 3", followed(perspective.features, 500.0)),
    "perspective.project": ("m: 12, c: 12 12, p: F 3, o: 2", lambda m, c, p, o: perspective.project(m, c, p, 500.0, o)),
    "agreement.fit_gain": "slope: m d, w: m",
    "agreement.excess_variance": "z: m, slope: m d, v: m, shown: m",
    "agreement.fit_covariance": "gain: d m, v: m",
    "truncation.least_room": (BOUNDS, within(truncation.least_room)),
    "truncation.log_share": (BOUNDS, within(truncation.log_share)),
    "truncation.truncate": (BOUNDS, within(truncation.truncate)),
    "gaussian.log_likelihoods": ("track: T 2, v: m, w: m", followed(gaussian.log_likelihoods, 1.0)),
    "gaussian.locate": (
        "nodes: n 2, w: n",
        lambda nodes, w: gaussian.locate(nodes.astype(np.float32), w.astype(np.uint16), True),
    ),
    "counting.windows_around": ("columns: N, rows: N, across: N, down: N", followed(counting.windows_around, 20, 16)),
    "counting.coefficients": (
        "windows: N 8, roots: 110, weights: 110",
        lambda windows, *both: counting.coefficients(GREY, windows.astype(np.int64), *both, False, (1, 1)),
    ),
    "template.ncc": (
        "places: 5 N 2, pixels: 180",
        lambda places, pixels: template.ncc(GREY, places, pixels.astype(np.float32), TEMPLATES.sizes),
    ),
    "points.log_likelihood": ("x: F N 2, y: F 2, s: F", points.log_likelihood),
}
LOOPS = doors(COMPILED)
"""Public functions of compiled loops, which look at sizes."""

MISSING = {
    *("log_weights", "w", "values", "v", "log_likelihoods", "measurements", "c", "paths", "coordinates", "means"),
    *("covariances", "places", "place", "drives", "at", "doubts"),
}
"""What may be NaN, or is not looked through since that takes longer than a step may."""

WITHOUT_ARRAYS = {
    *("resampling.decide", "resampling.parents", "resampling.systematic_parents"),
    *("dynamics.random_walk", "dynamics.constant_velocity"),
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
HSV, SEVEN = counting.bin_table("hsv"), np.full((1, 3), 7)
NOT_WEIGHTS = [[np.nan, 0.0], [0.0, np.nan], [0.0, np.inf], [-np.inf] * 3, []]


def weighed(values: object, states: np.ndarray = FIFTY, model: LinearDynamics = WALK) -> object:
    return bootstrap.step(ParticleSet.uniform(states), model, lambda _: values, rng())  # type: ignore[return-value, arg-type]


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda: weighed(FIFTY[:, 0], model=random_walk(2, 0.1)), r"\(N, d\) with N = 50 and d = 2, got \(50, 4\)"),
        (lambda: weighed(np.zeros(10)), r"log_likelihood must be \(N\) with N = 50, got \(10,\)"),
        (lambda: weighed([0.0] * 50), "log_likelihood must be an array .* got list"),
        (lambda: WALK.diffuse(rng(), FIFTY, np.array([50])), "ancestors between 0 and N - 1"),
        *((partial(it, rng(), np.array(w), 5), "got") for it in resampling.RESAMPLERS.values() for w in NOT_WEIGHTS),
        (lambda: particles.normalise(np.zeros(0)), "at least one log weight, got none"),
        (lambda: resampling.systematic(rng(), np.zeros(3), 0), "count must be at least 1, got 0"),
        (lambda: weighed(FIFTY[:, 0], np.full((50, 4), 9.0), LARGE), "states must be finite, got NaN or infinity"),
        (lambda: particles.normalise([0.0, 0.0]), "normalise takes arrays and numbers, got list; turn lists into"),
        (lambda: particles.moments(FIFTY, FIFTY), "numbers of other types or dimensions, got 2-D float64, 2-D float64"),
        (lambda: matching.small_grey(PICTURE.astype(float)), "array .* of uint8, got an array of float64"),  # type: ignore[arg-type]
        (lambda: counting.bin_table("cmyk"), "a space of colour is one of hsv, lab, chromaticity, got 'cmyk'"),
        (lambda: counting.assign_bins(PICTURE, HSV, 0, 0, 21, 16), "expected a rectangle within the picture, got"),
        (lambda: counting.shift(np.zeros(4, np.int64), 1, 1), "expected a window of 8 numbers, got"),
        (lambda: counting.count_window(PICTURE, 1.0, 1.0, 1, 1, False, (0, 1), HSV), "expected a part at least"),
        (lambda: histogram.shares(PICTURE, np.ones(2), histogram.Window(-1, 2), "hsv"), "must be at least 0, got -1"),
        (lambda: clouds.Cloud(SEVEN, *[np.zeros(0)] * 3, np.zeros((0, 2)), np.zeros(1)), "a cloud needs nodes"),
        (lambda: auxiliary.soft(np.array([np.nan]), 1.0, 2.0, 5), "got none or NaN"),
    ],
)
def test_both_sides_are_named(call: Call, sentence: str) -> None:
    """One sentence says what is expected and what was got, also of what was read beyond its end before."""
    with pytest.raises((ValueError, TypeError), match=sentence):
        call()


def arrays_of(door: Door) -> dict[str, np.ndarray]:
    """Return positive numbers, an identity in the last two sides where these are equal; of indices all parents."""
    found = {}
    for name, sides in door[1].items():
        shape = [SIZES.get(side) or int(side) for side in sides]
        found[name] = np.linspace(0.1, 0.9, int(np.prod(shape))).reshape(shape)
        if len(shape) > 1 and shape[-1] == shape[-2]:
            found[name] = np.broadcast_to(np.eye(shape[-1]), shape).copy()
    return found | dict.fromkeys(door[1].keys() & {"ancestors", "parents"}, PARENTS)


def test_every_public_function_is_asked() -> None:
    """What a module lists is a door, a function of loops, or takes no arrays that have to fit together."""
    public = {
        f"{module}.{name}"
        for module, where in MODULES.items()
        for name, it in vars(where).items()
        if callable(it) and not isclass(it) and getattr(it, "__module__", "") == where.__name__ and name[0] != "_"
    }
    assert public - DOORS.keys() - LOOPS.keys() == WITHOUT_ARRAYS


@pytest.mark.parametrize("door", [*DOORS.values(), *LOOPS.values()], ids=[*DOORS, *LOOPS])
def test_what_fits_is_let_in(door: Door) -> None:
    """Arrays of the sides that are written down are accepted."""
    door[0](*arrays_of(door).values())


def _resized(draw: st.DrawFn, door: Door, name: str, array: np.ndarray) -> np.ndarray:
    """Return an array with a side that no longer agrees with that of another."""
    every = [side for other in door[1].values() for side in other]
    fixed = [axis for axis, side in enumerate(door[1][name]) if side.isdecimal() or every.count(side) > 1]
    assume(fixed)
    axis = draw(st.sampled_from(fixed))
    return np.take(array, range(array.shape[axis] - 1), axis) if draw(st.booleans()) else np.repeat(array, 2, axis)


STEPS = ["extended.update", "kalman.predict", "kalman.update", "kalman.condition"]
LISTS_TOO = {"dynamics.LinearDynamics.predict", *STEPS}
"""Steps, which take a list as well: they look at arrays only where something fails."""

WRONG = ("resized", "deeper", "flat", "list", "text", "complex", "empty", "nan")


@settings(max_examples=150)
@given(st.data())
def test_what_does_not_fit_is_refused(data: st.DataObject) -> None:
    """Another size, number of axes or kind of numbers, nothing at all and NaN give one sentence of what was got."""
    place = data.draw(st.sampled_from(list(DOORS)))
    door = DOORS[place]
    arrays = arrays_of(door)
    name, wrong = data.draw(st.sampled_from(list(arrays))), data.draw(st.sampled_from(WRONG))
    array = arrays[name]
    assume(not (wrong == "nan" and (name in MISSING or array.dtype.kind != "f" or door[0] == WALK.predict)))
    assume(not (wrong == "flat" and array.ndim == 1))
    assume(not (wrong == "list" and place in LISTS_TOO))
    made: dict[str, Callable[[], object]] = {
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
        door[0](*{**arrays, name: made[wrong]()}.values())
    assert "\n" not in str(refused.value)
    assert "got" in str(refused.value)


@pytest.mark.parametrize("place", STEPS)
def test_what_is_not_looked_at_beforehand_is_refused_as_well(place: str) -> None:
    """Each array of a step in turn: too long, of one more axis, complex, empty, and not finite."""
    arrays = arrays_of(DOORS[place])
    for name, array in arrays.items():
        nothing = np.full_like(array, np.nan)
        for each in (np.repeat(array, 2, 0), array[:1], array[..., None], array.astype(complex), array[:0], nothing):
            with pytest.raises((ValueError, TypeError), match="got"):
                DOORS[place][0](*{**arrays, name: each}.values())


@given(st.data())
def test_compiled_loops_look_at_sizes(data: st.DataObject) -> None:
    """A function of compiled loops reads nothing beyond the end of an array."""
    door = LOOPS[data.draw(st.sampled_from(list(LOOPS)))]
    arrays = arrays_of(door)
    name = data.draw(st.sampled_from(list(arrays)))
    wrong = _resized(data.draw, door, name, arrays[name])
    with pytest.raises(ValueError, match="expected"):
        door[0](*{**arrays, name: np.ascontiguousarray(wrong)}.values())
