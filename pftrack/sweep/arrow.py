"""Arrow, imported when something of it is used first.

It takes a tenth of a second and 45 MiB, which a server on which nobody sweeps need not spend. `arrow.array` is
`pyarrow.array`, `arrow.compute.cast` is `pyarrow.compute.cast`, and so on.
"""

from importlib import import_module
from typing import Any, TypeAlias

# Arrow has no types; these say in signatures what is meant.
Array: TypeAlias = Any
DataType: TypeAlias = Any
Schema: TypeAlias = Any
Table: TypeAlias = Any

PARTS = frozenset({"compute", "csv", "parquet"})
"""Modules of their own."""


def __getattr__(name: str) -> Any:  # noqa: ANN401 - whatever Arrow has
    """Return what Arrow has of this name."""
    return import_module(f"pyarrow.{name}") if name in PARTS else getattr(import_module("pyarrow"), name)


def as_table(batch: Any) -> Table:  # noqa: ANN401 - a record batch
    """Return a table of a record batch alone."""
    return import_module("pyarrow").Table.from_batches([batch])
