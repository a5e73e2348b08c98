"""What the process does that computes a sweep, measures one, or reports on it.

It ends with the server. When it is asked to stop, it winds up as if somebody had pressed Ctrl-C: what was computed is
kept.
"""

import signal
import threading
import zipfile
from pathlib import Path
from typing import Any, Literal, TypeAlias

from pftrack.experiments.own.code import trust
from pftrack.sources.sequence import Recording
from pftrack.sweep import Plan, arrow, carry_out, estimate, read_result
from pftrack.sweep.journal import metadata
from pftrack.sweep.table import schema

Form: TypeAlias = Literal["parquet", "csv", "html", "png", "svg"]
"""What a sweep is written as; CSV is sent piece by piece and needs no file."""


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


def compute(out: Path, jobs: int, recording: Recording | None = None, filters: tuple[str, ...] = ()) -> None:
    """Go on with a sweep that was begun, until it is done or SIGTERM asks to stop.

    Args:
        out: Its result file.
        jobs: Processes that compute.
        recording: Where its recording is, if it is on one.
        filters: Texts of filters that it may execute.

    Raises:
        SweepError: It was stopped, or cannot be continued; what was computed is kept.
        OSError: A file cannot be written; what was computed is kept.
    """
    trust(*filters)
    asked = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: asked.set())
    carry_out(None, out, jobs=jobs, recording=recording, stop=asked.is_set)


def write(result: Path, path: Path, form: Form, filters: tuple[str, ...] = ()) -> None:
    """Write what there is of a sweep as one file: all runs, the report as one page, or an archive of its pictures.

    Args:
        result: The sweep's result file, or where it will be.
        path: The file, in a folder that holds nothing else.
        form: What it is.
        filters: Texts of filters that it may execute, to say what they are called.

    Raises:
        SweepError: There is nothing to report.
        OSError: A file cannot be written.
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
