"""Columns: the numbers of a run's frames as arrays by name, as files hold them, notebooks show and lessons read them.

What every frame has comes under the names of its diagnostics, and what tracker and experiment have measured under
`series_NAME`, with the probability that the target is lost, where the tracker has one. A number that is not known is
NaN; true and false are 1 and 0.
"""

from typing import Any

import numpy as np

from pftrack.core.model import series
from pftrack.experiments.shared.loss_probability.declaration import LOSS_PROBABILITY
from pftrack.runs.loss_probability import loss_probabilities
from pftrack.runs.run import Run

__all__ = ["PREFIX", "columns_of"]

PREFIX = "series_"
"""Of the columns of what was measured beside what every frame has."""


def columns_of(run: Run) -> dict[str, np.ndarray[Any, Any]]:
    """Return the columns of all frames that were computed, one row a frame; what no frame has is left out."""
    rows = [row.as_dict() for row in run.diagnostics]
    columns = {name: _column([row[name] for row in rows]) for name in rows[0] if name != "series"}
    for declared in run.experiment.all_series():
        values = [row.series.get(declared.name) for row in run.diagnostics]
        if any(value is not None for value in values):
            columns |= {f"{PREFIX}{name}": column for name, column in series.columns(declared, values).items()}
    said = loss_probabilities(run)
    return columns if np.isnan(said).all() else columns | {f"{PREFIX}{LOSS_PROBABILITY.name}": said}


def _column(values: list[Any]) -> np.ndarray[Any, Any]:
    """Return one value a frame as an array; numbers that are missing become NaN."""
    if any(isinstance(value, str) for value in values):
        return np.array(values, dtype=np.str_)
    width = max((len(value) for value in values if isinstance(value, list | tuple)), default=0)
    missing = [np.nan] * width if width else np.nan
    return np.array([missing if value is None else value for value in values], dtype=np.float64)
