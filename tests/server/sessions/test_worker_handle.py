"""What a command is answered with, as the web process reads a worker's pipe."""

import asyncio
from typing import Any

from pftrack_server.sessions.worker_handle import WorkerHandle
from pftrack_server.worker.protocol import Event, Heartbeat, Reply, Speed
from tests.apart import run


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
        asking = asyncio.create_task(handle.request(Speed(1.0), lambda _: len(heard)))
        await asyncio.sleep(0)
        for event in (Heartbeat(), Reply(1), Heartbeat(), Heartbeat()):
            handle._event(event)
        return await asking

    assert run(ask()) == 1
