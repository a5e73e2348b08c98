"""Success over occluder width and distracter size: the study of Bando 2007, ch. 3 sections 3.1 to 3.3.

The coarse map of the reference implementation: 25 cells, 60 frames, 800 particles, all 20 layouts of three look-alikes.
Condensation and the auxiliary filter are compared with the switching filters, although Bando leaves them out of the
simulation, because the sharpened auxiliary filter beats both of them. Beside it are the whole maps, and the same in the
other reading of the scene.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from pftrack.core.model.parameters import Value
from pftrack.core.numerics.statistics import chi_square, rank_sum
from pftrack.experiments.shared.recording import LAYOUTS
from pftrack.reproduce.finding import Findings, References
from pftrack.reproduce.pool import RUNS_A_PIECE, Pool
from pftrack.sweep import Plan, Result
from pftrack.sweep.axis import Axis
from pftrack.sweep.cells import CellMap, Code, quantity_named, samples
from pftrack.sweep.cells import cells as map_cells
from pftrack.sweep.cells import compare as compare_methods
from pftrack.sweep.table import Chunks
from pftrack.sweep.work import as_text, compute_chunk

if TYPE_CHECKING:
    from matplotlib.figure import Figure

REFERENCES = References(__file__)
FRAMES = 60


@dataclass(frozen=True)
class Scene:
    """The simulated ball over a grid of occluder widths and look-alike radii, in all or some of the layouts.

    Attributes:
        widths: Widths of the occluder, px.
        radii: Radii of the look-alikes, px.
        layouts: Number of the twenty layouts, spread evenly.
        values: Other differences from Bando's scene.
        axes: Other varied parameters.
    """

    widths: tuple[int, ...]
    radii: tuple[int, ...]
    layouts: int = len(LAYOUTS)
    values: Mapping[str, Value] = field(default_factory=dict)
    axes: tuple[Axis, ...] = ()

    def plan(self, trackers: tuple[str, ...], trials: int, **values: Value) -> Plan:
        """Return the plan with this number of trials in every layout of every cell."""
        layouts = tuple(range(0, len(LAYOUTS), len(LAYOUTS) // self.layouts))
        return Plan(
            "ball",
            (
                *self.axes,
                Axis("occlusion_width_px", tuple(map(float, self.widths))),
                Axis("distracter_radius_px", tuple(map(float, self.radii))),
                Axis("layout", layouts),
            ),
            trackers,
            trials,
            frames=FRAMES,
            values={**self.values, **values},
        )


COARSE = Scene((5, 30, 55, 80, 100), (1, 6, 11, 16, 20))
"""Twenty-five cells, from those in which hardly anybody fails to those in which hardly anybody succeeds."""

SIXTEEN = Scene((30, 45, 60, 75), (5, 8, 11, 14))
"""Sixteen cells between those, for what is counted over all of them."""


@dataclass(frozen=True, slots=True)
class Tally:
    """Runs counted together.

    Attributes:
        runs: Number of runs.
        successes: Number of successes.
        error: Mean error of those, px; NaN if there are none.
        observation_share: Mean share of the particles from the observation sampler; NaN where there is none.
        errors: Error of each successful run, px.
    """

    runs: int
    successes: int
    error: float
    observation_share: float
    errors: tuple[float, ...]

    @property
    def success(self) -> float:
        """Share of the runs that succeeded."""
        return self.successes / self.runs


def rows(pool: Pool, plan: Plan) -> pa.Table:
    """Carry out a plan and return its rows, by number."""
    chunks = Chunks.of(plan, RUNS_A_PIECE)
    # A plan travels as text, as in a sweep: it keeps its experiment, whose functions cannot all be pickled.
    piece = partial(compute_chunk, as_text(plan), chunks.conditions, chunks.trials)
    return pa.concat_tables(pq.read_table(pa.BufferReader(one)) for one in pool.map(piece, range(len(chunks))))


def tally(table: pa.Table, **which: Value) -> Tally:
    """Count the rows whose columns have the given values; there must be at least one."""
    for name, value in which.items():
        table = table.filter(pc.equal(table[name], pa.scalar(value, table[name].type)))
    succeeded = table.filter(table["success"])["mean_error"].to_numpy()
    return Tally(
        len(table),
        len(succeeded),
        float(succeeded.mean()) if len(succeeded) else float("nan"),
        _share(table),
        tuple(succeeded.tolist()),
    )


def _share(table: pa.Table) -> float:
    """Return the mean share by observation; NaN where the trackers draw no particles by observation."""
    if "observation_share" not in table.column_names:
        return float("nan")
    known = table["observation_share"].drop_null().to_numpy()
    return float(known.mean()) if len(known) else float("nan")


def _cells(table: pa.Table, scene: Scene, **which: Value) -> dict[tuple[int, int], Tally]:
    """Count the rows of each cell of a scene, by occluder width and look-alike radius; see `tally`."""
    return {
        (width, radius): tally(table, **which, occlusion_width_px=width, distracter_radius_px=radius)
        for width, radius in product(scene.widths, scene.radii)
    }


def _compare_cells(name: str, found: Mapping[tuple[int, int], Tally], tracker: str) -> Findings:
    """Judge the success of each cell by that of the reference."""
    for place, cell in found.items():
        yield REFERENCES.judge(name, cell.success, tracker, *place, runs=cell.runs)


QUICK_WIDER = 2.2
"""Tolerance with four layouts of twenty."""


def coarse_map(pool: Pool, full: bool) -> Findings:
    """Success, error and sampler shares on 25 cells, for every tracker and weight rule of the reference.

    The quick form has a run for each cell and every fifth layout, for pooled figures but not for single cells.
    """
    scene = COARSE if full else replace(COARSE, layouts=4)
    trackers = tuple(REFERENCES.table("pooled"))
    table = rows(pool, scene.plan(trackers, 10 if full else 1))
    wider = 1.0 if full else QUICK_WIDER
    pooled: dict[str, float] = {}
    for tracker in trackers:
        whole = tally(table, tracker=tracker)
        pooled[tracker] = whole.success
        yield REFERENCES.judge("pooled", whole.success, tracker, wider=wider)
        yield REFERENCES.judge("observed", whole.observation_share, tracker)
        if full:
            yield REFERENCES.judge("pooled-error", whole.error, tracker)
            yield from _compare_cells("cell", _cells(table, COARSE, tracker=tracker), tracker)
    trackers = tuple(REFERENCES.table("corrected"))
    corrected = rows(pool, scene.plan(trackers, 5 if full else 1, apf_weights="corrected"))
    for tracker in trackers:
        pooled[f"{tracker} corrected"] = tally(corrected, tracker=tracker).success
        yield REFERENCES.judge("corrected", pooled[f"{tracker} corrected"], tracker, wider=wider)
    gaps = {
        "hard-beats-soft": pooled["h-spf"] - pooled["s-spf"],
        "switching-beats-observation": pooled["h-spf"] - pooled["apf"],
        "hard-beats-soft-corrected": pooled["h-spf corrected"] - pooled["s-spf corrected"],
    }
    yield from (REFERENCES.judge(name, gap) for name, gap in gaps.items())
    if full:
        yield from _tests(table)


def _tests(table: pa.Table) -> Findings:
    """Count the cells in which two trackers differ at 1 %, by success and by error."""
    found = {it: list(_cells(table, COARSE, tracker=it).values()) for it in ("h-spf", "s-spf", "pc-pf")}
    for other, fewest in {"s-spf": 7, "pc-pf": 11}.items():
        better, worse = _significant(found["h-spf"], found[other])
        yield REFERENCES.judge("cells-better", better, other, holds=better >= fewest and worse == 0)
    smaller, larger = _smaller_errors(found["h-spf"], found["s-spf"])
    yield REFERENCES.judge("cells-nearer", smaller, holds=smaller >= 8 and larger == 0)


def _significant(first: Sequence[Tally], second: Sequence[Tally]) -> tuple[int, int]:
    """Count the cells in which one has significantly more successes than the other, either way (eq. 3.11)."""
    ours, theirs = (np.array([[cell.successes, cell.runs] for cell in side]).T for side in (first, second))
    significant = chi_square(*ours, *theirs) < 0.01
    gap = ours[0] / ours[1] - theirs[0] / theirs[1]
    return int((significant & (gap > 0)).sum()), int((significant & (gap < 0)).sum())


def _smaller_errors(first: Sequence[Tally], second: Sequence[Tally]) -> tuple[int, int]:
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


def whole_protocol(pool: Pool, full: bool) -> Findings:
    """Run the sweeps, draw the figures if a folder is given, and judge the statements on the maps."""
    with TemporaryDirectory() as scratch:
        folder = pool.folder or Path(scratch)
        maps = Maps(**{name: pool.sweep(plan, folder / f"{name}.parquet") for name, plan in plans(full).items()})
        pool.draw(lambda: draw(maps))
        yield from _judge(maps)


def draw(maps: Maps) -> "dict[str, Figure]":
    """Return Bando's figures by name."""
    # Drawing loads much that computing does not need, in every process of the pool.
    from pftrack.sweep.report.files import boxes, curves, mean_maps, significance_maps  # noqa: PLC0415
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


