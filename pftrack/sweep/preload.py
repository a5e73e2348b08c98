"""Imports of a pool's fork server, ready for all of its processes."""

import pyarrow.parquet

from pftrack.core.numerics.elementary import exponential
from pftrack.sweep import work

__all__ = ["pyarrow", "work"]

exponential(0.0)  # makes Numba ready, which would cost every process of the pool 0.3 s
