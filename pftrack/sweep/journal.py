"""Journals and results: the files of a sweep, which keep everything computed, and their reader.

A running sweep has a folder `OUT.partial` next to its result `OUT`, with the plan in `plan.json`, its division into
chunks in `chunks.json`, and one file `000123.parquet` for each finished chunk. Every file is written under another name
and renamed, so that it is complete or missing. At the end the chunks are copied in order into `OUT`, which is renamed
likewise, and the folder is removed. The metadata of every Parquet file hold the plan.

A result is the computed part of a sweep, finished or not. It is read in pieces, so that two million rows need no more
memory than a few.
"""

import fcntl
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pftrack.core.files import csv_text, literal, write_whole
from pftrack.core.model.parameters import Value
from pftrack.core.version import __version__
from pftrack.sweep import arrow
from pftrack.sweep.axis import SweepError
from pftrack.sweep.plan import Plan
from pftrack.sweep.table import Chunk, Chunks, conform, schema

FORMAT, VERSION = "pftrack-sweep", 1
METADATA = b"pftrack-sweep"
PARTIAL = ".partial"
PLAN, CUT, CLAIM, WHOLE = "plan.json", "chunks.json", "claim", "whole.parquet.part"

ROWS_A_GROUP = 65_536
"""Rows of a Parquet row group: few enough for memory, enough to compress and to skip."""


class Journal:
    """The files of one sweep.

    Attributes:
        plan: The plan.
        out: Path of the result.
        folder: Folder of the chunks until the sweep has finished.
    """

    def __init__(self, plan: Plan, out: Path) -> None:
        self.plan = plan
        self.out = out
        self.folder = partial_of(out)

    @property
    def finished(self) -> bool:
        """Whether the result exists."""
        return self.out.exists()

    @contextmanager
    def claim(self) -> Iterator[None]:
        """Lock the sweep while computing it; the lock ends with the process.

        Raises:
            SweepError: Another process is computing it.
        """
        if not self.folder.exists():
            yield
            return
        with (self.folder / CLAIM).open("wb") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                raise SweepError(f"{self.out} is being computed by another process") from None
            yield

    def check_version(self) -> None:
        """Refuse to resume a sweep of another version, whose numbers may differ.

        Raises:
            SweepError: Another version of pftrack began it.
        """
        if self.finished:
            return
        begun_with = _read_plan(self.folder).get("pftrack")
        if begun_with != __version__:
            raise SweepError(
                f"{self.out} was begun with pftrack {begun_with}, this is {__version__}; rows of both would not "
                f"compare, so resume with that version or start again"
            )

    def chunks(self) -> Chunks | None:
        """Return the division of the plan into chunks, or None if there is none yet.

        Raises:
            SweepError: The file with the division is damaged.
        """
        try:
            cut = json.loads((self.folder / CUT).read_text())
            return Chunks(self.plan, int(cut["conditions"]), int(cut["trials"]))
        except FileNotFoundError:
            return None
        except (ValueError, KeyError, TypeError):
            raise SweepError(f"{self.folder / CUT} does not hold the division into chunks; it is truncated") from None

    def cut(self, chunks: Chunks) -> None:
        """Write the division of the plan into chunks, which stays the same from now on."""
        write_whole(self.folder / CUT, json.dumps({"conditions": chunks.conditions, "trials": chunks.trials}).encode())

    def keep(self, chunk: Chunk, data: bytes) -> None:
        """Keep a finished chunk: the bytes of its Parquet file."""
        write_whole(self.folder / f"{chunk.number:06d}.parquet", data)

    def complete_chunks(self, chunks: Chunks) -> set[int]:
        """Return the numbers of the complete chunks, without damaged ones.

        Raises:
            SweepError: A file in the folder belongs to another sweep.
        """
        kept = set()
        for path in chunk_files(self.folder):
            number = int(path.stem)
            plan, rows = _look(path, self.plan)
            if plan != self.plan or number >= len(chunks):
                raise SweepError(f"{path} belongs to another sweep; move it away to resume")
            if rows == chunks[number].runs:
                kept.add(number)
        return kept

    def finish(self) -> None:
        """Write the result from the chunks, when all of them are complete."""
        part = self.folder.absolute() / WHOLE  # Arrow takes a relative name with a colon for an address
        described = schema(self.plan).with_metadata(metadata(self.plan))
        with arrow.parquet.ParquetWriter(part, described, compression="zstd", write_page_checksum=True) as writer:
            pending: list[arrow.Table] = []
            rows = 0
            for path in chunk_files(self.folder):
                pending.append(conform(_rows(path, "is damaged; remove it and continue with --resume"), described))
                rows += len(pending[-1])
                if sum(len(table) for table in pending) >= ROWS_A_GROUP:
                    writer.write_table(arrow.concat_tables(pending), row_group_size=ROWS_A_GROUP)
                    pending = []
            if pending:
                writer.write_table(arrow.concat_tables(pending), row_group_size=ROWS_A_GROUP)
        if rows != self.plan.runs:
            raise SweepError(f"{self.folder} has {rows:,} of {self.plan.runs:,} rows; use --resume {self.out}")
        part.replace(self.out)

    def clear(self) -> None:
        """Remove the sweep's own files, and the folder unless it holds other files."""
        named = (self.folder / name for name in (PLAN, CUT, CLAIM))
        for path in (*chunk_files(self.folder), *self.folder.glob("*.part"), *named):
            path.unlink(missing_ok=True)
        with suppress(OSError):
            self.folder.rmdir()


