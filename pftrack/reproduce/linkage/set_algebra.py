"""The algebra of ellipsoids on random cases: what is contained, what is least, and what Shimada prints.

Figures of the reference implementation.
"""

from itertools import product

import numpy as np
from numpy.typing import NDArray

from pftrack.experiments.linkage.sets.prediction import LENGTHENED, OUTER, PRINTED, predict
from pftrack.experiments.linkage.sets.strips import TRACE, VOLUME, cut, trace_ratio
from pftrack.reproduce.finding import CHOSEN, Finding, claim, compare
from pftrack.reproduce.pool import Pool

__all__ = [
    "algebra",
    "count_lost_points",
    "points_of_both",
    "random_cases",
    "random_shape",
    "random_strip",
    "sticks_out",
    "trace_after",
    "values",
]

SOURCE = "reference implementation, algebra"
Array = NDArray[np.float64]
Strip = tuple[Array, float, float]

TOLERANCE = 1e-7
"""By how much (x - c)' P^-1 (x - c) may be above 1."""


def algebra(pool: Pool, full: bool) -> list[Finding]:
    """Containment of a cut, the least trace, the cubic as printed, and three ways of prediction."""
    del pool
    rng = np.random.default_rng(0)
    tested, outside = count_lost_points(rng, 26 if full else 5, 410)
    cases = random_cases(rng, 3000 if full else 600)
    best = np.array([trace_ratio(*case[:4]) for case in cases])
    least = trace_after(cases, best)
    tried = 1.0 + np.geomspace(1e-6, 1e6, 1500)
    searched = np.minimum([trace_after(case[None], tried).min() for case in cases], cases[:, 0])
    printed = trace_after(cases, np.array([_printed_ratio(case) for case in cases]))
    worse = float((printed > least * (1.0 + 1e-9)).mean())
    beaten = float((least > searched * (1.0 + 1e-9)).sum())
    title = "linkage: sets, cases in which a dense search finds a smaller trace than the cubic"
    findings = [
        claim(f"linkage: sets, points of {tested} lost by a cut", outside, holds=outside == 0, source=SOURCE),
        claim(title, beaten, holds=beaten == 0, source=SOURCE),
        compare(
            "linkage: sets, share of cases in which (5.9) as printed is worse", worse, 0.87, 0.12, SOURCE, ground=CHOSEN
        ),
    ]
    for name, way, reference in (("P + du I", PRINTED, 1.0), ("longer semi-axes", LENGTHENED, 1.0), ("ours", OUTER, 0)):
        lost = [sticks_out(random_shape(rng, size), size, rng.uniform(0.6, 5.0), way, rng) for size in _sizes(rng, 300)]
        title = f"linkage: sets, share of predictions by {name} that lose a part"
        findings.append(compare(title, float(np.mean(lost)), reference, 0.0, SOURCE, ground=CHOSEN))
    return findings


def random_shape(rng: np.random.Generator, size: int) -> Array:
    """Return a shape matrix of semi-axes between 0.3 and 30 in any direction."""
    axes = np.linalg.qr(rng.normal(size=(size, size)))[0]
    return np.asarray((axes * (10.0 ** rng.uniform(-0.5, 1.5, size)) ** 2) @ axes.T)


def random_strip(rng: np.random.Generator, centre: Array, shape: Array) -> Strip:
    """Return normal, offset and half width of a strip that meets an ellipsoid, often at its very edge."""
    normal = rng.normal(size=len(centre)) * 10.0 ** rng.uniform(-2, 1)
    half = float(np.sqrt(normal @ shape @ normal))
    width = half * 10.0 ** rng.uniform(-4, 0.5)
    return normal, float(normal @ centre + rng.uniform(-1, 1) * (width + half)), width


def points_of_both(rng: np.random.Generator, count: int, ellipsoid: tuple[Array, Array], strip: Strip) -> Array:
    """Return points (count, n) that are in the ellipsoid and in the strip, up to the ellipsoid's surface."""
    (centre, shape), (normal, offset, width) = ellipsoid, strip
    root = np.linalg.cholesky(shape)
    across = root.T @ normal
    half = float(np.sqrt(across @ across))
    gap = offset - float(normal @ centre)
    along = rng.uniform(max((gap - width) / half, -1.0), min((gap + width) / half, 1.0), count)
    rest = rng.normal(size=(count, len(centre)))
    rest -= np.outer(rest @ across, across) / half**2
    lengths = np.linalg.norm(rest, axis=1, keepdims=True)
    radii = np.sqrt(1 - along**2)[:, None] * rng.choice([1.0, 0.99, 0.5], (count, 1))
    return np.asarray(centre + (np.outer(along, across) / half + rest / lengths * radii) @ root.T)


