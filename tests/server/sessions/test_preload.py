"""What the fork server has ready is shared by all workers, and stays so."""

import gc
import os
import socket
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import psutil
import pytest

from pftrack.core.model.drawing import Drawing
from pftrack.core.model.parameters import Value
from pftrack.core.numerics.compiled import FUNCTIONS
from pftrack.doctor.compiling import cases, run_case
from pftrack.experiments import EXPERIMENTS
from pftrack.experiments.experiment import Experiment
from pftrack.process import BlockingEnd, ForkServer
from pftrack_server.jobs.child_tasks import ChildTasks, Queues
from pftrack_server.sessions.worker import worker
from pftrack_server.sessions.worker.worker import NICENESS, load_compiled
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
    made = ForkServer("pftrack_server.web.preload")
    try:
        for load, is_loaded in ((None, False), ((load_compiled, "ball"), True), (None, True)):
            child = made.fork(tell_loaded, "ball", load=load)
            with child.end:
                at_first, more = BlockingEnd(child.end).receive()
            assert (at_first != set(), more == set()) == (is_loaded, is_loaded)
    finally:
        made.close()


@pytest.mark.parametrize(("is_kept", "trackers"), [(True, 1), (False, len(EXPERIMENTS["sine"].trackers))])
def test_where_nothing_can_be_kept_all_is_compiled_at_once(
    is_kept: bool, trackers: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise each worker would compile for itself what its tracker calls beyond the default."""
    ran = []

    def watched(experiment: Experiment, tracker: str, values: Mapping[str, Value]) -> Drawing:
        ran.append(tracker)
        return run_case(experiment, tracker, values)

    monkeypatch.setattr(worker, "run_case", watched)
    monkeypatch.setattr(worker, "cache_folder", lambda: tmp_path if is_kept else None)
    load_compiled("sine")
    assert len(set(ran)) == trackers


def test_a_worker_gives_way_to_who_serves_everybody(server: Server, session: dict[str, Any]) -> None:
    """In a crowd the web process is not kept waiting by what single sessions compute, nor these by explorations."""
    pid = server.pid_of(session["id"])
    assert psutil.Process(pid).nice() == psutil.Process().nice() + NICENESS
    assert os.getsid(pid) == os.getpgid(pid) == pid  # what is beside it divides no weight with it
