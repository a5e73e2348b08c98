"""Studies of the ball by the thousand runs: plans, carried out in the pool, and what is counted of their rows.

Three of them are here: how many particles, what the result hangs on, and one step whose exact answer is known.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain, product

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from pftrack.core.model.parameters import Value
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.filters import auxiliary, bootstrap
from pftrack.filters.auxiliary import WeightRule
from pftrack.filters.dynamics import autoregression
from pftrack.filters.particles import ParticleSet
from pftrack.reproduce.finding import CHOSEN, FEWER, PROTOCOL, Finding, claim, compare, share
from pftrack.reproduce.pool import Pool
from pftrack.sources.recording import LAYOUTS, paint_disc
from pftrack.sweep import Plan
from pftrack.sweep.axis import Axis
from pftrack.sweep.table import Chunks
from pftrack.sweep.work import as_text, compute_chunk
from pftrack.vision.likelihoods import chromaticity

FRAMES = 60
RUNS_A_PIECE = 120


@dataclass(frozen=True)
class Scene:
    """The simulated ball over a grid of occluder widths and look-alike radii, in all or some of the layouts.

    Attributes:
        widths: Of the occluder, px.
        radii: Of the look-alikes, px.
        layouts: How many of the twenty layouts; those taken are spread evenly.
        values: What else differs from Bando's scene.
        axes: What else is varied.
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
        runs: How many.
        successes: How many of them succeeded.
        error: Mean error of those, px; NaN if there are none.
        observation_share: Mean share of the particles from the observation sampler; NaN where there is none.
        errors: Of each successful run, px.
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


def cells(table: pa.Table, scene: Scene, **which: Value) -> list[Tally]:
    """Count the rows of each cell of a scene, by occluder width and then look-alike radius; see `tally`."""
    return [
        tally(table, **which, occlusion_width_px=width, distracter_radius_px=radius)
        for width, radius in product(scene.widths, scene.radii)
    ]


def compare_cells(
    title: str,
    found: Sequence[Tally],
    scene: Scene,
    references: Sequence[Sequence[float]],
    reference_runs: int,
    source: str,
) -> list[Finding]:
    """Judge the success of each cell of a scene.

    Args:
        title: Name of study and quantity.
        found: By `cells`.
        scene: The grid.
        references: Success rates that they should be; rows by occluder width, columns by look-alike radius.
        reference_runs: From how many runs each of them is.
        source: Where they come from.
    """
    places = product(scene.widths, scene.radii)
    return [
        share(f"{title} at width {width}, radius {radius}", cell.successes, cell.runs, wanted, reference_runs, source)
        for (width, radius), cell, wanted in zip(places, found, chain(*references), strict=True)
    ]


def _share(table: pa.Table) -> float:
    """Return the mean share by observation; NaN where the trackers draw no particles by observation."""
    if "observation_share" not in table.column_names:
        return float("nan")
    known = table["observation_share"].drop_null().to_numpy()
    return float(known.mean()) if len(known) else float("nan")


# The study of the number of particles (Bando 2007, ch. 3 section 3.3) pools sixteen cells. In Bando 2007 fewer
# particles do better until too few collapse, since more particles populate the tails, which then find look-alikes.
# Success confirms it in both readings of the scene; whether the error falls as well depends on which of them is taken.

SOURCE = "Bando 2007, ch. 3 section 3.3; reference implementation"
CELL_RUNS = 80
SHARED_SEEDS_ALLOWANCE = 0.08
"""With a hundred particles runs with the same seed are lost alike in all cells, and the reference shares eighty seeds
between cells, where ours differ: ours is 0.32 whatever the seeds."""

SHARED_SEEDS = "three standard errors of the reference's eighty seeds, which all of its cells share"
QUICK_WIDER = 2.0
"""Of five layouts of twenty."""

OTHER_READING = "it holds in the other reading of the scene only, and so it does in the reference"

