"""What the fork server has ready is shared by all workers, and stays so."""

import gc
from collections.abc import Generator
from typing import Any

import psutil

from pftrack.experiments import EXPERIMENTS
from pftrack.numerics.compiled import FUNCTIONS
from pftrack.warming.coverage import cases, run_case
from pftrack_server.tasks.child_tasks import ChildTasks
from pftrack_server.tasks.queue import Queues
from pftrack_server.worker.worker import NICENESS
from tests.apart import run
from tests.server.host import Server


def test_a_workers_garbage_collector_leaves_what_is_shared_alone() -> None:
    """Otherwise its first full collection copies the pages of everything that was preloaded."""
    frozen = run(ChildTasks(Queues()).run(gc.get_freeze_count))
    assert frozen > 100_000


def loaded_on_the_way() -> Generator[tuple[int, int], None, tuple[int, list[str]]]:
    """How many compiled functions a process has at first, and which it loads while it runs every case."""
    loaded = {it: len(it.signatures) for it in FUNCTIONS}
    for number, name in enumerate(EXPERIMENTS.own):
        yield number, len(EXPERIMENTS.own)
        for tracker, values in cases(EXPERIMENTS[name]):
            run_case(EXPERIMENTS[name], tracker, values)
    more = [str(it) for it in FUNCTIONS if len(it.signatures) > loaded.get(it, 0)]
    return sum(map(bool, loaded.values())), more


def test_a_worker_loads_nothing_that_is_compiled() -> None:
    """Its parent has loaded all of it, by the few cases that are enough for that."""
    count, more = run(ChildTasks(Queues()).run_long(loaded_on_the_way, cpu_seconds=300, on_step=lambda *_: None))
    assert count > 50
    assert more == []


def test_a_worker_gives_way_to_who_serves_everybody(server: Server, session: dict[str, Any]) -> None:
    """In a crowd the web process is not kept waiting by what single sessions compute."""
    assert psutil.Process(server.pid_of(session["id"])).nice() == psutil.Process().nice() + NICENESS