def values(points: Array, centre: Array, shape: Array) -> Array:
    """Return (x - c)' P^-1 (x - c) of points (m, n)."""
    off = np.linalg.solve(np.linalg.cholesky(shape), (points - centre).T)
    return np.asarray(np.square(off).sum(axis=0))


def count_lost_points(rng: np.random.Generator, cases: int, count: int) -> tuple[int, int]:
    """Return how many points of ellipsoids and strips were tested, and how many are not in what is made of them.

    Args:
        rng: Source of ellipsoids, strips and points.
        cases: For each of six dimensions, both kinds of least and both ways of tightening.
        count: Points of each case.
    """
    tested = outside = 0
    for size, least, tighten, _ in product(range(2, 8), (TRACE, VOLUME), (False, True), range(cases)):
        centre, shape = rng.normal(size=size) * 20.0, random_shape(rng, size)
        strip = random_strip(rng, centre, shape)
        points = points_of_both(rng, count, (centre, shape), strip)
        tested += count
        if cut(centre, shape, *strip, least, tighten):
            outside += int((values(points, centre, shape) > 1.0 + TOLERANCE).sum())
        else:
            outside += count
    return tested, outside


def random_cases(rng: np.random.Generator, count: int) -> Array:
    """Return (count, 6) of tr P, m'P^2m / G, w^2 / G, e^2 / G, G and e of ellipsoids and strips that meet."""
    cases = []
    for size in _sizes(rng, count):
        shape, normal = random_shape(rng, size), rng.normal(size=size)
        across = shape @ normal
        spread = normal @ across
        half = np.sqrt(spread)
        width = half * rng.uniform(0.01, 1)
        gap = rng.uniform(-1, 1) * (half + width) * 0.99
        cases.append((np.trace(shape), across @ across / spread, width**2 / spread, gap**2 / spread, spread, gap))
    return np.array(cases)


def trace_after(cases: Array, ratio: Array) -> Array:
    """Return the traces of the ellipsoids that 1 + L G makes of cases (count, 6) or (1, 6), from their definition."""
    trace, along, width2, gap2 = cases.T[:4]
    share = (ratio - 1.0) / ratio
    return np.asarray((1.0 + (ratio - 1.0) * width2 - share * gap2) * (trace - share * along))


def sticks_out(shape: Array, moved: int, radius: float, way: int, rng: np.random.Generator) -> bool:
    """Return whether the sum of an ellipsoid and a ball is farther out, in some direction, than what is predicted."""
    after = shape.copy()
    predict(after, moved, radius, way)
    directions = rng.normal(size=(400, len(shape)))
    far = np.sqrt(np.square(directions @ np.linalg.cholesky(shape)).sum(axis=1))
    far += radius * np.linalg.norm(directions[:, :moved], axis=1)
    reached = np.sqrt(np.square(directions @ np.linalg.cholesky(after)).sum(axis=1))
    return bool(np.any(far > reached * (1.0 + 1e-9)))


def _sizes(rng: np.random.Generator, count: int) -> list[int]:
    """Return dimensions from 2 to 7."""
    return [int(size) for size in rng.integers(2, 8, count)]


def _printed_ratio(case: Array) -> float:
    """Return 1 + L G by (5.9) as it is printed, with e in the place of e^2."""
    trace, along, width2, _, spread, gap = (float(number) for number in case)
    square, wide = along * spread, width2 * spread
    under = spread**2 * wide * (trace * spread - square)
    second = (spread * trace * (3.0 * wide - gap) - square * (2.0 * (wide - gap) + spread)) / under
    third = (trace * (wide - gap) - square) / under
    roots = np.roots([1.0, 3.0 / spread, second, third])
    real = roots.real[(np.abs(roots.imag) < 1e-9 * np.abs(roots)) & (roots.real > 0.0)]
    return 1.0 + spread * float(real.max(initial=0.0))
