"""What the process does that computes a sweep, measures one, or reports on it.

It ends with the server. When it is asked to stop, it winds up as if somebody had pressed Ctrl-C: what was computed is
kept.
"""

import signal
import threading
from dataclasses import asdict
from pathlib import Path
from typing import Any, Literal, TypeAlias

from pftrack.experiments.own.code import trust
from pftrack.sweep import Plan, carry_out, estimate, read_result
from pftrack.sweep.work import Recording

Pictures: TypeAlias = Literal["png", "svg"]
"""What the figures of a report are drawn as."""


def measure(
    plan: dict[str, Any], jobs: int, recording: Recording | None = None, filters: tuple[str, ...] = ()
) -> dict[str, Any]:
    """Return what a plan would cost, measured on a few of its runs, as `pftrack.sweep.Estimate` has it.

    Args:
        plan: As JSON values.
        jobs: Processes that would compute it.
        recording: Where its recording is, if it is on one.
        filters: Texts of filters that it may execute.
    """
    trust(*filters)
    return asdict(estimate(Plan.from_dict(plan), jobs, recording))


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


def report(result: Path, folder: Path, pictures: Pictures, filters: tuple[str, ...] = ()) -> None:
    """Write the report of a sweep.

    Args:
        result: The sweep's result file.
        folder: Where the report goes.
        pictures: What its figures are drawn as.
        filters: Texts of filters that it may execute, to say what they are called.

    Raises:
        SweepError: There is nothing to report.
        OSError: A file cannot be written.
    """
    from pftrack.sweep.report.files import write_report  # noqa: PLC0415 - matplotlib: 26 MB and half a second

    trust(*filters)
    write_report(read_result(result), folder, form=pictures)
