"""What the process does that computes a sweep, measures one, or reports on it.

It ends with the server, and may be killed at any moment: what was computed is kept.
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
"""What a sweep is written as; CSV is sent piece by piece and needs no file."""


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
    """Return how long a plan would take, s, measured on a few of its runs.

    Args:
        plan: As JSON values.
        jobs: Processes that would compute it.
        recording: Where its recording is, if it is on one.
        filters: Texts of filters that it may execute.
    """
    trust(*filters)
    return estimate(Plan.from_dict(plan), jobs, recording).seconds


@_without_paths()
def compute(out: Path, jobs: int, recording: Recording | None = None, filters: tuple[str, ...] = ()) -> None:
    """Go on with a sweep that was begun, until it is done.

    Args:
        out: Its result file.
        jobs: Processes that compute.
        recording: Where its recording is, if it is on one.
        filters: Texts of filters that it may execute.

    Raises:
        RefusedError: The sweep cannot be continued, or a file cannot be written; what was computed is kept.
    """
    trust(*filters)
    carry_out(None, out, jobs=jobs, recording=recording)


@_without_paths()
def write(result: Path, path: Path, form: Form, filters: tuple[str, ...] = ()) -> None:
    """Write what there is of a sweep as one file: all runs, the report as one page, or an archive of its pictures.

    Args:
        result: The sweep's result file, or where it will be.
        path: The file, in a folder that holds nothing else.
        form: What it is.
        filters: Texts of filters that it may execute, to say what they are called.

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