def begin(plan: Plan, out: Path) -> Journal:
    """Make the folder of a new sweep, without computing anything yet.

    Args:
        plan: The plan.
        out: Path of the result.

    Raises:
        SweepError: The file or a begun sweep exists already; nothing is overwritten.
        OSError: The folder cannot be written.
    """
    journal = Journal(plan, out)
    if out.exists():
        raise SweepError(f"{out} exists already; a sweep overwrites nothing, so name another file or remove it")
    if journal.folder.exists():
        raise SweepError(f"{out} was begun already; continue with --resume {out}, or remove {journal.folder}")
    journal.folder.mkdir()
    write_whole(journal.folder / PLAN, json.dumps(_describe(plan), indent=1).encode())
    return journal


def resume(out: Path) -> Journal:
    """Return the journal of a begun sweep.

    Args:
        out: Path of the result or of the folder of chunks.

    Raises:
        SweepError: No sweep was begun there, or its files are foreign, truncated or of another version. No file is
            changed.
    """
    if out.name.endswith(PARTIAL):
        out = out.with_name(out.name.removesuffix(PARTIAL))
    if out.exists():
        return Journal(plan_of(out), out)
    if not partial_of(out).is_dir():
        raise SweepError(f"the sweep {out} does not exist, neither finished nor begun")
    return Journal(plan_of(partial_of(out)), out)


def plan_of(path: Path) -> Plan:
    """Return the plan of a result, of a folder of chunks or of a single chunk.

    Raises:
        SweepError: The file is foreign, truncated or of another version.
    """
    if path.is_dir():
        return _plan(_read_plan(path), path)
    return _look(path, None)[0]


def metadata(plan: Plan) -> dict[bytes, bytes]:
    """Return the metadata of every Parquet file of a sweep."""
    return {METADATA: json.dumps(_describe(plan)).encode()}


def partial_of(out: Path) -> Path:
    """Return the folder of chunks for a result."""
    return out.with_name(out.name + PARTIAL)


def chunk_files(folder: Path) -> list[Path]:
    """Return the files of finished chunks in the order of their numbers."""
    return sorted(path for path in folder.glob("*.parquet") if path.stem.isdecimal())


def _rows(path: Path, problem: str) -> arrow.Table:
    try:
        # `read_table` would import pandas where that is installed.
        return arrow.parquet.ParquetFile(path.absolute(), page_checksum_verification=True).read()
    except (arrow.ArrowException, OSError):
        raise SweepError(f"{path} {problem}") from None


def _read_plan(folder: Path) -> Any:  # noqa: ANN401 - JSON of anybody
    try:
        return json.loads((folder / PLAN).read_text())
    except FileNotFoundError:
        raise SweepError(f"{folder} is not the folder of a sweep: it has no {PLAN}") from None
    except ValueError:
        raise SweepError(f"{folder / PLAN} was cut short") from None


