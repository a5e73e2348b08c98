"""What the fork server has ready is shared by all workers, and stays so."""

import gc
import socket
from typing import Any

import psutil

from pftrack.experiments import EXPERIMENTS
from pftrack.numerics.compiled import FUNCTIONS
from pftrack.process import BlockingEnd, ForkServer
from pftrack.warming.coverage import cases, run_case
from pftrack_server.tasks.child_tasks import ChildTasks
from pftrack_server.tasks.queue import Queues
from pftrack_server.worker.loading import load_compiled
from pftrack_server.worker.worker import NICENESS
from tests.apart import run
from tests.server.host import Server


def test_a_workers_garbage_collector_leaves_what_is_shared_alone() -> None:
    """Otherwise its first full collection copies the pages of everything that was preloaded."""
    frozen = run(ChildTasks(Queues()).run(gc.get_freeze_count))
    assert frozen > 100_000


def tell_loaded(end: socket.socket, name: str) -> None:
    """Tell which compiled functions a child has at first, and which it loads for an experiment as it is by default."""
    at_first = loaded()
    run_case(EXPERIMENTS[name], *next(cases(EXPERIMENTS[name])))
    BlockingEnd(end).send((at_first, loaded() - at_first))


def loaded() -> set[str]:
    return {f"{function}{types}" for function in FUNCTIONS for types in function.signatures}


def test_a_session_leaves_what_it_has_loaded_to_the_next() -> None:
    """The first session of an experiment has the fork server load it; later children need nothing else."""
    made = ForkServer("pftrack_server.preload")
    try:
        for load, is_loaded in ((None, False), ((load_compiled, "ball"), True), (None, True)):
            child = made.fork(tell_loaded, "ball", load=load)
            with child.end:
                at_first, more = BlockingEnd(child.end).receive()
            assert (at_first != set(), more == set()) == (is_loaded, is_loaded)
    finally:
        made.close()


def test_a_worker_gives_way_to_who_serves_everybody(server: Server, session: dict[str, Any]) -> None:
    """In a crowd the web process is not kept waiting by what single sessions compute."""
    assert psutil.Process(server.pid_of(session["id"])).nice() == psutil.Process().nice() + NICENESS
