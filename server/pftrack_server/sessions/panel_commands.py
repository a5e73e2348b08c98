"""Panel commands: what people do on the panel beside the scene, as commands of its session.

A slider that is dragged asks for twenty values a second. While a command is under way the newest value of each
parameter waits, and all of them go together. Nobody waits for the answer, so a refusal is told to all who look on.
"""

import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any

import structlog

from pftrack.core.model.parameters import ParameterError
from pftrack.experiments.own.sliders import FilterFileError
from pftrack.runs.record import RecordError
from pftrack.runs.run import EndOfRun, PastError
from pftrack.sources.limits import SourceError
from pftrack_server.errors import ApiError, shape
from pftrack_server.system_errors import failure_message

log = structlog.get_logger(__name__)

REFUSALS = (ApiError, EndOfRun, FilterFileError, ParameterError, PastError, RecordError, SourceError)
"""Errors whose words are meant for people."""


class PanelCommands:
    """The commands of one session's panel; all methods belong to the event loop's thread.

    Args:
        command_lock: Held while a command of the session is under way.
        change: Changes parameters.
        transport: Carries out a command of the transport, given by its keywords.
        on_refusal: Called with the inside of an error.
    """

    def __init__(
        self,
        command_lock: asyncio.Lock,
        change: Callable[[dict[str, Any]], Awaitable[object]],
        transport: Callable[..., Awaitable[object]],
        on_refusal: Callable[[dict[str, Any]], None],
    ) -> None:
        self._command_lock = command_lock
        self._change = change
        self._transport = transport
        self._on_refusal = on_refusal
        self._pending: dict[str, Any] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    def change(self, values: dict[str, Any]) -> None:
        """Change parameters, together with what else is asked for until the session is free."""
        idle = not self._pending
        self._pending.update(values)
        if idle:
            self._later(self._send_pending())

    def steer(self, command: dict[str, Any]) -> None:
        """Carry out a command of the transport."""
        self._later(self._carry_out(self._transport(**command)))

    def close(self) -> None:
        """Carry out nothing more."""
        for task in list(self._tasks):
            task.cancel()

    async def _send_pending(self) -> None:
        async with self._command_lock:
            values, self._pending = self._pending, {}
        await self._carry_out(self._change(values))

    async def _carry_out(self, command: Awaitable[object]) -> None:
        """Carry out a command, and tell if it fails."""
        try:
            await command
        except REFUSALS as error:
            known = {name: getattr(error, name, None) for name in ("field", "bound", "value")}
            self._on_refusal(shape(str(error), **known))
        except Exception as error:
            log.exception("a command of the panel failed")
            self._on_refusal(shape(failure_message(error)))

    def _later(self, command: Coroutine[Any, Any, None]) -> None:
        task = asyncio.ensure_future(command)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
