"""The driver: what runs in the process that computes a sweep, and ends with the server.

Its task comes as one line of JSON on standard input, whose other end the server holds. When the server is gone, however
it went, the pipe closes, and the sweep stops as if somebody had pressed Ctrl-C: what was computed is kept. Sweeps give
way to sessions, which people watch.
"""

import json
import os
import signal
import sys
import threading
from dataclasses import asdict

from pftrack.cli.app import main as command_line
from pftrack.process import confine
from pftrack.sweep import Plan, estimate
from server.sweeps.task import TASK, Measure, Report, Resume

__all__: list[str] = []

NICENESS = 10


def main() -> None:
    """Carry out the task on standard input, and print its answer as JSON."""
    task = TASK.validate_json(sys.stdin.buffer.readline())
    os.nice(NICENESS)
    confine(file_bytes=task.file_bytes)
    threading.Thread(target=_follow, name="follow", daemon=True).start()
    match task:
        case Measure(plan=plan, jobs=jobs):
            json.dump(asdict(estimate(Plan.from_dict(plan), jobs)), sys.stdout)
        case Resume(out=out, jobs=jobs):
            _sweep("--resume", str(out), "--jobs", str(jobs))
        case Report(result=result, folder=folder):
            _sweep("report", str(result), "--out", str(folder))


def _sweep(*arguments: str) -> None:
    """Run `pftrack sweep`, which handles the signals and reports errors as JSON."""
    sys.argv = ["pftrack", "sweep", *arguments, "--json"]
    command_line()


def _follow() -> None:
    """Stop when the server lets go of the pipe."""
    while os.read(0, 1024):
        pass
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    main()
