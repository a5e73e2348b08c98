"""Public functions of filters, motions and likelihoods refuse arrays that do not fit, in one sentence.

They state the sides of their arrays to one function, `check`; compiled loops compare sizes themselves.
"""

from collections.abc import Callable
from importlib import import_module
from operator import attrgetter
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from pftrack.core.numerics.random import Gaussian
from pftrack.filters import (
    auxiliary,
    bootstrap,
    dynamics,
    kalman,
    particles,
    perspective,
    resampling,
    unscented,
    unscented_particle,
)
from pftrack.filters.dynamics import LinearDynamics, random_walk
from pftrack.filters.particles import ParticleSet
from pftrack.filters.trajectories import gaussian
from pftrack.vision import matching
from pftrack.vision.likelihoods import counting, histogram, points, template

SIZES = {"N": 6, "d": 4, "k": 2, "m": 3, "F": 5, "T": 7, "n": 8, "M": 6, "K": 9}
"""How long each side is; all differ, but for those that are the same."""

PARENTS = np.arange(SIZES["N"])
WALK = random_walk(SIZES["d"], 0.1)
PICTURE = np.random.default_rng(0).integers(0, 99, (16, 20, 3), np.uint8)
GREY = np.ascontiguousarray(PICTURE[:, :, 0])
WINDOW = histogram.Window(2, 2)

Call = Callable[..., Any]


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


def cloud(states: np.ndarray) -> ParticleSet:
    return ParticleSet(states, np.zeros(len(states)), np.arange(len(states)))


PRIOR = "mean: d, covariance: d d"
CAMERA = "mean: 2 8, covariance: 2 8 8"


def _auxiliary(states: np.ndarray, values: np.ndarray) -> object:
    counts: Any = {"prediction_count": 3, "observation_count": 3}
    return auxiliary.step(cloud(states), WALK, lambda _: values, rng(), weights="corrected", **counts)


def _unscented_particle(states: np.ndarray, values: np.ndarray, z: np.ndarray, r: np.ndarray) -> object:
    given: Any = {"measurement": z, "observe": lambda x: x[..., :3], "noise_covariance": r}
    return unscented_particle.step(cloud(states), WALK, lambda _: values, rng(), **given)


Door = tuple[Call, dict[str, list[str]]]


def doors(table: dict[str, str | tuple[str, Call]]) -> dict[str, Door]:
    """Return functions with the sides of their arrays; one that is not given is that of the name."""
    found = {}
    for name, entry in table.items():
        module, _, path = name.partition(".")
        home = f"pftrack.filters.{module}"
        sides, call = (entry, attrgetter(path)(import_module(home))) if isinstance(entry, str) else entry
        each = (one.partition(": ") for one in sides.split(", "))
        found[name] = call, {array: shape.split() for array, _, shape in each}
    return found


DOORS = doors(
    {
        "particles.ParticleSet": "states: N d, log_weights: N, ancestors: N",
        "particles.ParticleSet.uniform": "states: N d",
        **{
            f"resampling.{name}": ("w: N", lambda w, it=it: it(rng(), w, 5))
            for name, it in resampling.RESAMPLERS.items()
        },
        "dynamics.LinearDynamics": "transition: d d, offset: d, noise: d k",
        "dynamics.LinearDynamics.predict": ("states: N d", WALK.predict),
        "dynamics.LinearDynamics.diffuse": ("means: N d", lambda means: WALK.diffuse(rng(), means, PARENTS)),
        "bootstrap.step": ("s: N d, v: N", lambda s, v: bootstrap.step(cloud(s), WALK, lambda _: v, rng())),
        "auxiliary.step": ("states: N d, values: N", _auxiliary),
        "unscented_particle.step": ("states: N d, values: N, z: m, r: m m", _unscented_particle),
        "kalman.update": (
            f"{PRIOR}, z: m, slope: m d, r: m m",
            lambda m, p, *arrays: kalman.update(Gaussian(m, p), *arrays),
        ),
        "unscented.update_batch": (
            "m: n d, c: n d d, z: m, r: m m",
            lambda m, c, z, r: unscented.update_batch(m, c, z, lambda x: x[..., :3], r),
        ),
        "affine.AffineLayer": "points: F 3, reference: 2 4, noise: 4",
        "histogram.shares": ("place: 2", lambda place: histogram.shares(PICTURE, place, WINDOW, "hsv")),
        "template.cut": ("places: 5 2", lambda places: template.cut(GREY, places, np.full((5, 2), 6))),
    }
)
"""Public functions for the interpreter, with the sides of their arrays; all others check theirs alike."""

