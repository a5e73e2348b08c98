"""The table of a run as files: CSV, Parquet, NPZ and JSON Lines, all with the same columns.

They are written piece by piece: of a long run there is never the whole text in memory.
"""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from pftrack.runs.manifest import embed
from pftrack.runs.run import Run
from pftrack.runs.table import columns_in, table_of

__all__ = ["MEMBER", "csv_of", "json_lines_of", "npz_of", "parquet_of"]

MEMBER = "manifest"
"""Name of the manifest among the members of an NPZ file."""

METADATA = b"pftrack"
"""Key of the manifest in the metadata of a Parquet file."""

PIECE_FRAMES = 5_000

Steps = Iterator[tuple[int, int]]
"""(frames written, of all)."""


def csv_of(run: Run, path: Path) -> Steps:
    """Write a run's table as CSV, a line of names first; what is not known is empty."""
    from pyarrow import csv  # noqa: PLC0415 - see `table_of`

    table = table_of(run)
    with csv.CSVWriter(str(path), table.schema, write_options=csv.WriteOptions(quoting_style="needed")) as file:
        for batch in table.to_batches(PIECE_FRAMES):
            file.write_batch(batch)
            yield _first(batch) + batch.num_rows, table.num_rows


def parquet_of(run: Run, path: Path) -> Steps:
    """Write a run's table as Parquet, with the manifest in its metadata, and title and unit in those of each column."""
    from pyarrow import parquet  # noqa: PLC0415 - see `table_of`

    table = table_of(run)
    schema = table.schema.with_metadata({METADATA: embed(run).encode()})
    with parquet.ParquetWriter(path, schema, compression="zstd") as file:
        for batch in table.replace_schema_metadata(schema.metadata).to_batches(PIECE_FRAMES):
            file.write_batch(batch)
            yield _first(batch) + batch.num_rows, table.num_rows


def npz_of(run: Run, path: Path) -> Steps:
    """Write a run's table as NPZ, an array (L,) a column, and the manifest as the text `manifest`."""
    arrays: dict[str, Any] = {MEMBER: np.array(embed(run)), **{it.name: it.values for it in columns_in(run)}}
    with path.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)
    yield run.computed + 1, run.computed + 1


def json_lines_of(run: Run, path: Path) -> Steps:
    """Write a run's table as JSON Lines, an object a frame; a number that is not known or not finite is null."""
    table = table_of(run)
    with path.open("w", encoding="ascii", newline="\n") as file:
        for batch in table.to_batches(PIECE_FRAMES):
            file.writelines(f"{json.dumps(_plain(row), allow_nan=False)}\n" for row in batch.to_pylist())
            yield _first(batch) + batch.num_rows, table.num_rows


def _first(batch: Any) -> int:  # noqa: ANN401 - pyarrow has no types
    return int(batch.column("frame")[0].as_py())


def _plain(row: dict[str, Any]) -> dict[str, Any]:
    return {name: value if value is not None and math.isfinite(value) else None for name, value in row.items()}
