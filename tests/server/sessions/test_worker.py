"""The worker: its loop behind a real pipe, its answers, and what the fork server has ready for it."""

import asyncio
import contextlib
import gc
import os
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import Mock

import numba
import psutil
import pytest

from pftrack.doctor.compiling import run_case
from pftrack.experiments import EXPERIMENTS
from pftrack.process import BlockingEnd, ForkServer
from pftrack.process.child import pair
from pftrack_server.core.errors import ApiError
from pftrack_server.core.processes import FORK_SERVER
from pftrack_server.jobs.child_tasks import ChildTasks, Queues
from pftrack_server.sessions import worker_handle
from pftrack_server.sessions.worker import protocol, worker
from pftrack_server.sessions.worker.protocol import Event, Heartbeat, Play, Reply
from pftrack_server.sessions.worker.run_tree import RunTree
from pftrack_server.sessions.worker.worker import NICENESS, Worker, load_compiled
from pftrack_server.sessions.worker_handle import WorkerHandle
from tests.apart import run
from tests.process.children import leave_another
from tests.process.test_fork_server import has_ended
from tests.server.host import Server
from tests.server.loading import tell_loaded
from tests.server.sessions.test_run_tree import config
from tests.waiting import wait_for

LOWEST = 19
"""The priority below which none is."""
SLOW = 0.03
"""Times real time: a frame a second, so that a change has a while until the next one."""


class Web:
    """The web process's end of the pipe of a worker in a thread."""

    def __init__(self) -> None:
        ours, self._theirs = pair()
        self._end = BlockingEnd(ours)
        self._thread = threading.Thread(target=self._serve)
        self._worker = Worker(BlockingEnd(self._theirs), config(frames=600))
        self._socket = ours
        self._thread.start()

    def _serve(self) -> None:
        with contextlib.suppress(EOFError, BrokenPipeError, ConnectionResetError):
            self._worker.serve()

    def send(self, *messages: Any) -> None:
        for message in messages:
            self._end.send(message)

    def until(self, holds: Callable[[Any], bool]) -> list[Any]:
        """Return all events up to the first for which something holds."""
        heard: list[Any] = []
        while not (heard and holds(heard[-1])):
            heard.append(self._end.receive(60))
            assert heard[-1] is not None
        return heard

    def close(self) -> None:
        self._socket.close()
        self._thread.join(10)
        self._theirs.close()


@pytest.fixture
def web() -> Iterator[Web]:
    made = Web()
    yield made
    made.close()


def changes(event: Any) -> dict[str, Any]:
    return event.changes if isinstance(event, protocol.Progress) else {}


def replies(number: int) -> Callable[[Any], bool]:
    return lambda event: isinstance(event, Reply) and event.number == number


def draws(event: Any) -> bool:
    return isinstance(event, protocol.Progress) and event.scene is not None


def test_a_credit_is_for_one_drawing(web: Web) -> None:
    """Each form is drawn once for a credit; a drawing for both forms encodes its pictures once."""
    web.send(protocol.Credit("scene"), protocol.Credit("flat"), protocol.Request(1, Play()))
    heard = web.until(lambda event: changes(event).get("position", 0) >= 20)
    told = [event for event in heard if isinstance(event, protocol.Progress)]
    (scene,) = (event.scene for event in told if event.scene is not None)
    (flat,) = (event.flat for event in told if event.flat is not None)
    if any(event.scene is not None and event.flat is not None for event in told):
        assert [picture.key for picture in scene.pictures.values()] == [picture.key for picture in flat.pictures]


def test_a_change_is_answered_before_the_frame_that_shows_it(web: Web) -> None:
    """The answer to a change has its values and no drawing; the next drawing is that of the first changed frame."""
    web.send(protocol.Request(1, protocol.SetSpeed.model_construct(speed=SLOW)), protocol.Request(2, Play()))
    for rest_s in (0.4, 0.0):
        web.send(protocol.Credit("scene"))
        web.until(draws)
        time.sleep(rest_s)
    web.send(protocol.Credit("scene"))
    time.sleep(0.05)
    web.send(protocol.Request(3, protocol.ChangeValues(values={"sample_count": 90}), "b1"))
    told = web.until(replies(3))
    answer = told[-1]
    (values,) = [changes(event)["parameters"] for event in told if "parameters" in changes(event)]
    assert values["sample_count"] == 90
    told = told[next(index for index, event in enumerate(told) if "parameters" in changes(event)) :]
    assert not any(map(draws, told))
    assert changes(web.until(draws)[-1])["position"] == answer.result.frame