def _judge(maps: Maps) -> Findings:
    found = map_cells(maps.methods, RADIUS, WIDTH)
    hard, soft, noise = (_share_above(found[tracker], 0.5) for tracker in ("h-spf", "s-spf", "pc-pf"))
    yield REFERENCES.judge("small-region", _share_above(found["pc-pf"], 0.9))
    yield REFERENCES.judge("large-look-alikes", _success_where(found["pc-pf"], radius_above=10))
    yield REFERENCES.judge("wide-region", hard - soft, holds=hard > soft > noise)
    yield from _count_tested(maps)
    yield from _by_count(maps)


def _count_tested(maps: Maps) -> Findings:
    """Count the cells in which one is better at 1 %; one cell in a hundred may be so by chance."""
    found = map_cells(maps.methods, RADIUS, WIDTH)
    by_test = {"success, chi-square": "success", "error, rank-sum": "error"}
    for other, (kind, name) in product(("s-spf", "pc-pf"), by_test.items()):
        quantity = quantity_named(maps.methods.plan, name)
        values = samples(maps.methods, quantity, RADIUS, WIDTH)
        codes = compare_methods(quantity, found, values, "h-spf", other, test="chi-square").significance().codes
        better, worse = (int((codes == code).sum()) for code in (Code.FIRST_BETTER, Code.SECOND_BETTER))
        yield REFERENCES.judge("map-cells", better, other, kind, holds=better > 20 * max(worse, 1))