SUCCESS: dict[str, dict[int, float]] = {
    "h-spf": {50: 0.040, 100: 0.267, 200: 0.622, 400: 0.596, 800: 0.523, 1200: 0.460, 1600: 0.381},
    "s-spf": {50: 0.022, 100: 0.193, 200: 0.441, 400: 0.426, 800: 0.316, 1200: 0.257, 1600: 0.229},
}
ERROR: dict[str, dict[int, float]] = {
    "h-spf": {50: 13.2, 100: 10.5, 200: 5.4, 400: 4.7, 800: 4.8, 1200: 5.1, 1600: 5.0},
    "s-spf": {50: 16.5, 100: 10.9, 200: 7.7, 400: 6.1, 800: 5.8, 1200: 5.9, 1600: 5.9},
}
CELLS: dict[str, tuple[tuple[float, ...], ...]] = {
    "h-spf": ((0.96, 0.93, 0.68, 0.31), (0.96, 0.82, 0.61, 0.29), (0.94, 0.72, 0.50, 0.17), (0.41, 0.06, 0.0, 0.0)),
    "s-spf": ((0.95, 0.55, 0.28, 0.11), (0.95, 0.54, 0.16, 0.03), (0.90, 0.41, 0.12, 0.03), (0.01, 0.01, 0.0, 0.0)),
}
"""With 800 particles; rows by occluder width, columns by look-alike radius."""


def sample_count(pool: Pool, full: bool) -> list[Finding]:
    """Success and error over the number of particles, pooled over sixteen cells, and the cells with 800 particles."""
    counts = tuple(SUCCESS["h-spf"]) if full else (50, 100, 200, 800, 1600)
    scene = replace(SIXTEEN, layouts=20 if full else 5, axes=(Axis("sample_count", counts),))
    table = rows(pool, scene.plan(("h-spf", "s-spf"), 4 if full else 1))
    findings = []
    for tracker, references in SUCCESS.items():
        pooled = {count: tally(table, tracker=tracker, sample_count=count) for count in counts}
        for count, whole in pooled.items():
            name = f"sample-count: {tracker}, success with N = {count}"
            allowed = (SHARED_SEEDS_ALLOWANCE if count == 100 else 0.05) * (1.0 if full else QUICK_WIDER)
            ground = FEWER if not full else SHARED_SEEDS if count == 100 else PROTOCOL
            findings.append(compare(name, whole.success, references[count], allowed, SOURCE, ground=ground))
            if full and count >= 200:
                name = f"sample-count: {tracker}, error with N = {count}, px"
                findings.append(compare(name, whole.error, ERROR[tracker][count], 0.5, SOURCE, ground=CHOSEN))
        if full:
            found = cells(table, SIXTEEN, tracker=tracker, sample_count=800)
            title = f"sample-count: {tracker}, success with N = 800"
            findings += compare_cells(title, found, SIXTEEN, CELLS[tracker], CELL_RUNS, SOURCE)
        success = {count: whole.success for count, whole in pooled.items()}
        holds = success[200] > success[800] > success[1600] and success[50] < success[100] < success[200]
        name = f"sample-count: {tracker}, success peaks between too few and too many (N = 200 less N = 1600)"
        findings.append(claim(name, success[200] - success[1600], holds=holds, source=SOURCE))
        name = f"sample-count: {tracker}, the error falls as well with N from 1600 to 200, px"
        change = pooled[200].error - pooled[1600].error
        holds = change < -0.25
        findings.append(claim(name, change, holds=holds, source="Bando 2007, ch. 3 section 3.3", known=OTHER_READING))
    return findings


# The scene and the trackers are varied one by one; nine cells are pooled. The order of the methods survives almost
# every variation; how far they are apart does not: it needs a background level as high as Bando's and a motion model as
# rough.

SENSITIVITY_SOURCE = "reference implementation"
WIDTHS = (30, 55, 80)
RADII = (5, 9, 13)
REFERENCE_RUNS = 360
TRACKERS = ("h-spf", "s-spf", "pc-pf")

