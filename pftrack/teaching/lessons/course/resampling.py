"""Lesson 10: why particles are redrawn, how to do it with little noise, and its cost."""

from functools import lru_cache
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.filters.resampling import RESAMPLERS, systematic_parents
from pftrack.teaching.lessons.course.sir import STEPS, Corridor, cached_walk
from pftrack.teaching.lessons.figure import Panel, Shown, ceiling, look
from pftrack.teaching.lessons.lesson import Answer, Computed, Demonstration, Outcome

# Offspring: numbers of copies of six particles, by a comb or by darts, and their scatter.


Scheme: TypeAlias = Literal["systematic", "stratified", "multinomial"]

WEIGHTS: Floats = np.array([0.37, 0.23, 0.17, 0.12, 0.07, 0.04])
LOG_WEIGHTS: Floats = np.log(WEIGHTS)
REPEATS_FRAME = 1
"""Frame of the random numbers of repeats, which are others than those of the figure."""


def marks(scheme: Scheme, count: int, offset: float, seed: int) -> Floats:
    """Return where teeth or darts (count,) meet the weights, laid end to end and scaled to `count`, ascending.

    Args:
        scheme: By one comb, by a dart in each of `count` equal pieces, or by darts anywhere.
        count: Number of draws.
        offset: Offset of the comb, in [0, 1) of the distance of its teeth.
        seed: Seed of the darts.
    """
    numbers = Stream(seed, 0, Purpose.TRACK).random(count)
    match scheme:
        case "systematic":
            return np.asarray(np.arange(count) + offset)
        case "stratified":
            return np.asarray(np.arange(count) + numbers)
        case "multinomial":
            return np.asarray(np.sort(numbers) * count)


def copies(scheme: Scheme, count: int, offset: float, seed: int) -> Ints:
    """Return the number of copies of each particle by those teeth or darts; arguments as for `marks`."""
    if scheme == "systematic":
        return _count(systematic_parents(WEIGHTS, offset, count))
    return _count(RESAMPLERS[scheme](Stream(seed, 0, Purpose.TRACK), LOG_WEIGHTS, count))


def sample_copies(scheme: Scheme, count: int, repeats: int, seed: int) -> Floats:
    """Return the copies of each particle in many redraws, (repeats, particles)."""
    rng, resample = Stream(seed, REPEATS_FRAME, Purpose.TRACK), RESAMPLERS[scheme]
    return np.array([_count(resample(rng, LOG_WEIGHTS, count)) for _ in range(repeats)], dtype=np.float64)


def exact_variance(scheme: Scheme, count: int) -> float:
    """Return the sum, over the particles, of the variances of their numbers of copies.

    A dart anywhere in a stretch hits a particle with probability equal to the particle's share of the stretch, so each
    dart adds share (1 - share). A comb gives each the whole part of what it expects, and one more with the probability
    of the rest.
    """
    expected = count * WEIGHTS
    if scheme == "multinomial":
        return float((expected * (1.0 - WEIGHTS)).sum())
    if scheme == "systematic":
        rest = expected - np.floor(expected + 1e-9)
        return float((rest * (1.0 - rest)).sum())
    ends = np.cumsum(expected)
    pieces = np.arange(count)[:, None]
    shares = np.minimum(ends, pieces + 1) - np.maximum(ends - expected, pieces)
    shares = np.clip(shares, 0.0, 1.0)
    return float((shares * (1.0 - shares)).sum())


def _count(parents: Ints) -> Ints:
    return np.bincount(parents, minlength=len(WEIGHTS))


LOOK = look(__file__)
REDRAWS = 400
"""From which the scatter of the copies is shown."""
REPEATS = 20_000
"""From which it is checked."""
CROWD = 500
"""Particles of the filter whose effective size is shown."""
RUNS = 20
MARK_HEIGHT = 1.4
"""Height of a tooth, where the bar of weights has height 1."""
FAINT = 0.25
"""Opacity of particles without descendants."""
ROUNDING = 1e-9


class ResamplingParameters(Parameters):
    """Settings of resampling."""

    particles: int = parameter(20, "Particles N", within=(2, 60, 1))
    """Number of resampled particles: teeth of the comb, or darts; also the particles of the tree."""
    scheme: Scheme = parameter("systematic", "Scheme")
    """Systematic is one comb with equally spaced teeth, stratified a dart in each of N equal pieces, multinomial darts
    that may fall anywhere."""
    offset: float = parameter(0.3, "Comb offset", within=(0, 0.99, 0.01))
    """Position of the comb's first tooth, as a share of the space between two teeth."""


def show(parameters: ResamplingParameters, seed: int) -> Shown:
    """Redraw six particles, and follow a filter that redraws and one that does not."""
    count, scheme = parameters.particles, parameters.scheme
    scattered = _scatter(scheme, count, REDRAWS, seed)
    parents = _parents(scheme, count, seed)
    lines = _lines(parents)
    chance = float(4.0 * scattered.std() / np.sqrt(REDRAWS)) + ROUNDING
    numbers = {
        "scatter": (float(scattered.mean()), exact_variance(scheme, count), chance),
        "alive": (float(lines[0].sum()),),
    }
    panels = _weights(parameters, seed), _copies(parameters, seed), _sizes(scheme, seed), _tree(parents, lines)
    return LOOK.show(panels, numbers)


