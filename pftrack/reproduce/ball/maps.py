"""The maps: the whole protocol of Bando 2007, ch. 3 sections 3.1 to 3.3, and its figures 3.5 to 3.11.

Twenty occluder widths by twenty look-alike sizes by twenty layouts by ten trials by three methods with 800 particles,
240,000 runs of sixty frames; the same with 400 and 1600 particles for the two switching filters; and seven numbers of
particles over a hundred conditions. There is no quick form: few cells are no map.

The reference implementation has figures for some of these cells only (see `occlusion` and `counts`); here the
statements are judged that Bando makes of the maps as a whole.
"""

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from pftrack.output.figures.picture import save
from pftrack.reproduce.ball.study import Scene
from pftrack.reproduce.finding import Finding, claim, not_run
from pftrack.reproduce.pool import Pool
from pftrack.sweep import Axis, CellMap, Code, Plan, Result, cells, compare, quantity_named, samples, significance

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Maps", "draw", "plans", "whole_protocol"]

SOURCE = "Bando 2007, ch. 3 sections 3.1 to 3.3"

WIDTH, RADIUS = "occlusion_width_px", "distracter_radius_px"
SWITCHING = ("h-spf", "s-spf")
COUNTS = (50, 100, 200, 400, 800, 1200, 1600)
FEWER, MORE = 400, 1600


@dataclass(frozen=True)
class Maps:
    """The four sweeps.

    Attributes:
        methods: The three methods with 800 particles.
        fewer: The switching filters with 400.
        more: The switching filters with 1600.
        counts: The switching filters over the number of particles.
    """

    methods: Result
    fewer: Result
    more: Result
    counts: Result


def plans(full: bool) -> dict[str, Plan]:
    """Return the sweeps by name: Bando's, or few of their cells with one trial."""
    scene = Scene(tuple(range(5, 101, 5)), tuple(range(1, 21))) if full else Scene((5, 30, 55, 80), (1, 6, 11, 16))
    by_count = Scene(
        tuple(range(30, 76, 5)) if full else (30, 60),
        tuple(range(5, 15)) if full else (5, 11),
        axes=(Axis("sample_count", COUNTS if full else (50, 200, 800)),),
    )
    trials = 10 if full else 1
    return {
        "methods": scene.plan((*SWITCHING, "pc-pf"), trials),
        "fewer": scene.plan(SWITCHING, trials, sample_count=FEWER),
        "more": scene.plan(SWITCHING, trials, sample_count=MORE),
        "counts": by_count.plan(SWITCHING, 1),
    }


def whole_protocol(pool: Pool, full: bool) -> list[Finding]:
    """Carry the sweeps out, draw the figures if there is a folder for them, and judge what is said of the maps."""
    if not full:
        return [not_run("maps", "it is about the maps as a whole; occlusion and sample-count have some of their cells")]
    with TemporaryDirectory() as scratch:
        folder = pool.folder or Path(scratch)
        maps = Maps(**{name: pool.sweep(plan, folder / f"{name}.parquet") for name, plan in plans(full).items()})
        if pool.folder is not None:
            for name, figure in draw(maps).items():
                save(figure, pool.folder / f"{name}.png", name)
        return _judge(maps, full)


def draw(maps: Maps) -> "dict[str, Figure]":
    """Return Bando's figures by name."""
    # Drawing loads much that computing does not need, in every process of the pool.
    from pftrack.sweep.report.curves import boxes, curves  # noqa: PLC0415
    from pftrack.sweep.report.maps import mean_maps, significance_maps  # noqa: PLC0415
    from pftrack.sweep.report.study import Study  # noqa: PLC0415

    methods, fewer, more = (Study.of(result, x=RADIUS, y=WIDTH) for result in (maps.methods, maps.fewer, maps.more))
    counts = Study.of(maps.counts, x="sample_count", y=WIDTH)
    success, error = (quantity_named(maps.methods.plan, name) for name in ("success", "error"))
    return {
        "figure-3.5-success": mean_maps([methods], success),
        "figure-3.6-chi-square": significance_maps(methods, success),
        "figure-3.7-error": mean_maps([methods], error),
        "figure-3.8-rank-sum": significance_maps(methods, error),
        "figure-3.9-success-by-particles": mean_maps([fewer, more], success),
        "figure-3.10-error-by-particles": mean_maps([fewer, more], error),
        "figure-3.11-error-over-particles": boxes(counts, maps.counts.plan.axis("sample_count"), error),
        "figure-3.11-success-over-particles": curves(counts, [maps.counts.plan.axis("sample_count")]),
    }


