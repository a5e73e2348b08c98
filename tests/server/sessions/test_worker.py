"""The worker: its loop behind a real pipe, how its answers are read, and what the fork server has ready for it."""

import asyncio
import contextlib
import gc
import os
import socket
import threading
import time
from collections.abc import AsyncIterator, Callable, Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numba
import psutil
import pytest

from pftrack.core.model.drawing import Drawing
from pftrack.core.model.parameters import Value
from pftrack.core.numerics.compiled import FUNCTIONS
from pftrack.doctor.compiling import cases, run_case
from pftrack.experiments import EXPERIMENTS
from pftrack.experiments.experiment import Experiment
from pftrack.process import AsyncEnd, BlockingEnd, ForkServer
from pftrack.process.child import pair
from pftrack_server.core.errors import ApiError
from pftrack_server.jobs.child_tasks import ChildTasks, Queues
from pftrack_server.sessions import worker_handle
from pftrack_server.sessions.worker import protocol, worker
from pftrack_server.sessions.worker.protocol import Event, Heartbeat, Play, Reply
from pftrack_server.sessions.worker.run_tree import RunTree
from pftrack_server.sessions.worker.worker import NICENESS, Worker, load_compiled
from pftrack_server.sessions.worker_handle import WorkerHandle
from tests.apart import run
from tests.process.test_fork_server import has_ended, leave_another
from tests.server.host import Server
from tests.server.sessions.test_run_tree import config
from tests.waiting import wait_for

LOWEST = 19
"""The priority below which none is."""
SLOW = 0.03
"""Times real time: a frame a second, so that a change has a while until the next one."""


def compiling_before(monkeypatch: pytest.MonkeyPatch, place: str, count: int, *, fails: bool = False) -> None:
    """Have functions compiled before something of a run tree is done, which may fail then."""
    functions = [numba.njit(lambda x, k=k: x + k) for k in range(count)]
    monkeypatch.setattr("pftrack.doctor.compiling.FUNCTIONS", functions)
    original = getattr(RunTree, place)

    def compiling(tree: RunTree, *arguments: Any) -> Any:
        for function in functions:
            function(1.5)
        if fails:
            raise OSError("no room")
        return original(tree, *arguments)

    monkeypatch.setattr(RunTree, place, compiling)


@contextlib.asynccontextmanager
async def working(hear: Callable[[protocol.Event], None]) -> AsyncIterator[AsyncEnd]:
    """Have a worker work, and hear its events."""
    ours, theirs = pair()
    lost = asyncio.Event()
    web = await AsyncEnd.connect(ours, hear, lost.set)
    worker = Worker(BlockingEnd(theirs), config(frames=600))

    def serve() -> None:
        with contextlib.suppress(EOFError, BrokenPipeError, ConnectionResetError):
            worker.serve()

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield web
    finally:
        web.close()
        await asyncio.to_thread(thread.join, 10)
        theirs.close()


async def play(
    heard: list[protocol.Progress],
    holds: Callable[[dict[str, Any]], bool],
    before: Callable[[AsyncEnd], object] = lambda _: None,
    command: Any = None,
    after: Any = None,
) -> None:
    """Play, or carry out another command, until the changes that are told fulfil a condition.

    Args:
        heard: Takes what is told.
        holds: The condition.
        before: Is done when the worker has begun.
        command: Is carried out in place of playing.
        after: Is carried out in the end.
    """
    there, done = asyncio.Event(), asyncio.Event()

    def hear(event: protocol.Event) -> None:
        if isinstance(event, protocol.Progress):
            heard.append(event)
            if holds(event.changes):
                there.set()
        if isinstance(event, protocol.Reply) and event.number == 2:
            done.set()

    async with asyncio.timeout(120), working(hear) as web:
        before(web)
        web.send(protocol.Request(1, command or protocol.Play()))
        await there.wait()
        if after is not None:
            web.send(protocol.Request(2, after))
            await done.wait()


def test_a_credit_is_for_one_drawing() -> None:
    """A page that takes none is sent none; the scene and flat views share what is encoded for both."""
    heard: list[protocol.Progress] = []

    def credit_each(web: AsyncEnd) -> None:
        web.send(protocol.Credit("scene"))
        web.send(protocol.Credit("flat"))

    run(play(heard, lambda changes: changes.get("position", 0) >= 20, credit_each))
    (scene,) = (event.scene for event in heard if event.scene is not None)
    (flat,) = (event.flat for event in heard if event.flat is not None)
    if any(event.scene is not None and event.flat is not None for event in heard):
        assert [picture.key for picture in scene.pictures.values()] == [picture.key for picture in flat.pictures]


