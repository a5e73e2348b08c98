"""Panel commands: what people do on the panel beside the scene, as commands of its session.

A slider that is dragged asks for twenty values a second. While a command is under way the newest value of each
parameter waits, and all of them go together. Nobody waits for the answer, so a refusal is told to all who look on.
"""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import structlog
from pydantic import ValidationError

from pftrack.core.model.parameters import ParameterError
from pftrack.experiments.own.code import FilterFileError
from pftrack.runs.record import RecordError
from pftrack.runs.run import EndOfRun, PastError
from pftrack.sources.limits import SourceError
from pftrack_server.core.errors import ApiError, shape
from pftrack_server.sessions.worker.commands import COMMAND, ChangeValues, Command
from pftrack_server.store.system_errors import failure_message

log = structlog.get_logger(__name__)

REFUSALS = (ApiError, EndOfRun, FilterFileError, ParameterError, PastError, RecordError, SourceError)
"""Errors whose words are meant for people."""


class PanelCommands:
    """The commands of one session's panel; all methods belong to the event loop's thread.

    Args:
        command_lock: Held while a command of the session is under way.
        carry_out: Carries out a command.
        on_refusal: Called with the inside of an error.
    """

    def __init__(
        self,
        command_lock: asyncio.Lock,
        carry_out: Callable[[Command], Awaitable[object]],
        on_refusal: Callable[[dict[str, Any]], None],
    ) -> None:
        self._command_lock = command_lock
        self._carry_out = carry_out
        self._on_refusal = on_refusal
        self._pending: dict[str, Any] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    def ask(self, body: dict[str, Any]) -> None:
        """Carry out a command; new values go together with what else is asked for until the session is free."""
        try:
            command = COMMAND.validate_python(body)
        except ValidationError as error:
            first = error.errors()[0]
            self._on_refusal(shape(f"{first['loc'][-1] if first['loc'] else 'kind'}: {first['msg']}"))
            return
        idle = not self._pending
        if isinstance(command, ChangeValues):
            self._pending.update(command.values)
        if idle or not isinstance(command, ChangeValues):
            task = asyncio.ensure_future(self._send(command))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)

    def close(self) -> None:
        """Carry out nothing more."""
        for task in list(self._tasks):
            task.cancel()

    async def _send(self, command: Command) -> None:
        """Carry out a command, and tell if it fails."""
        if isinstance(command, ChangeValues):
            async with self._command_lock:
                values, self._pending = self._pending, {}
            command = ChangeValues(values=values)
        try:
            await self._carry_out(command)
        except REFUSALS as error:
            known = {name: getattr(error, name, None) for name in ("field", "bound", "value")}
            self._on_refusal(shape(str(error), **known))
        except Exception as error:
            log.exception("a command of the panel failed")
            self._on_refusal(shape(failure_message(error)))