def _look(path: Path, expected: Plan | None) -> tuple[Plan, int]:
    """Return plan and number of rows of a Parquet file; for a damaged chunk of the expected plan return 0 rows."""
    try:
        with arrow.parquet.ParquetFile(path.absolute()) as file:
            found, rows = file.schema_arrow.metadata or {}, file.metadata.num_rows
    except FileNotFoundError:
        raise SweepError(f"the file {path} does not exist") from None
    except (arrow.ArrowException, OSError):
        if expected is not None:
            return expected, 0
        raise SweepError(f"{path} is not a Parquet file, or was cut short") from None
    if METADATA not in found:
        raise SweepError(f"{path} is a Parquet file, but none that a sweep wrote")
    if expected is not None and found == metadata(expected):
        return expected, rows
    try:
        raw = json.loads(found[METADATA])
    except ValueError:
        raise SweepError(f"{path} does not say what was computed: its description is damaged") from None
    return _plan(raw, path), rows


def _plan(raw: Any, path: Path) -> Plan:  # noqa: ANN401 - JSON of anybody
    if not isinstance(raw, dict) or raw.get("format") != FORMAT:
        raise SweepError(f"{path} describes no sweep")
    if raw.get("version") != VERSION:
        raise SweepError(f"{path} is of format {raw.get('version')}, this version of pftrack reads format {VERSION}")
    try:
        return Plan.from_dict(raw.get("plan", {}))
    except SweepError as error:
        raise SweepError(f"{path} does not fit this version of pftrack: {error}") from None


def _describe(plan: Plan) -> dict[str, object]:
    return {"format": FORMAT, "version": VERSION, "pftrack": __version__, "plan": plan.as_dict()}


ROWS_A_PIECE = 65_536
FAILURES_FIRST = {False: 0, None: 1, True: 2}


@dataclass(frozen=True)
class Result:
    """The rows of a sweep, complete or not.

    Attributes:
        plan: The plan.
        files: Parquet files with the rows, in the order of run numbers.
        complete: Whether all runs have been computed.
        place: Folder of the chunks, even without chunks.
    """

    plan: Plan
    files: tuple[Path, ...]
    complete: bool
    place: Path | None = None

    @property
    def path(self) -> Path:
        """Path of the result file or of the folder of chunks."""
        return self.place or (self.files[0] if self.complete else self.files[0].parent)

    @property
    def table(self) -> arrow.Table:
        """All rows at once."""
        return arrow.concat_tables([schema(self.plan).empty_table(), *self.pieces()])

    def pieces(self, columns: Sequence[str] | None = None) -> Iterator[arrow.Table]:
        """Yield the rows in pieces, in the order of run numbers.

        Args:
            columns: Names of the columns to read (default: all).
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
    """Return the result of a sweep, finished or not.

    Args:
        path: Path of the result file or of the folder of chunks.
        plan: The plan, if known; by default it is read from the files.

    Raises:
        SweepError: The file is missing, foreign, truncated or of another version.
    """
    if not path.exists() and partial_of(path).is_dir():
        path = partial_of(path)
    if path.is_dir():
        return Result(plan or plan_of(path), tuple(chunk_files(path)), complete=False, place=path)
    return Result(plan or plan_of(path), (path,), complete=True)


def read_chunk(path: Path) -> arrow.Table:
    """Return the rows of one chunk's file.

    Raises:
        SweepError: The file is damaged.
    """
    return _rows(path, "is not a Parquet file, or was cut short").replace_schema_metadata(None)


def rows_of(
    result: Result, where: Mapping[str, Value], *, limit: int = 200, failures_first: bool = True
) -> list[dict[str, Any]]:
    """Return rows as JSON values, sorted by failure and run number.

    Args:
        result: Result with the rows.
        where: Values that columns must have, such as axes and `tracker`.
        limit: Largest number of rows to return.
        failures_first: Whether failed runs come before successful ones.

    Raises:
        SweepError: A column does not exist.
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
    """Return a column of texts as cells of CSV; each different text is converted once."""
    encoded = column.combine_chunks().dictionary_encode()
    return arrow.array([literal(it) for it in encoded.dictionary.to_pylist()], arrow.string()).take(encoded.indices)