SCATTER = "as far as the error of successful runs moves with other seeds"

Row = tuple[str, dict[str, Value], dict[str, tuple[float, float | None]]]

VARIATIONS: tuple[Row, ...] = (
    ("baseline", {}, {"h-spf": (0.550, 4.6), "s-spf": (0.317, 6.0), "pc-pf": (0.017, None)}),
    (
        "multinomial resampling",
        {"resampling": "multinomial"},
        {"h-spf": (0.544, 5.0), "s-spf": (0.333, 6.2), "pc-pf": (0.017, None)},
    ),
    (
        "rho 5 %",
        {"background_level": 0.05},
        {"h-spf": (0.544, 4.2), "s-spf": (0.525, 4.5), "pc-pf": (0.186, None)},
    ),
    (
        "rho 1 %",
        {"background_level": 0.01},
        {"h-spf": (0.850, 3.1), "s-spf": (0.825, 2.9), "pc-pf": (0.711, 2.9)},
    ),
    ("b = 2", {"process_noise_px": 2}, {"h-spf": (0.364, None), "s-spf": (0.039, None), "pc-pf": (0.003, None)}),
    ("b = 4", {"process_noise_px": 4}, {"h-spf": (0.325, None), "s-spf": (0.214, None), "pc-pf": (0.011, None)}),
    ("slots at 40 px", {"slot_offset_px": 40}, {"h-spf": (0.350, None), "s-spf": (0.219, None), "pc-pf": (0.0, None)}),
    (
        "slots at 60 px",
        {"slot_offset_px": 60},
        {"h-spf": (0.664, None), "s-spf": (0.433, None), "pc-pf": (0.019, None)},
    ),
    (
        "matched swing",
        {"assumed_period_frames": 30},
        {"h-spf": (0.731, 1.5), "s-spf": (0.686, 1.3), "pc-pf": (0.258, None)},
    ),
    (
        "60 frames/s",
        {"frame_rate_hz": 60, "process_noise_px": 0.8, "slot_offset_px": 30},
        {"h-spf": (0.869, 4.5), "s-spf": (0.856, 4.1), "pc-pf": (0.197, None)},
    ),
    (
        "amplitude 50 px",
        {"amplitude_px": 50, "process_noise_px": 1.5},
        {"h-spf": (0.322, 3.8), "s-spf": (0.286, 4.6), "pc-pf": (0.028, None)},
    ),
    ("region 10 px", {"lost_radii": 2}, {"h-spf": (0.494, None), "s-spf": (0.303, None), "pc-pf": (0.0, None)}),
    (
        "initial sd 3 px",
        {"initial_sd_px": 3},
        {"h-spf": (0.494, None), "s-spf": (0.317, None), "pc-pf": (0.014, None)},
    ),
    (
        "corrected weights",
        {"apf_weights": "corrected"},
        {"h-spf": (0.0, None), "s-spf": (0.0, None), "pc-pf": (0.017, None)},
    ),
)
"""Variation, what it changes, and success and error (px) of each tracker."""


QUICK = "baseline", "rho 5 %", "rho 1 %", "matched swing", "corrected weights"


def variations(pool: Pool, full: bool) -> list[Finding]:
    """Success and error of the three methods under each variation; the quick form has four layouts of the twenty."""
    scene = Scene(WIDTHS, RADII, layouts=20 if full else 4)
    findings = []
    for name, values, references in VARIATIONS:
        if not full and name not in QUICK:
            continue
        table = rows(pool, scene.plan(TRACKERS, 2 if full else 1, **values))
        whole = {tracker: tally(table, tracker=tracker) for tracker in TRACKERS}
        for tracker, (success, error) in references.items():
            cell = whole[tracker]
            # The layouts of a cell differ more than its trials do: it is they that count as independent.
            runs = cell.runs // (2 if full else 1)
            title = f"sensitivity: {tracker}, {name}, success"
            findings.append(share(title, round(cell.success * runs), runs, success, REFERENCE_RUNS, SENSITIVITY_SOURCE))
            if full and error is not None:
                title = f"sensitivity: {tracker}, {name}, error, px"
                findings.append(compare(title, cell.error, error, 1.0, SENSITIVITY_SOURCE, ground=SCATTER))
        gap = whole["h-spf"].success - whole["s-spf"].success
        over = whole["s-spf"].success - whole["pc-pf"].success
        if full and values.get("apf_weights") is None:
            holds = gap > -0.05 and over > 0
            statement = f"sensitivity: h-SPF is not behind s-SPF, nor s-SPF behind PC-PF, {name} (gap of the first two)"
            findings.append(claim(statement, gap, holds=holds, source=SENSITIVITY_SOURCE))
    return findings


