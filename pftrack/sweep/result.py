"""Results: what a sweep computed, finished or as far as it came.

A result is read in pieces, so that two million rows need no more memory than a few.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pftrack.core.files import csv_text, literal
from pftrack.core.model.parameters import Value
from pftrack.sweep import arrow
from pftrack.sweep.axis import SweepError
from pftrack.sweep.journal import chunk_files, partial_of, plan_of
from pftrack.sweep.plan import Plan
from pftrack.sweep.table import conform, schema

ROWS_A_PIECE = 65_536
FAILURES_FIRST = {False: 0, None: 1, True: 2}


@dataclass(frozen=True)
class Result:
    """What a sweep computed.

    Attributes:
        plan: What was to be computed.
        files: Parquet files that hold the rows, by run number.
        complete: Whether all runs are there.
        place: The folder of the chunks, which there may be none of yet.
    """

    plan: Plan
    files: tuple[Path, ...]
    complete: bool
    place: Path | None = None

    @property
    def path(self) -> Path:
        """The result file, or the folder of the chunks that are there so far."""
        return self.place or (self.files[0] if self.complete else self.files[0].parent)

    @property
    def table(self) -> arrow.Table:
        """All rows at once."""
        return arrow.concat_tables([schema(self.plan).empty_table(), *self.pieces()])

    def pieces(self, columns: Sequence[str] | None = None) -> Iterator[arrow.Table]:
        """Yield the rows in pieces, in the order of their numbers.

        Args:
            columns: Those wanted, all if None.
        """
        for path in self.files:
            try:
                with arrow.parquet.ParquetFile(path.absolute(), page_checksum_verification=True) as file:
                    for batch in file.iter_batches(ROWS_A_PIECE, columns=columns):
                        piece = arrow.as_table(batch).replace_schema_metadata(None)
                        yield piece if columns else conform(piece, schema(self.plan))
            except (arrow.ArrowException, OSError):
                if self.complete:
                    raise SweepError(f"{path} is damaged: its description is whole, its rows are not") from None


def read_result(path: Path, plan: Plan | None = None) -> Result:
    """Return the result of a sweep: finished, or what is there so far.

    Args:
        path: The result file, or the folder of chunks beside it.
        plan: What was computed, where that is known; it is read there if not given.

    Raises:
        SweepError: It is not there, foreign, cut short or of another version.
    """
    if not path.exists() and partial_of(path).is_dir():
        path = partial_of(path)
    if path.is_dir():
        return Result(plan or plan_of(path), tuple(chunk_files(path)), complete=False, place=path)
    return Result(plan or plan_of(path), (path,), complete=True)


def read_chunk(path: Path) -> arrow.Table:
    """Return the rows of one chunk's file.

    Raises:
        SweepError: It is damaged.
    """
    try:
        return arrow.parquet.read_table(
            path.absolute(), partitioning=None, page_checksum_verification=True
        ).replace_schema_metadata(None)
    except (arrow.ArrowException, OSError):
        raise SweepError(f"{path} is no Parquet file, or was cut short") from None


def rows_of(
    result: Result, where: Mapping[str, Value], *, limit: int = 200, failures_first: bool = True
) -> list[dict[str, Any]]:
    """Return rows as values that JSON can hold, failures first, then by run number.

    Args:
        result: Where they are.
        where: What columns must be equal to, such as axes and `tracker`.
        limit: The most to return.
        failures_first: Whether runs that failed come before those that succeeded.

    Raises:
        SweepError: There is no such column.
    """
    known = schema(result.plan).names
    for name in where:
        if name not in known:
            raise SweepError(f"the sweep has no column {name!r}; it has {', '.join(known)}")
    found: list[dict[str, Any]] = []
    for piece in result.pieces():
        mask = None
        for name, value in where.items():
            same = arrow.compute.equal(piece[name], arrow.scalar(value, piece.schema.field(name).type))
            mask = same if mask is None else arrow.compute.and_(mask, same)
        chosen = piece if mask is None else piece.filter(mask)
        if failures_first:
            won = arrow.compute.fill_null(arrow.compute.cast(chosen["success"], arrow.float64()), 0.5).to_numpy()
            chosen = chosen.take(np.argsort(won, kind="stable")[:limit])
        found += chosen.slice(0, limit).to_pylist()
        found.sort(key=lambda row: (FAILURES_FIRST[row["success"]] if failures_first else 0, row["run"]))
        del found[limit:]
    for row in found:
        row["estimates_sha256"] = row["estimates_sha256"].hex() if row["estimates_sha256"] else None
    return found


def csv_pieces(result: Result) -> Iterator[bytes]:
    """Yield a result as CSV, piece by piece, the header first; hashes as hexadecimal digits, texts as `literal`."""
    options = arrow.csv.WriteOptions(include_header=False, quoting_style="needed")
    yield csv_text([schema(result.plan).names]).encode()
    for piece in result.pieces():
        place = piece.schema.get_field_index("estimates_sha256")
        digits = [None if it is None else it.hex() for it in piece.column(place).to_pylist()]
        shown = piece.set_column(place, "estimates_sha256", arrow.array(digits, arrow.string()))
        for number, field in enumerate(shown.schema):
            if field.type == arrow.string():
                shown = shown.set_column(number, field.name, _literal(shown.column(number)))
        sink = arrow.BufferOutputStream()
        arrow.csv.write_csv(shown, sink, options)
        yield sink.getvalue().to_pybytes()


def _literal(column: arrow.Array) -> arrow.Array:
    """Return a column of texts as cells of CSV; each text is looked at once, however often it is there."""
    encoded = column.combine_chunks().dictionary_encode()
    return arrow.array([literal(it) for it in encoded.dictionary.to_pylist()], arrow.string()).take(encoded.indices)


def summary(result: Result) -> dict[str, Any]:
    """Return the runs, those with a problem, and the success rate over all and by tracker; rates null if not judged."""
    runs = problems = 0
    judged = dict.fromkeys(result.plan.trackers, 0)
    successes = dict.fromkeys(result.plan.trackers, 0)
    for piece in result.pieces(["tracker", "success", "problem"]):
        runs += len(piece)
        problems += len(piece) - piece["problem"].null_count
        counted = piece.group_by("tracker").aggregate([("success", "count"), ("success", "sum")])
        for row in counted.to_pylist():
            judged[row["tracker"]] += row["success_count"]
            successes[row["tracker"]] += row["success_sum"] or 0
    total = sum(judged.values())
    return {
        "runs": runs,
        "problems": problems,
        "success_rate": sum(successes.values()) / total if total else None,
        "success_rate_by_tracker": {name: successes[name] / count if count else None for name, count in judged.items()},
    }
