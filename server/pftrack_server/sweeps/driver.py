"""The driver: what runs in the process that computes a sweep, and ends with the server.

The server holds the other end of its socket. When the server is gone, however it went, the socket closes, and the sweep
stops as if somebody had pressed Ctrl-C: what was computed is kept. A sweep gives way to sessions, which people watch;
for an estimate or a report somebody waits.
"""

import json
import os
import signal
import socket
import sys
import threading
from dataclasses import asdict

from pftrack.cli.app import main as command_line
from pftrack.process import confine
from pftrack.sweep import Plan, estimate, pool
from pftrack_server.sweeps.task import Measure, Report, Resume, Task

__all__ = ["main"]

NICENESS = 10


def main(talk: socket.socket, complaint: socket.socket, task: Task) -> None:
    """Carry out a task, as the leader of a group of its own.

    Args:
        talk: Takes the answer, as JSON; the server closes its end when the task is of no use any more.
        complaint: Takes what is written to standard error.
        task: What to do.
    """
    from pftrack_server.worker.preload import assert_preloaded  # noqa: PLC0415 - it warms all that is compiled

    assert_preloaded()
    os.setsid()
    os.dup2(talk.fileno(), sys.stdout.fileno())
    os.dup2(complaint.fileno(), sys.stderr.fileno())
    confine(file_bytes=task.file_bytes)
    if isinstance(task, Resume):
        os.nice(NICENESS)
        pool.prepare()  # before there is a thread
    threading.Thread(target=_follow, args=(talk,), name="follow", daemon=True).start()
    match task:
        case Measure(plan=plan, jobs=jobs):
            json.dump(asdict(estimate(Plan.from_dict(plan), jobs)), sys.stdout)
        case Resume(out=out, jobs=jobs):
            _sweep("--resume", str(out), "--jobs", str(jobs))
        case Report(result=result, folder=folder, pictures=pictures):
            wish = {"png": [], "svg": ["--svg"], "": ["--no-pictures"]}
            _sweep("report", str(result), "--out", str(folder), *wish[pictures])


def _sweep(*arguments: str) -> None:
    """Run `pftrack sweep`, which handles the signals and reports errors as JSON."""
    sys.argv = ["pftrack", "sweep", *arguments, "--json"]
    command_line()


def _follow(talk: socket.socket) -> None:
    """Stop when the server lets go of the socket."""
    while talk.recv(1024):
        pass
    os.kill(os.getpid(), signal.SIGTERM)