def _judge(maps: Maps, full: bool) -> list[Finding]:
    found = cells(maps.methods, RADIUS, WIDTH)
    hard, soft, noise = found["h-spf"], found["s-spf"], found["pc-pf"]
    findings = [
        claim(
            "maps: PC-PF succeeds almost always in a small region only (share of cells above 0.9)",
            _share(noise, 0.9),
            holds=0 < _share(noise, 0.9) < 0.25,
            source=SOURCE,
        ),
        claim(
            "maps: PC-PF fails with look-alikes of more than 10 px (success)",
            _success_where(noise, radius_above=10),
            holds=_success_where(noise, radius_above=10) < 0.02,
            source=SOURCE,
        ),
        claim(
            "maps: h-SPF succeeds mostly in a wide region (share of cells above 0.5, less that of s-SPF)",
            _share(hard, 0.5) - _share(soft, 0.5),
            holds=_share(hard, 0.5) > _share(soft, 0.5) > _share(noise, 0.5),
            source=SOURCE,
        ),
    ]
    if full:
        findings += _count_tested(maps)
    return findings + _by_count(maps)


def _count_tested(maps: Maps) -> list[Finding]:
    """Count the cells in which one is better at 1 %; one cell in a hundred may be so by chance."""
    found = cells(maps.methods, RADIUS, WIDTH)
    error = quantity_named(maps.methods.plan, "error")
    errors = samples(maps.methods, error, RADIUS, WIDTH)
    findings = []
    for other in ("s-spf", "pc-pf"):
        by_test = {
            "success, chi-square": significance(found["h-spf"], found[other]),
            "error, rank-sum": compare(error, found, errors, "h-spf", other).significance(),
        }
        for kind, tested in by_test.items():
            better, worse = (int((tested.codes == code).sum()) for code in (Code.FIRST_BETTER, Code.SECOND_BETTER))
            name = f"maps: cells in which h-SPF is better than {other}, {kind} at 1 %"
            findings.append(claim(name, better, holds=better > 20 * max(worse, 1), source=SOURCE))
    return findings


def _by_count(maps: Maps) -> list[Finding]:
    findings = []
    middle = cells(maps.methods, RADIUS, WIDTH)
    fewer, more = cells(maps.fewer, RADIUS, WIDTH), cells(maps.more, RADIUS, WIDTH)
    for tracker in SWITCHING:
        success = [float(found[tracker].rate.mean()) for found in (fewer, middle, more)]
        name = f"maps: {tracker}, success grows from 1600 over 800 to 400 particles (400 less 1600)"
        findings.append(claim(name, success[0] - success[2], holds=success[0] > success[1] > success[2], source=SOURCE))
        known = ~(np.isnan(fewer[tracker].mean_error) | np.isnan(more[tracker].mean_error))
        change = float((fewer[tracker].mean_error - more[tracker].mean_error)[known].mean())
        name = f"maps: {tracker}, errors of successful runs are smaller with 400 than with 1600 particles, px"
        findings.append(claim(name, change, holds=change < -0.25, source=SOURCE))
    return findings


def _share(found: CellMap, rate: float) -> float:
    """Return the share of cells whose success is above a rate."""
    return float((found.rate > rate).mean())


def _success_where(found: CellMap, *, radius_above: float) -> float:
    """Return the success over all cells with larger look-alikes."""
    if found.x is None:
        raise ValueError("the map has no axis of look-alike sizes")
    wide = np.array(found.x.values, dtype=float) > radius_above
    return float(found.successes[:, wide].sum() / found.runs[:, wide].sum())