def _by_count(maps: Maps) -> Findings:
    fewer, middle, more = (map_cells(one, RADIUS, WIDTH) for one in (maps.fewer, maps.methods, maps.more))
    for tracker in SWITCHING:
        success = [float(found[tracker].rate.mean()) for found in (fewer, middle, more)]
        holds = success[0] > success[1] > success[2]
        known = ~(np.isnan(fewer[tracker].mean_error) | np.isnan(more[tracker].mean_error))
        change = (fewer[tracker].mean_error - more[tracker].mean_error)[known].mean()
        yield REFERENCES.judge("fewer-succeed", success[0] - success[2], tracker, holds=holds)
        yield REFERENCES.judge("fewer-nearer", change, tracker)


def _share_above(found: CellMap, rate: float) -> float:
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


def wide_swing(pool: Pool, full: bool) -> Findings:
    """Success and error on 25 cells and over the number of particles; the quick form has two layouts of the twenty."""
    swing = REFERENCES.settings["scenes"]["swing"]
    scene = replace(COARSE, layouts=20 if full else 2, values=swing)
    trackers = tuple(REFERENCES.table("swing"))
    table = rows(pool, scene.plan(trackers, 5 if full else 1))
    for tracker in trackers:
        whole = tally(table, tracker=tracker)
        yield REFERENCES.judge("swing", whole.success, tracker, wider=1.0 if full else 3.0)
        if full:
            yield REFERENCES.judge("swing-error", whole.error, tracker)
    if not full:
        return
    for tracker in REFERENCES.table("swing-cell"):
        yield from _compare_cells("swing-cell", _cells(table, scene, tracker=tracker), tracker)
    trackers = tuple(REFERENCES.table("swing-corrected"))
    corrected = rows(pool, scene.plan(trackers, 2, apf_weights="corrected"))
    for tracker in trackers:
        whole = tally(corrected, tracker=tracker)
        yield REFERENCES.judge("swing-corrected", whole.success, tracker)
        yield REFERENCES.judge("swing-corrected-error", whole.error, tracker)
    counts = REFERENCES.table("swing-count")
    scene = replace(SIXTEEN, values=swing, axes=(Axis("sample_count", tuple(counts["h-spf"])),))
    table = rows(pool, scene.plan(tuple(counts), 2))
    for tracker, references in counts.items():
        by_count = {count: tally(table, tracker=tracker, sample_count=count) for count in references}
        for count, whole in by_count.items():
            ground = "stated" if count >= 200 else "trials"
            yield REFERENCES.judge("swing-count", whole.success, tracker, count, ground=ground)
        yield REFERENCES.judge("swing-falls", by_count[200].error - by_count[1600].error, tracker)