def _weights(parameters: ResamplingParameters, seed: int) -> Panel:
    count, scheme = parameters.particles, parameters.scheme
    picked = marks(scheme, count, parameters.offset, seed)
    return LOOK.draw(
        "weights",
        {"weights": (count * WEIGHTS,), "marks": (picked, np.full(count, MARK_HEIGHT))},
        turned=parameters if scheme == "systematic" else None,
        x=(0.0, float(count)),
        what="the comb's teeth" if scheme == "systematic" else "darts",
        expected=_join(count * WEIGHTS),
        count=count,
    )


def _copies(parameters: ResamplingParameters, seed: int) -> Panel:
    expected = parameters.particles * WEIGHTS
    ours = copies(parameters.scheme, parameters.particles, parameters.offset, seed)
    return LOOK.draw(
        "copies",
        {"copies": (ours.astype(np.float64),), "expected": (np.arange(len(WEIGHTS)), expected)},
        y=(0.0, ceiling(max(float(ours.max()), float(expected.max()) + 1.0))),
        ours=_join(ours),
        expected=_join(expected),
    )


def _sizes(scheme: Scheme, seed: int) -> Panel:
    kept, redrawn = (100.0 * sizes / CROWD for sizes in effective_sizes(scheme, seed))
    steps = np.arange(STEPS + 1.0)
    return LOOK.draw(
        "sizes",
        {"kept": (steps, kept), "redrawn": (steps, redrawn)},
        x=(0.0, float(STEPS)),
        crowd=CROWD,
        steps=STEPS,
        redrawn=redrawn[-1],
        kept=kept[-1],
    )


def _tree(parents: Floats, lines: Bools) -> Panel:
    count = parents.shape[1]
    return LOOK.draw(
        "tree",
        {"tree": (parents, np.where(lines, 1.0, FAINT))},
        x=(-0.3, STEPS + 0.3),
        y=(-0.8, count - 0.2),
        count=count,
        alive=int(lines[0].sum()),
    )


def _parents(scheme: Scheme, count: int, seed: int) -> Floats:
    """Return each particle's parent in the step before, (STEPS + 1, count), in the corridor; NaN at the start."""
    walk, _ = cached_walk(Corridor())
    clouds = Corridor().clouds(walk.doors, count, seed, resample=RESAMPLERS[scheme])
    return np.array([np.full(count, np.nan), *(cloud.ancestors for cloud in clouds[1:])])


def _lines(parents: Floats) -> Bools:
    """Return whether each particle of each step has descendants in the last one."""
    lines = np.zeros(parents.shape, dtype=np.bool_)
    lines[-1] = True
    for step in range(len(parents) - 1, 0, -1):
        lines[step - 1, parents[step, lines[step]].astype(np.int64)] = True
    return lines


@lru_cache(maxsize=32)
def effective_sizes(scheme: Scheme, seed: int) -> tuple[Floats, Floats]:
    """Return effective sample sizes (STEPS + 1,) in the corridor if particles are never redrawn, and if always."""
    walk, _ = cached_walk(Corridor())

    def sizes(threshold: float) -> Floats:
        clouds = Corridor().clouds(walk.doors, CROWD, seed, resample=RESAMPLERS[scheme], threshold=threshold)
        return np.array([cloud.effective_sample_size for cloud in clouds])

    return sizes(0.0), sizes(1.0)


def _join(values: NDArray[Any]) -> str:
    return ", ".join(f"{value:.3g}" for value in values)


def _scatter(scheme: Scheme, count: int, repeats: int, seed: int) -> Floats:
    """Return, of each of many redraws, the squared deviations from what is expected, summed over the particles."""
    off = sample_copies(scheme, count, repeats, seed) - count * WEIGHTS
    return np.asarray(np.square(off).sum(axis=1))


def _answer(parameters: ResamplingParameters, seed: int) -> Answer:
    count = parameters.particles
    found = [int(copies("systematic", count, offset, seed)[0]) for offset in np.linspace(0.0, 0.999, 1000)]
    low, high = min(found), max(found)
    share = found.count(high) / len(found)
    words = f"{100 * share:.0f} % of 1,000 comb offsets give it {high} copies, the others {low}."
    return Answer(f"{low}-or-{high}", words=words)


def _mean() -> Outcome:
    mean = sample_copies("systematic", 20, REPEATS, 1).mean(axis=0)
    return Outcome(float(np.abs(mean - 20 * WEIGHTS).max()), 0.0, 0.02)


def _variance(scheme: Scheme, exact: float, tolerance: float) -> Outcome:
    return Outcome(float(_scatter(scheme, 20, REPEATS, 1).mean()), exact, tolerance)


def _survival() -> Outcome:
    last = np.array([[sizes[-1] for sizes in effective_sizes("systematic", seed)] for seed in range(RUNS)])
    kept, redrawn_each_step = last.mean(axis=0)
    return Outcome(float(kept / redrawn_each_step), 0.0, 0.8)


COMPUTED = Computed(
    _answer,
    {
        "expected-copies": _mean,
        "multinomial-variance": lambda: _variance("multinomial", 15.21, 0.15),
        "systematic-variance": lambda: _variance("systematic", 1.36, 0.05),
        "survival": _survival,
    },
    Demonstration(ResamplingParameters(), show, random=True),
)
