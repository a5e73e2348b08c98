"""The process of a worker: what it may take, how it begins, and what is told when it fails."""

import os
import socket
import sys
import traceback
from itertools import islice

from pftrack.core.refusal import RefusedError
from pftrack.doctor.compiling import cases, run_case
from pftrack.doctor.memory import cache_folder
from pftrack.experiments import EXPERIMENTS
from pftrack.experiments.own.code import trust
from pftrack.process import BlockingEnd, confine, end_with_parent, give_way, leave_interrupts_to_parent
from pftrack.vision.rendering import png, render
from pftrack_server.sessions.worker.protocol import Failed, WorkerConfig
from pftrack_server.sessions.worker.worker import Worker

NICENESS, GIVING_WAY = 3, 8
"""Whoever serves everybody goes before one session's computation, and sweeps, with 10, come last."""
OPEN_FILES = 256


def main(end: socket.socket, config: WorkerConfig) -> None:
    """Run a session's worker until the web process hangs up."""
    leave_interrupts_to_parent()
    confine(memory_bytes=config.memory_bytes, cpu_seconds=config.cpu_seconds, open_files=OPEN_FILES)
    _lead_group(GIVING_WAY if config.gives_way else NICENESS)
    trust(*config.filters)
    pipe = BlockingEnd(end)
    try:
        worker = _make_worker(pipe, config)
        if worker is not None:
            worker.serve()
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return
    except MemoryError:
        mebibytes = config.memory_bytes >> 20
        _report_failure(pipe, Failed(f"The run needed more than the {mebibytes} MiB of memory that a session may use."))
        sys.exit(1)
    except Exception as error:  # noqa: BLE001 - whatever it was, it is reported once and ends this session alone
        traceback.print_exc()
        _report_failure(pipe, Failed(f"The computation failed ({type(error).__name__}); the server's log says where."))
        sys.exit(1)


def _lead_group(niceness: int) -> None:
    """Lead a session of processes of its own, as all that is computed beside it does, and come after others by so much.

    Where the kernel weighs such sessions before processes (see `give_way`), a worker in that of the web process has
    only a part of one weight: an exploration, whose weight is undivided, then takes much of what the run needs.
    """
    os.setsid()
    end_with_parent()
    give_way(niceness, patience_s=0.0)  # somebody waits for the first picture


def _make_worker(pipe: BlockingEnd, config: WorkerConfig) -> Worker | None:
    """Return the worker, or tell what of the config was refused."""
    try:
        return Worker(pipe, config)
    except RefusedError as error:
        _report_failure(pipe, Failed(str(error), error))
    return None


def _report_failure(pipe: BlockingEnd, failed: Failed) -> None:
    try:
        pipe.send(failed)
    except OSError:
        return


def load_compiled(name: str) -> None:
    """Step and draw an experiment as it is by default for some frames, which takes 0.1 to 0.5 s.

    What its other trackers and settings call is loaded by the workers that use them; where compiled code cannot be kept
    on the disk, all of it is compiled here, or each worker would do so. An experiment of another package is left alone:
    what it does wrong shall happen in its own workers.
    """
    if name in EXPERIMENTS.own:
        experiment = EXPERIMENTS[name]
        for tracker, values in islice(cases(experiment), 1 if cache_folder() else None):
            drawing = run_case(experiment, tracker, values)
        png(render(drawing))
