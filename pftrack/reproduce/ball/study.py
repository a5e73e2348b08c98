"""Studies by the thousand runs: plans, carried out in the pool, and what is counted of their rows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import chain, product

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from pftrack.core.model.parameters import Value
from pftrack.reproduce.finding import Finding, share
from pftrack.reproduce.pool import Pool
from pftrack.sources.overlay import LAYOUTS
from pftrack.sweep import Axis, Plan
from pftrack.sweep.chunks import Chunks
from pftrack.sweep.work import as_text, compute_chunk

__all__ = ["COARSE", "SIXTEEN", "Scene", "Tally", "cells", "compare_cells", "rows", "tally"]

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
