"""Functions of the process that computes a sweep, measures one, or reports on it.

It ends with the server and may be killed at any moment: computed runs are kept.
"""

import errno
import re
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, TypeAlias

from pftrack.core.refusal import RefusedError
from pftrack.experiments.own.code import trust
from pftrack.sources.sequence import Recording
from pftrack.sweep import Plan, arrow, carry_out, estimate, read_result
from pftrack.sweep.axis import SweepError
from pftrack.sweep.journal import metadata
from pftrack.sweep.table import schema

Form: TypeAlias = Literal["parquet", "csv", "html", "png", "svg"]
"""File formats of a sweep; CSV is streamed and needs no file."""


COMPLAINTS = {
    errno.ENOSPC: "The disk of the server is full.",
    errno.EFBIG: "The result is larger than a sweep on this server may be.",
    errno.EDQUOT: "The disk quota of the server is used up.",
    errno.ENOMEM: "There was not enough memory.",
}


PATH = re.compile(r"(?<![\w.])/[^\s:;,)]+")
LONGEST = 300


@contextmanager
def _without_paths() -> Iterator[None]:
    """Turn errors of the library and the system, whose messages name paths, into refusals."""
    try:
        yield
    except SweepError as error:
        raise RefusedError(PATH.sub("a file", str(error).strip().splitlines()[-1])[:LONGEST]) from None
    except OSError as error:
        raise RefusedError(COMPLAINTS.get(error.errno or 0, "A file of the sweep cannot be written.")) from None


@_without_paths()
def measure(
    plan: dict[str, Any], jobs: int, recording: Recording | None = None, filters: tuple[str, ...] = ()
) -> float:
    """Return the time that a plan would take, s, measured on a few of its runs.

    Args:
        plan: The plan as JSON values.
        jobs: Number of processes that would compute it.
        recording: Place of its recording, if it has one.
        filters: Texts of filters that it may execute.
    """
    trust(*filters)
    return estimate(Plan.from_dict(plan), jobs, recording).seconds


@_without_paths()
def compute(out: Path, jobs: int, recording: Recording | None = None, filters: tuple[str, ...] = ()) -> None:
    """Continue a sweep until it is done.

    Args:
        out: Its result file.
        jobs: Number of processes.
        recording: Place of its recording, if it has one.
        filters: Texts of filters that it may execute.

    Raises:
        RefusedError: The sweep cannot be continued, or a file cannot be written; computed runs are kept.
    """
    trust(*filters)
    carry_out(None, out, jobs=jobs, recording=recording)


@_without_paths()
def write(result: Path, path: Path, form: Form, filters: tuple[str, ...] = ()) -> None:
    """Write the results of a sweep so far as one file: all runs, the report as one page, or an archive of its pictures.

    Args:
        result: The sweep's result file, or where it will be.
        path: The file, in a folder of its own.
        form: Format of the file.
        filters: Texts of filters that it may execute, for their titles.

    Raises:
        RefusedError: There is nothing to report, or a file cannot be written.
    """
    trust(*filters)
    found = read_result(result)
    if form == "parquet":
        described = schema(found.plan).with_metadata(metadata(found.plan))
        with arrow.parquet.ParquetWriter(path, described, compression="zstd") as writer:
            for piece in found.pieces():
                writer.write_table(piece)
        return
    from pftrack.sweep.report.files import write_report  # noqa: PLC0415 - matplotlib: 26 MB and half a second

    report = write_report(found, path.parent / "report", form="svg" if form == "svg" else "png")
    if form == "html":
        report.page.replace(path)
        return
    with zipfile.ZipFile(path, "w", strict_timestamps=False) as archive:
        for picture in report.files:
            if picture.suffix == f".{form}":
                archive.write(picture, picture.name)
