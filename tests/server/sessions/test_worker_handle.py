"""What a command is answered with, as the web process reads a worker's pipe."""

import asyncio
from types import SimpleNamespace
from typing import Any

import pytest

from pftrack.process import ForkServer
from pftrack_server.core.errors import ApiError
from pftrack_server.sessions import worker_handle
from pftrack_server.sessions.worker.protocol import Event, Heartbeat, Play, Reply
from pftrack_server.sessions.worker_handle import WorkerHandle
from tests.apart import run
from tests.process.test_fork_server import has_ended, leave_another
from tests.waiting import wait_for


class Deaf:
    """An end of a pipe that nobody listens at."""

    def send(self, message: object) -> None:
        del message


def test_an_answer_is_as_the_command_left_the_run() -> None:
    """A frame that is computed before the requester wakes up is not in the answer: it came after the command."""

    async def ask() -> int:
        heard: list[Event] = []
        config: Any = None
        handle = WorkerHandle(config, heard.append, lambda reason: None)
        handle._end = Deaf()  # type: ignore[assignment]
        asking = asyncio.create_task(handle.request(Play(), lambda _: len(heard)))
        await asyncio.sleep(0)
        for event in (Heartbeat(), Reply(1), Heartbeat(), Heartbeat()):
            handle._event(event)
        return await asking

    assert run(ask()) == 1


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