# The study of the number of particles (Bando 2007, ch. 3 section 3.3) pools sixteen cells. In Bando 2007 fewer
# particles do better until too few collapse, since more particles populate the tails, which then find look-alikes.
# Success confirms it in both readings of the scene; whether the error falls as well depends on which of them is taken.

QUICK_COUNT_WIDER = 2.0
"""Tolerance with five layouts of twenty."""


def sample_count(pool: Pool, full: bool) -> Findings:
    """Success and error over the number of particles, pooled over sixteen cells, and the cells with 800 particles."""
    stated = REFERENCES.table("count")
    counts = tuple(stated["h-spf"]) if full else (50, 100, 200, 800, 1600)
    scene = replace(SIXTEEN, layouts=20 if full else 5, axes=(Axis("sample_count", counts),))
    table = rows(pool, scene.plan(tuple(stated), 4 if full else 1))
    for tracker in stated:
        pooled = {count: tally(table, tracker=tracker, sample_count=count) for count in counts}
        for count, whole in pooled.items():
            ground = "fewer" if not full else "seeds" if count == 100 else "stated"
            wider = 1.0 if full else QUICK_COUNT_WIDER
            yield REFERENCES.judge("count", whole.success, tracker, count, wider=wider, ground=ground)
            if full and count >= 200:
                yield REFERENCES.judge("count-error", whole.error, tracker, count)
        if full:
            found = _cells(table, SIXTEEN, tracker=tracker, sample_count=800)
            yield from _compare_cells("count-cell", found, tracker)
        success = {count: whole.success for count, whole in pooled.items()}
        peaks = success[200] > success[800] > success[1600] and success[50] < success[100] < success[200]
        yield REFERENCES.judge("count-peaks", success[200] - success[1600], tracker, holds=peaks)
        yield REFERENCES.judge("count-falls", pooled[200].error - pooled[1600].error, tracker)


# The scene and the trackers are varied one by one; nine cells are pooled. The order of the methods survives almost
# every variation; how far they are apart does not: it needs a background level as high as Bando's and a motion model as
# rough.

VARIED = Scene((30, 55, 80), (5, 9, 13))
TRACKERS = ("h-spf", "s-spf", "pc-pf")
QUICK = "baseline", "rho 5 %", "rho 1 %", "matched swing", "corrected weights"


def variations(pool: Pool, full: bool) -> Findings:
    """Success and error of the three methods under each variation; the quick form has four layouts of the twenty."""
    scene, trials = replace(VARIED, layouts=20 if full else 4), 2 if full else 1
    errors = REFERENCES.table("variation-error")
    varied = REFERENCES.settings["variations"]
    for name in varied if full else QUICK:
        table = rows(pool, scene.plan(TRACKERS, trials, **varied[name]))
        whole = {tracker: tally(table, tracker=tracker) for tracker in TRACKERS}
        for tracker, cell in whole.items():
            # The layouts of a cell differ more than its trials do: it is they that count as independent.
            runs = cell.runs // trials
            success = round(cell.success * runs) / runs
            yield REFERENCES.judge("variation", success, tracker, name, runs=runs)
            if full and name in errors[tracker]:
                yield REFERENCES.judge("variation-error", cell.error, tracker, name)
        gap = whole["h-spf"].success - whole["s-spf"].success
        over = whole["s-spf"].success - whole["pc-pf"].success
        if full and name != "corrected weights":
            yield REFERENCES.judge("variation-order", gap, name, holds=gap > -0.05 and over > 0)
