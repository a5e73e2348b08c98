"""Child tasks: work that must not run in the web process, each in a process of its own with limits.

It is a child of the same forkserver as the workers, there in some 20 ms, and ended when it falls silent. Short work has
other places than work that may take minutes, so that the one never waits for the other.
"""

import asyncio
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any

from server.errors import RefusedError, UnavailableError
from server.tasks import functions
from server.tasks.queue import Queues, unless_gone
from server.worker import forkserver
from server.worker.pipe import WebEnd, pair
from server.worker.protocol import Event, Failed, Reply, Step

__all__ = ["ChildTasks"]


async def _never() -> None:
    await asyncio.Event().wait()


@dataclass(frozen=True)
class ChildTasks:
    """Sends tasks to confined processes, a few at a time.

    Attributes:
        queues: Where tasks wait for their turn.
        memory_bytes: What each may take.
        gone: Waits until the client that has asked is gone; its short tasks are then dropped.
    """

    queues: Queues
    memory_bytes: int
    gone: Callable[[], Awaitable[object]] = _never

    async def check(self) -> None:
        """Make sure that processes can be made; this waits for no other task, but one after the other.

        Raises:
            RefusedError: They die.
            UnavailableError: They do not answer.
        """
        async with self.queues.check.place():
            _result(await self._answer(functions.nothing, ()))

    async def run(self, function: Callable[..., Any], *arguments: object) -> Any:  # noqa: ANN401 - whatever the function returns
        """Return the result of a function of `server.tasks.functions`.

        Raises:
            RefusedError: The function refused its arguments, with a sentence, or its process died.
            UnavailableError: It took too long.
            ClientGoneError: Its client hung up.
        """
        return _result(await unless_gone(self._in_turn(function, arguments), self.gone))

    async def run_long(
        self,
        function: Callable[..., Any],
        *arguments: object,
        cpu_seconds: float,
        on_step: Callable[[int, int], None],
    ) -> Any:  # noqa: ANN401 - whatever the function returns
        """Return the result of a function that tells how far it is; it takes as long as it takes.

        Args:
            function: A generator of `server.tasks.functions`.
            arguments: For it.
            cpu_seconds: Processor time that it may take.
            on_step: Called now and then with the steps that are done, and with all that there are.

        Raises:
            RefusedError: The function refused its arguments, with a sentence, or its process died.
            UnavailableError: It gave no sign of life for too long.
        """
        async with self.queues.heavy.place():
            return _result(await self._answer(function, arguments, cpu_seconds, on_step))

    async def _in_turn(self, function: Callable[..., Any], arguments: tuple[object, ...]) -> Event | None:
        async with self.queues.light.place():
            return await self._answer(function, arguments)

    async def _answer(
        self,
        function: Callable[..., Any],
        arguments: tuple[object, ...],
        cpu_seconds: float = functions.PATIENCE_S,
        on_step: Callable[[int, int], None] = lambda *_: None,
    ) -> Event | None:
        """Return the first event that the process sends besides its steps, or None if it dies before."""
        answer: asyncio.Future[Event | None] = asyncio.get_running_loop().create_future()
        gone = asyncio.Event()
        heard = time.monotonic()

        def settle(event: Event | None) -> None:
            nonlocal heard
            heard = time.monotonic()
            if isinstance(event, Step):
                on_step(event.done, event.total)
            elif not answer.done():
                answer.set_result(event)

        def lost() -> None:
            gone.set()
            settle(None)

        ours, theirs = pair()
        try:
            end = await WebEnd.connect(ours, settle, lost)
            try:
                process = await forkserver.spawn(
                    functions.main,
                    theirs,
                    function,
                    arguments,
                    self.memory_bytes,
                    cpu_seconds,
                    name=f"pftrack-{function.__name__}",
                )
            except BaseException:
                end.close()
                raise
        finally:
            theirs.close()
        heard = time.monotonic()
        try:
            while not answer.done():
                await asyncio.wait({answer}, timeout=max(heard + functions.PATIENCE_S - time.monotonic(), 0.0))
                if not answer.done() and time.monotonic() - heard >= functions.PATIENCE_S:
                    raise UnavailableError(
                        f"This gave no sign of life for {functions.PATIENCE_S:g} s and was given up."
                    )
            return answer.result()
        finally:
            process.kill()
            end.close()
            await gone.wait()
            await asyncio.to_thread(process.join, functions.PATIENCE_S)
            process.close()


def _result(event: Event | None) -> Any:  # noqa: ANN401 - whatever the function returns
    match event:
        case Reply(result=result):
            return result
        case Failed(message=message):
            raise RefusedError(message[:1].upper() + message[1:])
        case _:
            raise RefusedError("This needs more memory or time than is allowed for it, or cannot be read safely.")