# The exact answer of one step is known by quadrature (docs/methods/filters.md). Parents of equal weight lie at rest
# around (160, 120) with a spread of 10 px, constant velocity, process noise 3 px, and one red disc of radius 5 px at
# (170, 120). With a million particles every sampler must be within 0.05 px of the posterior that its weight rule aims
# at.

ORACLE_SOURCE = "quadrature"
PARTICLES = 1_000_000

POSTERIOR = (3.953, 9.352)
SHARPENED = (8.181, 5.861)
SHARPENED_HALF = (6.861, 7.395)
"""Mean and standard deviation of u - 160, px; the last for one half of the particles by observation."""

CASES: tuple[tuple[str, float, WeightRule, tuple[float, float]], ...] = (
    ("Condensation", 0.0, "corrected", POSTERIOR),
    ("APF, corrected", 1.0, "corrected", POSTERIOR),
    ("APF, sharpened", 1.0, "sharpened", SHARPENED),
    ("s-SPF half and half, corrected", 0.5, "corrected", POSTERIOR),
    ("s-SPF half and half, balanced", 0.5, "balanced", POSTERIOR),
    ("s-SPF half and half, sharpened", 0.5, "sharpened", SHARPENED_HALF),
)


def one_step(pool: Pool, full: bool) -> list[Finding]:
    """Mean and spread of the posterior of one step, for each sampler and weight rule."""
    del full
    findings = []
    for (name, _, _, (mean, spread)), outcome in zip(CASES, pool.map(_moments, range(len(CASES))), strict=True):
        findings.append(compare(f"one-step: mean, {name}", outcome[0], mean, 0.05, ORACLE_SOURCE, ground=PROTOCOL))
        findings.append(compare(f"one-step: sd, {name}", outcome[1], spread, 0.05, ORACLE_SOURCE, ground=PROTOCOL))
    return findings


def _moments(case: int) -> tuple[float, float]:
    _, share, rule, _ = CASES[case]
    image = np.full((240, 320, 3), 100, dtype=np.uint8)
    paint_disc(image, 170.0, 120.0, 5.0, (200, 50, 50))
    model = chromaticity.ColourModel((2 / 3, 1 / 6), (0.05, np.inf))
    one = np.eye(2)
    dynamics = autoregression(2 * one, -one, np.zeros(2), 3 * one)
    positions = np.array([160.0, 120.0]) + 10 * Stream(0, case, Purpose.START).standard_normal((PARTICLES, 2))
    parents = ParticleSet.uniform(np.hstack([positions, positions]))
    rng = Stream(0, case, Purpose.TRACK)
    observed = round(PARTICLES * share)

    def log_likelihood(
        states: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
    ) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
        return chromaticity.log_likelihood(image, states, model, 0.1)

    posterior = (
        bootstrap.step(parents, dynamics, log_likelihood, rng)
        if observed == 0
        else auxiliary.step(
            parents,
            dynamics,
            log_likelihood,
            rng,
            weights=rule,
            prediction_count=PARTICLES - observed,
            observation_count=observed,
        )
    )
    mean, covariance = posterior.particles.moments
    return float(mean[0] - 160.0), float(np.sqrt(covariance[0, 0]))
