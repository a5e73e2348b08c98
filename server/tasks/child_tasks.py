"""Child tasks: short work that must not run in the web process, each in a process of its own with limits.

It is a child of the same forkserver as the workers, there in some 20 ms, and ended when it takes too long.
"""

import asyncio
from collections.abc import Callable
from typing import Any

from server.errors import RefusedError, UnavailableError
from server.tasks import functions
from server.worker import forkserver
from server.worker.pipe import WebEnd, pair
from server.worker.protocol import Event, Failed, Reply

__all__ = ["ChildTasks"]

AT_ONCE = 4


class ChildTasks:
    """Sends tasks to confined processes, a few at a time."""

    def __init__(self, *, memory_bytes: int) -> None:
        self._memory_bytes = memory_bytes
        self._places = asyncio.Semaphore(AT_ONCE)

    async def run(self, function: Callable[..., Any], *arguments: object) -> Any:  # noqa: ANN401 - whatever the function returns
        """Return the result of a function of `server.tasks.functions`.

        Raises:
            RefusedError: The function refused its arguments, with a sentence, or its process died.
            UnavailableError: It took too long.
        """
        async with self._places:
            event = await self._answer(function, arguments)
        match event:
            case Reply(result=result):
                return result
            case Failed(message=message):
                raise RefusedError(message[:1].upper() + message[1:])
            case _:
                raise RefusedError("This needs more memory or time than is allowed for it, or cannot be read safely.")

    async def _answer(self, function: Callable[..., Any], arguments: tuple[object, ...]) -> Event | None:
        """Return the first event that the process sends, or None if it dies before."""
        answer: asyncio.Future[Event | None] = asyncio.get_running_loop().create_future()
        gone = asyncio.Event()

        def settle(event: Event | None) -> None:
            if not answer.done():
                answer.set_result(event)

        def lost() -> None:
            gone.set()
            settle(None)

        ours, theirs = pair()
        try:
            process = await asyncio.to_thread(
                forkserver.spawn,
                functions.main,
                theirs,
                function,
                arguments,
                self._memory_bytes,
                name=f"pftrack-{function.__name__}",
            )
        except BaseException:
            ours.close()
            raise
        finally:
            theirs.close()
        end = await WebEnd.connect(ours, settle, lost)
        try:
            return await asyncio.wait_for(answer, functions.PATIENCE_S)
        except TimeoutError:
            raise UnavailableError(f"This took longer than {functions.PATIENCE_S:g} s and was given up.") from None
        finally:
            process.kill()
            end.close()
            await gone.wait()
            await asyncio.to_thread(process.join, functions.PATIENCE_S)
            process.close()