LOOPS = doors(
    {
        "particles.moments": "states: N d, weights: N",
        "dynamics.predict": "states: N d, transition: d d, offset: d",
        "dynamics.diffuse": (
            "means: N d, noise: d k, normals: k M",
            lambda means, noise, normals: dynamics.diffuse(means, PARENTS, noise, normals),
        ),
        "kalman.condition_on_innovation": f"{PRIOR}, z: m, slope: m d, r: m m",
        "sequential.condition": f"{PRIOR}, z: m, slope: m d, variances: m",
        "sequential.decorrelate": "z: m, slope: m d, r: m m",
        "sequential.predict_second_order": "mean: d, covariance: d d, noise_sd: 2",
        "affine.predict": f"{CAMERA}, noise: 4",
        "affine.project": f"{CAMERA}, points: F 3",
        "affine.observe": f"{CAMERA}, points: F 3, positions: F 2, variances: F 2",
        "perspective.features": ("q: 6, p: F 3", lambda q, p: perspective.features(q, p, 500.0)),
        "perspective.project": (
            "mean: 12, covariance: 12 12, p: F 3, c: 2",
            lambda mean, covariance, p, c: perspective.project(mean, covariance, p, 500.0, c),
        ),
        "agreement.fit_gain": "slope: m d, w: m",
        "agreement.excess_variance": "z: m, slope: m d, v: m, shown: m",
        "agreement.fit_covariance": "gain: d m, v: m",
        "gaussian.locate": ("nodes: n 2, w: n", lambda nodes, counts: gaussian.locate(nodes, counts, True)),
        "points.log_likelihood": ("x: F N 2, y: F 2, s: F", points.log_likelihood),
    }
)
"""Public functions of compiled loops, which look at sizes."""

MISSING = {"log_weights", "w", "v", "values", "c", "means", "place"}
"""What may be NaN, or is not looked through since that takes longer than a step may."""

LARGE = LinearDynamics(np.eye(4) * 1e308, np.zeros(4), np.zeros((4, 1)))
FIFTY = np.random.default_rng(1).normal(size=(50, 4))
NOT_WEIGHTS = [[np.nan, 0.0], [0.0, np.nan], [0.0, np.inf], [-np.inf] * 3, []]


def weighed(values: object, states: np.ndarray = FIFTY, model: LinearDynamics = WALK) -> object:
    return bootstrap.step(ParticleSet.uniform(states), model, lambda _: values, rng())  # type: ignore[return-value, arg-type]


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (
            lambda: weighed(np.zeros(50), model=random_walk(1, 0.1)),
            r"states must be \(N, d\) with N = 50 and d = 1, got \(50, 4\)",
        ),
        (lambda: weighed(np.zeros(10)), r"log_likelihood must be \(N\) with N = 50, got \(10,\)"),
        (lambda: weighed([0.0] * 50), "log_likelihood must be an array .* got list"),
        (lambda: weighed(FIFTY[:, 0], np.full((50, 4), 9.0), LARGE), "states must be finite, got NaN or infinity"),
        (lambda: WALK.diffuse(rng(), FIFTY, np.array([50])), "ancestors between 0 and N - 1"),
        *(
            (lambda it=it, w=w: it(rng(), np.array(w), 5), "got")
            for it in resampling.RESAMPLERS.values()
            for w in NOT_WEIGHTS
        ),
        (lambda: particles.normalise(np.zeros(0)), "at least one log weight, got none"),
        (lambda: particles.normalise([0.0, 0.0]), "normalise takes arrays and numbers, got list; turn lists into"),
        (lambda: resampling.systematic(rng(), np.zeros(3), 0), "count must be at least 1, got 0"),
        (lambda: matching.small_grey(PICTURE.astype(float)), "the picture must be an array .* got an array of float64"),  # type: ignore[arg-type]
        (lambda: counting.bin_table("cmyk"), "a space of colour is one of hsv, lab, chromaticity, got 'cmyk'"),
        (lambda: counting.assign_bins(PICTURE, counting.bin_table("hsv"), 0, 0, 21, 16), "within the picture, got"),
        (lambda: histogram.shares(PICTURE, np.ones(2), histogram.Window(-1, 2), "hsv"), "at least 0, got -1"),
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


LISTS_TOO = {"dynamics.LinearDynamics.predict", "kalman.update"}
"""Steps, which take a list as well: they look at arrays only where something fails."""

WRONG = ("resized", "deeper", "flat", "list", "text", "complex", "empty", "nan")


@settings(max_examples=100)
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


@given(st.data())
def test_compiled_loops_look_at_sizes(data: st.DataObject) -> None:
    """A function of compiled loops reads nothing beyond the end of an array."""
    door = LOOPS[data.draw(st.sampled_from(list(LOOPS)))]
    arrays = arrays_of(door)
    name = data.draw(st.sampled_from(list(arrays)))
    wrong = _resized(data.draw, door, name, arrays[name])
    with pytest.raises(ValueError, match="expected"):
        door[0](*{**arrays, name: np.ascontiguousarray(wrong)}.values())
