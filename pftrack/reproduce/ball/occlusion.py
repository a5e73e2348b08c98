"""Success over occluder width and distracter size: the study of Bando 2007, ch. 3 sections 3.1 to 3.3.

The coarse map of the reference implementation: 25 cells, 60 frames, 800 particles, all 20 layouts of three look-alikes.
Condensation and the auxiliary filter stand beside the switching filters, although Bando leaves them out of the
simulation, because the sharpened auxiliary filter beats both of them. Beside it are the whole maps, and the same in the
other reading of the scene.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa

from pftrack.core.model.parameters import Value
from pftrack.core.numerics.statistics import chi_square, rank_sum
from pftrack.output.figures.picture import save
from pftrack.reproduce.ball.study import COARSE, SIXTEEN, Scene, Tally, cells, compare_cells, rows, tally
from pftrack.reproduce.finding import CHOSEN, PROTOCOL, TRIALS, Finding, Unexplained, claim, compare, not_run
from pftrack.reproduce.finding import FEWER as FEWER_TRIALS
from pftrack.reproduce.pool import Pool
from pftrack.sweep import Plan, Result
from pftrack.sweep import compare as compare_methods
from pftrack.sweep.axis import Axis
from pftrack.sweep.cells import CellMap, Code, quantity_named, samples, significance
from pftrack.sweep.cells import cells as map_cells

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SOURCE = "Bando 2007, ch. 3 sections 3.1 and 3.2; reference implementation"
REFERENCE_RUNS = 200

CELLS: dict[str, tuple[tuple[float, ...], ...]] = {
    "h-spf": (
        (1.00, 1.00, 0.94, 0.51, 0.08),
        (1.00, 0.94, 0.62, 0.18, 0.01),
        (1.00, 0.91, 0.57, 0.13, 0.03),
        (1.00, 0.24, 0.01, 0.0, 0.0),
        (0.0, 0.0, 0.0, 0.0, 0.0),
    ),
    "s-spf": (
        (1.00, 0.99, 0.78, 0.28, 0.03),
        (1.00, 0.83, 0.23, 0.03, 0.01),
        (1.00, 0.81, 0.24, 0.0, 0.0),
        (0.08, 0.01, 0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0, 0.0, 0.0),
    ),
    "pc-pf": (
        (1.00, 0.65, 0.0, 0.0, 0.0),
        (0.39, 0.03, 0.0, 0.0, 0.0),
        (0.11, 0.01, 0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0, 0.0, 0.0),
    ),
    "apf": (
        (1.00, 1.00, 0.99, 0.85, 0.45),
        (1.00, 0.99, 0.91, 0.59, 0.18),
        (1.00, 0.97, 0.86, 0.47, 0.12),
        (1.00, 0.49, 0.03, 0.0, 0.0),
        (0.0, 0.0, 0.0, 0.0, 0.0),
    ),
    "condensation": (
        (0.57, 0.53, 0.22, 0.0, 0.0),
        (0.0, 0.0, 0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0, 0.0, 0.0),
        (0.0, 0.0, 0.0, 0.0, 0.0),
    ),
}
"""Reference success rates; rows by occluder width, columns by distracter radius."""

POOLED: dict[str, tuple[float, float, float]] = {
    "h-spf": (0.407, 4.13, 0.74),
    "s-spf": (0.292, 4.56, 0.37),
    "pc-pf": (0.087, 7.96, 0.0),
    "apf": (0.516, 3.00, 1.0),
    "condensation": (0.053, 9.02, 0.0),
}
"""Over all cells: success, error of successful runs in px, share of particles from the observation sampler."""

QUICK_WIDER = 2.2
"""Of four layouts of twenty."""

CORRECTED = {"apf": 0.045, "h-spf": 0.040, "s-spf": 0.056}
"""Pooled success with corrected weights."""


def coarse_map(pool: Pool, full: bool) -> list[Finding]:
    """Success, error and sampler shares on 25 cells, for every tracker and weight rule of the reference.

    The quick form has a run for each cell and every fifth layout, for pooled figures but not for single cells.
    """
    scene = COARSE if full else replace(COARSE, layouts=4)
    table = rows(pool, scene.plan(tuple(POOLED), 10 if full else 1))
    wider, ground = (1.0, PROTOCOL) if full else (QUICK_WIDER, FEWER_TRIALS)
    findings = []
    pooled: dict[str, float] = {}
    for tracker, (success, error, observed) in POOLED.items():
        whole = tally(table, tracker=tracker)
        pooled[tracker] = whole.success
        findings += [
            compare(
                f"occlusion: {tracker}, pooled success", whole.success, success, 0.04 * wider, SOURCE, ground=ground
            ),
            compare(
                f"occlusion: {tracker}, observation share",
                whole.observation_share,
                observed,
                0.05,
                SOURCE,
                ground=CHOSEN,
            ),
        ]
        if full:
            findings.append(
                compare(f"occlusion: {tracker}, pooled error, px", whole.error, error, 0.5, SOURCE, ground=PROTOCOL)
            )
            found = cells(table, COARSE, tracker=tracker)
            title = f"occlusion: {tracker}, success"
            findings += compare_cells(title, found, COARSE, CELLS[tracker], REFERENCE_RUNS, SOURCE)
    corrected = rows(pool, scene.plan(tuple(CORRECTED), 5 if full else 1, apf_weights="corrected"))
    for tracker, success in CORRECTED.items():
        whole = tally(corrected, tracker=tracker)
        name = f"occlusion: {tracker} with corrected weights, pooled success"
        findings.append(compare(name, whole.success, success, 0.04 * wider, SOURCE, ground=ground))
        pooled[f"{tracker} corrected"] = whole.success
    return findings + _claims(pooled) + (_tests(table) if full else [])


def _claims(pooled: dict[str, float]) -> list[Finding]:
    """Judge the orderings that Bando reports."""
    gap = pooled["h-spf"] - pooled["s-spf"]
    over_apf = pooled["h-spf"] - pooled["apf"]
    corrected_gap = pooled["h-spf corrected"] - pooled["s-spf corrected"]
    return [
        claim("occlusion: h-SPF succeeds more often than s-SPF (gap)", gap, holds=gap > 0, source=SOURCE),
        claim(
            "occlusion: switching succeeds more often than always drawing by observation (h-SPF less APF)",
            over_apf,
            holds=over_apf > 0,
            source="implied by Bando 2007, ch. 3",
            known=Unexplained(
                "not in the reference either: with sharpened weights always drawing by observation is best here"
            ),
        ),
        claim(
            "occlusion: h-SPF succeeds more often than s-SPF with corrected weights too (gap)",
            corrected_gap,
            holds=corrected_gap > 0.04,
            source="implied by Bando 2007, ch. 3",
            known="not in the reference either: with weights that are a valid importance sampler the gap is gone",
        ),
    ]


def _tests(table: pa.Table) -> list[Finding]:
    """Count the cells in which two trackers differ at 1 %, by success and by error."""
    findings = []
    for other, fewest in {"s-spf": 7, "pc-pf": 11}.items():
        first, second = (cells(table, COARSE, tracker=tracker) for tracker in ("h-spf", other))
        better, worse = _significant(first, second)
        name = f"occlusion: cells in which h-SPF is better than {other}, chi-square at 1 %"
        findings.append(claim(name, better, holds=better >= fewest and worse == 0, source=SOURCE))
    first, second = (cells(table, COARSE, tracker=tracker) for tracker in ("h-spf", "s-spf"))
    smaller, larger = _smaller_errors(first, second)
    name = "occlusion: cells in which h-SPF has the smaller errors than s-SPF, rank-sum at 1 %"
    findings.append(claim(name, smaller, holds=smaller >= 8 and larger == 0, source=SOURCE))
    return findings


def _significant(first: list[Tally], second: list[Tally]) -> tuple[int, int]:
    """Count the cells in which one has significantly more successes than the other, either way (eq. 3.11)."""
    ours, theirs = (np.array([[cell.successes, cell.runs] for cell in side]).T for side in (first, second))
    significant = chi_square(*ours, *theirs) < 0.01
    gap = ours[0] / ours[1] - theirs[0] / theirs[1]
    return int((significant & (gap > 0)).sum()), int((significant & (gap < 0)).sum())


def _smaller_errors(first: list[Tally], second: list[Tally]) -> tuple[int, int]:
    """Count the cells in which one has significantly smaller errors of its successful runs, either way."""
    smaller = larger = 0
    for ours, theirs in zip(first, second, strict=True):
        tested = rank_sum(np.array(ours.errors), np.array(theirs.errors))
        smaller += tested.p_value < 0.01 and tested.rank_biserial > 0
        larger += tested.p_value < 0.01 and tested.rank_biserial < 0
    return smaller, larger


# The maps are the whole protocol with figures 3.5 to 3.11: twenty occluder widths by twenty look-alike sizes by twenty
# layouts by ten trials by three methods with 800 particles, 240,000 runs of sixty frames; the same with 400 and 1600
# particles for the two switching filters; and seven numbers of particles over a hundred conditions. It has no quick
# form: few cells are not a map.
#
# The reference implementation has figures for some of these cells only (see `occlusion` and `counts`); here the
# statements are judged that Bando makes of the maps as a whole.

MAPS_SOURCE = "Bando 2007, ch. 3 sections 3.1 to 3.3"

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
    from pftrack.sweep.report.figures import boxes, curves, mean_maps, significance_maps  # noqa: PLC0415
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
    found = map_cells(maps.methods, RADIUS, WIDTH)
    hard, soft, noise = found["h-spf"], found["s-spf"], found["pc-pf"]
    findings = [
        claim(
            "maps: PC-PF succeeds almost always in a small region only (share of cells above 0.9)",
            _share(noise, 0.9),
            holds=0 < _share(noise, 0.9) < 0.25,
            source=MAPS_SOURCE,
        ),
        claim(
            "maps: PC-PF fails with look-alikes of more than 10 px (success)",
            _success_where(noise, radius_above=10),
            holds=_success_where(noise, radius_above=10) < 0.02,
            source=MAPS_SOURCE,
        ),
        claim(
            "maps: h-SPF succeeds mostly in a wide region (share of cells above 0.5, less that of s-SPF)",
            _share(hard, 0.5) - _share(soft, 0.5),
            holds=_share(hard, 0.5) > _share(soft, 0.5) > _share(noise, 0.5),
            source=MAPS_SOURCE,
        ),
    ]
    if full:
        findings += _count_tested(maps)
    return findings + _by_count(maps)


def _count_tested(maps: Maps) -> list[Finding]:
    """Count the cells in which one is better at 1 %; one cell in a hundred may be so by chance."""
    found = map_cells(maps.methods, RADIUS, WIDTH)
    error = quantity_named(maps.methods.plan, "error")
    errors = samples(maps.methods, error, RADIUS, WIDTH)
    findings = []
    for other in ("s-spf", "pc-pf"):
        by_test = {
            "success, chi-square": significance(found["h-spf"], found[other]),
            "error, rank-sum": compare_methods(error, found, errors, "h-spf", other).significance(),
        }
        for kind, tested in by_test.items():
            better, worse = (int((tested.codes == code).sum()) for code in (Code.FIRST_BETTER, Code.SECOND_BETTER))
            name = f"maps: cells in which h-SPF is better than {other}, {kind} at 1 %"
            findings.append(claim(name, better, holds=better > 20 * max(worse, 1), source=MAPS_SOURCE))
    return findings


def _by_count(maps: Maps) -> list[Finding]:
    findings = []
    middle = map_cells(maps.methods, RADIUS, WIDTH)
    fewer, more = map_cells(maps.fewer, RADIUS, WIDTH), map_cells(maps.more, RADIUS, WIDTH)
    for tracker in SWITCHING:
        success = [float(found[tracker].rate.mean()) for found in (fewer, middle, more)]
        name = f"maps: {tracker}, success grows from 1600 over 800 to 400 particles (400 less 1600)"
        findings.append(
            claim(name, success[0] - success[2], holds=success[0] > success[1] > success[2], source=MAPS_SOURCE)
        )
        known = ~(np.isnan(fewer[tracker].mean_error) | np.isnan(more[tracker].mean_error))
        change = float((fewer[tracker].mean_error - more[tracker].mean_error)[known].mean())
        name = f"maps: {tracker}, errors of successful runs are smaller with 400 than with 1600 particles, px"
        findings.append(claim(name, change, holds=change < -0.25, source=MAPS_SOURCE))
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


# Bando leaves open what "amplitude 200 px" means. In this other reading, 200 px to either side, twice the frame rate
# and a larger picture, wide occluders are no longer hopeless, success hardly depends on their width, and switching is
# ahead by little.

OTHER_SCENE_SOURCE = "reference implementation, reading B"
SOURCE_COUNTS = "reference implementation, reading B"
OTHER_SCENE_REFERENCE_RUNS = 100

VALUES: dict[str, Value] = {
    "amplitude_px": 200,
    "frame_rate_hz": 60,
    "image_width_px": 640,
    "image_height_px": 480,
    "process_noise_px": 1.5,
    "slot_spacing_px": 120,
    "slot_offset_px": 30,
}
OTHER_SCENE_CELLS: dict[str, tuple[tuple[float, ...], ...]] = {
    "h-spf": (
        (1.00, 1.00, 0.99, 0.70, 0.25),
        (1.00, 1.00, 0.98, 0.69, 0.15),
        (1.00, 1.00, 0.91, 0.47, 0.07),
        (1.00, 1.00, 0.92, 0.43, 0.04),
        (1.00, 1.00, 0.87, 0.36, 0.01),
    ),
    "s-spf": (
        (1.00, 1.00, 0.97, 0.67, 0.09),
        (1.00, 1.00, 0.95, 0.67, 0.12),
        (1.00, 0.99, 0.86, 0.36, 0.02),
        (1.00, 1.00, 0.92, 0.41, 0.01),
        (1.00, 0.99, 0.85, 0.21, 0.03),
    ),
    "pc-pf": (
        (1.00, 0.56, 0.0, 0.0, 0.0),
        (1.00, 0.51, 0.0, 0.0, 0.0),
        (1.00, 0.42, 0.0, 0.0, 0.0),
        (1.00, 0.40, 0.0, 0.0, 0.0),
        (0.98, 0.27, 0.0, 0.0, 0.0),
    ),
}
OTHER_SCENE_POOLED: dict[str, tuple[float, float]] = {
    "h-spf": (0.714, 5.20),
    "s-spf": (0.685, 5.26),
    "pc-pf": (0.286, 8.18),
    "condensation": (0.615, 6.35),
    "apf": (0.903, 2.46),
}
OTHER_SCENE_CORRECTED = {"h-spf": (0.595, 7.54), "s-spf": (0.625, 6.88)}
ERROR_ALLOWANCE = {"pc-pf": 2.5}
ERROR_ALLOWANCE_OTHERS = 1.0
"""In px. A run that is lost in its last frames still counts, with errors as wide as the picture: with other seeds
the pooled error moves by as much as this. The reference states no tolerance here."""

SCATTER = "as far as it moves with other seeds: a run that is lost in its last frames still counts"

SMALL_COUNT_ALLOWANCE = 0.15
"""Below 200 particles runs with the same seed are lost alike in all cells. The reference shares forty seeds between
cells, where ours differ: three standard errors of forty runs."""

OTHER_SCENE_COUNTS: dict[str, dict[int, float]] = {
    "h-spf": {50: 0.042, 100: 0.339, 200: 0.845, 400: 0.959, 800: 0.919, 1600: 0.875},
    "s-spf": {50: 0.084, 100: 0.237, 200: 0.756, 400: 0.955, 800: 0.922, 1600: 0.906},
}


def wide_swing(pool: Pool, full: bool) -> list[Finding]:
    """Success and error on 25 cells and over the number of particles; the quick form has two layouts of the twenty."""
    layouts = 20 if full else 2
    scene = replace(COARSE, layouts=layouts, values=VALUES)
    allowance, ground = (0.04, PROTOCOL) if full else (0.12, FEWER_TRIALS)
    table = rows(pool, scene.plan(tuple(OTHER_SCENE_POOLED), 5 if full else 1))
    findings = []
    for tracker, (success, error) in OTHER_SCENE_POOLED.items():
        whole = tally(table, tracker=tracker)
        findings.append(
            compare(
                f"wide-swing: {tracker}, pooled success",
                whole.success,
                success,
                allowance,
                OTHER_SCENE_SOURCE,
                ground=ground,
            )
        )
        if full:
            allowed = ERROR_ALLOWANCE.get(tracker, ERROR_ALLOWANCE_OTHERS)
            findings.append(
                compare(
                    f"wide-swing: {tracker}, pooled error, px",
                    whole.error,
                    error,
                    allowed,
                    OTHER_SCENE_SOURCE,
                    ground=SCATTER,
                )
            )
    if not full:
        return findings
    for tracker, references in OTHER_SCENE_CELLS.items():
        found = cells(table, scene, tracker=tracker)
        title = f"wide-swing: {tracker}, success"
        findings += compare_cells(title, found, scene, references, OTHER_SCENE_REFERENCE_RUNS, OTHER_SCENE_SOURCE)
    corrected = rows(pool, scene.plan(tuple(OTHER_SCENE_CORRECTED), 2, apf_weights="corrected"))
    for tracker, (success, error) in OTHER_SCENE_CORRECTED.items():
        whole = tally(corrected, tracker=tracker)
        name = f"wide-swing: {tracker} with corrected weights, pooled"
        findings.append(compare(f"{name} success", whole.success, success, 0.04, OTHER_SCENE_SOURCE, ground=PROTOCOL))
        findings.append(
            compare(f"{name} error, px", whole.error, error, ERROR_ALLOWANCE_OTHERS, OTHER_SCENE_SOURCE, ground=SCATTER)
        )
    return findings + _counts(pool)


def _counts(pool: Pool) -> list[Finding]:
    scene = replace(SIXTEEN, values=VALUES, axes=(Axis("sample_count", tuple(OTHER_SCENE_COUNTS["h-spf"])),))
    table = rows(pool, scene.plan(tuple(OTHER_SCENE_COUNTS), 2))
    findings = []
    for tracker, references in OTHER_SCENE_COUNTS.items():
        whole = {count: tally(table, tracker=tracker, sample_count=count) for count in references}
        for count, reference in references.items():
            name = f"wide-swing: {tracker}, success with N = {count}"
            allowed = 0.05 if count >= 200 else SMALL_COUNT_ALLOWANCE
            ground = PROTOCOL if count >= 200 else TRIALS
            findings.append(compare(name, whole[count].success, reference, allowed, SOURCE_COUNTS, ground=ground))
        change = whole[200].error - whole[1600].error
        name = f"wide-swing: {tracker}, the error falls with N from 1600 to 200, px"
        findings.append(claim(name, change, holds=change < -0.25, source=SOURCE_COUNTS))
    return findings
