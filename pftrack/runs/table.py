"""A run as a table: one row per frame, one number per cell, and title and unit for each column.

CSV, Parquet, NPZ and JSON Lines hold this table, with the column names of `pftrack.runs.loss_probability`. A series of
several numbers per frame has a column for each, `NAME_PART`, with the declared name of the component, "low" and "high"
for an interval, or else the index from 0. Unknown numbers are missing; 1 is true, 0 is false. Columns without any value
are left out.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.series import Series
from pftrack.core.texts import read_texts
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.shared.loss_probability import LOSS_PROBABILITY
from pftrack.runs.loss_probability import PREFIX, columns_of

if TYPE_CHECKING:
    import pyarrow as pa

    from pftrack.runs.run import Run


OWN = read_texts(Path(__file__).with_name("columns.yaml"))[0]
"""Titles of the columns of every run."""

UNITS = {"time_s": "s", "extent": "px", "step_ms": "ms"}
IN_UNIT_OF_RUN = ("estimate", "sigma", "truth", "error")
PARTS = {"extent": ("width", "height")}


@dataclass(frozen=True, eq=False)
class Column:
    """A column of the table of a run of L frames.

    Attributes:
        name: Name in files.
        title: Title in a few words.
        unit: Unit of the numbers; empty for pure numbers.
        values: (L,) numbers, NaN where unknown; only the frame is an integer.
    """

    name: str
    title: str
    unit: str
    values: NDArray[Any]


@dataclass(frozen=True, slots=True)
class _Origin:
    """Titles and units of an array of columns."""

    title: str
    unit: str
    parts: tuple[str, ...] = ()


def columns_in(run: "Run") -> tuple[Column, ...]:
    """Return the columns of all computed frames of a run."""
    origins = dict(_origins(run.experiment))
    return tuple(
        column
        for name, array in columns_of(run).items()
        if not np.isnan(array).all()
        for column in _split(name, array, origins[name])
    )


def table_of(run: "Run") -> "pa.Table":
    """Return the computed frames of a run as an Arrow table; the metadata of its fields hold title and unit."""
    import pyarrow as pa  # noqa: PLC0415 - takes a tenth of a second, and few need it

    columns = columns_in(run)
    fields = [
        pa.field(it.name, pa.from_numpy_dtype(it.values.dtype), metadata={"title": it.title, "unit": it.unit})
        for it in columns
    ]
    arrays = [pa.array(it.values, from_pandas=True) for it in columns]  # so that NaN becomes a missing number
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields))


def clouds_of(run: "Run") -> dict[str, NDArray[Any]]:
    """Return the particles of the L frames that a run has computed; nothing if it has none.

    Returns:
        `cloud` (L, n, d) in the units of the model, NaN where a frame has fewer; `cloud_log_weights` (L, n), -inf
        there; `cloud_ancestors` (L, n), places in the frame before, -1 where they are not known.
    """
    found = [run.experiment.trackers[step.tracker].cloud(step.state) for step in run.replay(0, run.computed)]
    known = [(frame, one) for frame, one in enumerate(found) if one is not None]
    if not known:
        return {}
    count, dimension = np.max([one.states.shape for _, one in known], axis=0)
    cloud = np.full((len(found), count, dimension), np.nan)
    logs, parents = np.full(cloud.shape[:2], -np.inf), np.full(cloud.shape[:2], -1)
    for frame, one in known:
        n, d = one.states.shape
        cloud[frame, :n, :d], logs[frame, :n] = one.states, one.log_weights
        if one.ancestors is not None:
            parents[frame, :n] = one.ancestors
    return {"cloud": cloud, "cloud_log_weights": logs, "cloud_ancestors": parents}


def dataset_of(run: "Run", *, particles: bool) -> Any:  # noqa: ANN401 - xarray's, which is an extra
    """Return the frames that a run has computed as a dataset of xarray, with their particles if wanted."""
    import xarray  # noqa: PLC0415 - only who wants it has to have it

    about = {it.name: ("frame", it.values, {"long_name": it.title, "units": it.unit}) for it in columns_in(run)}
    clouds = clouds_of(run) if particles else {}
    spread = {name: (("frame", "particle", "component")[: array.ndim], array) for name, array in clouds.items()}
    frame = {"frame": about.pop("frame")}
    return xarray.Dataset({**about, **spread}, frame, {"recipe": run.recipe.model_dump_json()})


def _origins(experiment: Experiment) -> Iterator[tuple[str, _Origin]]:
    for name, title in OWN.items():
        unit = experiment.judge.unit if name in IN_UNIT_OF_RUN else UNITS.get(name, "")
        yield name, _Origin(title, unit, PARTS.get(name, ()))
    for item in (*experiment.all_series(), LOSS_PROBABILITY):
        name = f"{PREFIX}{item.name}"
        yield name, _Origin(item.title, item.unit, _parts(item))
        if item.shape == "hypotheses":
            yield f"{name}_weights", _Origin(f"probability of {item.title}", "")
            yield f"{name}_parents", _Origin(f"parent of {item.title} in the frame before", "")


def _parts(series: Series) -> tuple[str, ...]:
    return ("low", "high") if series.shape == "interval" else series.components


def _split(name: str, array: NDArray[Any], origin: _Origin) -> Iterator[Column]:
    """Return the columns (L,) of an array (L, ...)."""
    if name == "frame":
        array = array.astype(np.int64)
    for place in np.ndindex(array.shape[1:]):
        parts = [str(number) for number in place]
        if parts and place[-1] < len(origin.parts):
            parts[-1] = origin.parts[place[-1]]
        slug = re.sub(r"\W+", "_", "_".join((name, *parts)))
        yield Column(slug, ", ".join((origin.title, *parts)), origin.unit, array[(slice(None), *place)])