async def test_a_change_leaves_the_way_free_for_the_frame_that_shows_it() -> None:
    """The answer to a change tells its values without a drawing; the drawing after it is of the first changed frame."""
    heard: list[Any] = []
    drawn, answered = asyncio.Event(), asyncio.Event()

    def hear(event: protocol.Event) -> None:
        heard.append(event)
        if isinstance(event, protocol.Progress) and event.scene is not None:
            drawn.set()
        if isinstance(event, protocol.Reply) and event.number == 3:
            answered.set()

    async with asyncio.timeout(120), working(hear) as web:
        web.send(protocol.Request(1, protocol.SetSpeed.model_construct(speed=SLOW)))
        web.send(protocol.Request(2, protocol.Play()))
        for rest_s in (0.4, 0.0):
            web.send(protocol.Credit("scene"))
            await drawn.wait()
            await asyncio.sleep(rest_s)
            drawn.clear()
        web.send(protocol.Credit("scene"))
        await asyncio.sleep(0.05)
        drawn.clear()
        heard.clear()
        web.send(protocol.Request(3, protocol.ChangeValues(values={"sample_count": 90}), "b1"))
        await answered.wait()
        await drawn.wait()
    answer = next(index for index, event in enumerate(heard) if isinstance(event, protocol.Reply))
    told = [event for event in heard[:answer] if isinstance(event, protocol.Progress)]
    (values,) = [event.changes["parameters"] for event in told if "parameters" in event.changes]
    assert values["sample_count"] == 90
    assert [event.scene for event in told] == [None] * len(told)
    shown = next(event.changes for event in heard if isinstance(event, protocol.Progress) and event.scene is not None)
    assert shown["position"] == heard[answer].result.frame


def test_a_run_that_is_too_slow_says_how_far_it_is_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    """Frames that take longer than their time add up to seconds, which are forgotten with a pause."""

    def slowly(tree: RunTree) -> dict[str, Any] | None:
        time.sleep(0.2)
        return forward(tree)

    forward = RunTree.forward
    monkeypatch.setattr(RunTree, "forward", slowly)
    heard: list[protocol.Progress] = []
    run(play(heard, lambda changes: changes.get("behind_s", 0.0) >= 0.5, after=protocol.Pause()))
    told = [event.changes["behind_s"] for event in heard if "behind_s" in event.changes]
    assert told[:-1] == sorted(told[:-1])
    assert told[-1] == 0.0


def compiles_nothing_more(changes: dict[str, Any]) -> bool:
    return changes.get("compiling", 0) is None


@pytest.mark.parametrize(
    ("place", "count", "command"),
    [("forward", 2, None), ("measures", 1, None), ("save", 1, protocol.Save("x.pftrack"))],
)
def test_a_run_that_has_to_compile_says_so(
    monkeypatch: pytest.MonkeyPatch, place: str, count: int, command: Any
) -> None:
    """It tells of each function before it falls silent, and with the frame that needed them that it is over.

    Measures and a command that is refused compile outside a step, and the end of that is told all the same.
    """
    heard: list[protocol.Progress] = []

    def before(_: AsyncEnd) -> None:
        compiling_before(monkeypatch, place, count, fails=place == "save")

    run(play(heard, compiles_nothing_more, before, command))
    told = [event.changes["compiling"] for event in heard if "compiling" in event.changes]
    assert told == [*range(count), None]


async def test_an_answer_is_as_the_command_left_the_run() -> None:
    """A frame that is computed before the requester wakes up is not in the answer: it came after the command."""
    heard: list[Event] = []
    config: Any = None
    handle = WorkerHandle(config, heard.append, lambda reason: None)
    handle._end = Mock()
    asking = asyncio.create_task(handle.request(Play(), lambda _: len(heard)))
    await asyncio.sleep(0)
    for event in (Heartbeat(), Reply(1), Heartbeat(), Heartbeat()):
        handle._event(event)
    assert await asking == 1


async def test_what_a_worker_has_started_ends_with_the_fork_server(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a filter has ended the fork server, and with it its worker, nothing else of its group is left."""
    fork_server, told = ForkServer("pftrack.process"), []
    monkeypatch.setattr(worker_handle, "FORK_SERVER", fork_server)
    monkeypatch.setattr(worker_handle, "load_compiled", len)
    monkeypatch.setattr(worker_handle, "main", leave_another)
    config: Any = SimpleNamespace(run=SimpleNamespace(recipe=SimpleNamespace(experiment="ball")), session="s")

    handle = WorkerHandle(config, told.append, lambda reason: None)
    with pytest.raises(ApiError, match="worker"):
        await handle.start()
    fork_server.close()
    wait_for(lambda: has_ended(told[0]))


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
    assert psutil.Process(pid).nice() == min(psutil.Process().nice() + NICENESS, LOWEST)
    assert os.getsid(pid) == os.getpgid(pid) == pid  # what is beside it divides no weight with it