def test_a_slow_run_tells_how_far_it_is_behind(monkeypatch: pytest.MonkeyPatch, web: Web) -> None:
    """Frames that take too long add up to seconds of delay, which a pause forgets."""
    forward = RunTree.forward

    def slowly(tree: RunTree) -> dict[str, Any] | None:
        time.sleep(0.2)
        return forward(tree)

    monkeypatch.setattr(RunTree, "forward", slowly)
    web.send(protocol.Request(1, Play()))
    heard = web.until(lambda event: changes(event).get("behind_s", 0.0) >= 0.5)
    web.send(protocol.Request(2, protocol.Pause()))
    told = [changes(event)["behind_s"] for event in heard + web.until(replies(2)) if "behind_s" in changes(event)]
    assert told[:-1] == sorted(told[:-1])
    assert told[-1] == 0.0


@pytest.mark.parametrize(
    ("place", "count", "command"),
    [("forward", 2, Play()), ("measures", 1, Play()), ("save", 1, protocol.Save("x.pftrack"))],
)
def test_a_run_that_has_to_compile_says_so(
    monkeypatch: pytest.MonkeyPatch, web: Web, place: str, count: int, command: Any
) -> None:
    """Each function is reported before the worker falls silent, and the end of compiling with the next frame.

    Measures and a refused command compile outside a step; the end is reported all the same.
    """
    functions = [numba.njit(lambda x, k=k: x + k) for k in range(count)]
    original = getattr(RunTree, place)

    def compiling(tree: RunTree, *arguments: Any) -> Any:
        for function in functions:
            function(1.5)
        if place == "save":
            raise OSError("no room")
        return original(tree, *arguments)

    web.until(replies(protocol.OPENING))
    monkeypatch.setattr("pftrack.doctor.compiling.FUNCTIONS", functions)
    monkeypatch.setattr(RunTree, place, compiling)
    web.send(protocol.Request(1, command))
    heard = web.until(lambda event: changes(event).get("compiling", 0) is None)
    assert [changes(event)["compiling"] for event in heard if "compiling" in changes(event)] == [*range(count), None]


async def test_an_answer_is_as_the_command_left_the_run() -> None:
    """A frame that is computed before the requester continues is not in the answer: it came after the command."""
    heard: list[Event] = []
    handle = WorkerHandle(None, heard.append, lambda reason: None)  # type: ignore[arg-type]
    handle._end = Mock()
    asking = asyncio.create_task(handle.request(Play(), lambda _: len(heard)))
    await asyncio.sleep(0)
    for event in (Heartbeat(), Reply(1), Heartbeat(), Heartbeat()):
        handle._event(event)
    assert await asking == 1


async def test_what_a_worker_has_started_ends_with_the_fork_server(monkeypatch: pytest.MonkeyPatch) -> None:
    """If a filter ends the fork server, and with it its worker, no other process of its group is left."""
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
    assert run(ChildTasks(Queues()).run(gc.get_freeze_count)) > 100_000


def test_a_session_leaves_what_it_has_loaded_to_the_next() -> None:
    """The first session of an experiment has the fork server load it; its child and later ones load nothing else."""
    for load in ((load_compiled, "sine"), None):
        with FORK_SERVER.fork(tell_loaded, "sine", load=load).end as end:
            at_first, more = BlockingEnd(end).receive()
        assert (at_first != set(), more) == (True, set())


@pytest.mark.parametrize(("is_kept", "trackers"), [(True, 1), (False, len(EXPERIMENTS["sine"].trackers))])
def test_without_a_cache_everything_is_compiled_at_once(
    is_kept: bool, trackers: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise each worker would compile for itself what its tracker calls beyond the default."""
    ran = Mock(wraps=run_case)
    monkeypatch.setattr(worker, "run_case", ran)
    monkeypatch.setattr(worker, "cache_folder", lambda: tmp_path if is_kept else None)
    load_compiled("sine")
    assert len({call.args[1] for call in ran.call_args_list}) == trackers


def test_a_worker_gives_way_to_the_web_process(server: Server, session: dict[str, Any]) -> None:
    """Computing sessions do not delay the web process, and explorations do not delay sessions."""
    pid = server.pid_of(session["id"])
    assert psutil.Process(pid).nice() == min(psutil.Process().nice() + NICENESS, LOWEST)
    assert os.getsid(pid) == os.getpgid(pid) == pid  # what is beside it divides no weight with it
