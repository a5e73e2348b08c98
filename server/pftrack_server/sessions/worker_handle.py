"""The worker handle: the web process's side of a worker process.

It starts the worker, numbers requests and waits for their answers, notices when the worker dies, and gives the reason
in one sentence. No wait has a time limit: a worker that gives signs of life may take any time, and one that gives none
is ended by its session's check.
"""

import asyncio
import contextlib
import itertools
import time
from collections.abc import Callable
from typing import Any, TypeVar

import structlog

from pftrack.process import AsyncEnd, Child, Ending, describe, ending
from pftrack_server.core.errors import unavailable
from pftrack_server.core.processes import FORK_SERVER
from pftrack_server.core.resource_limits import allowed_cpu_seconds
from pftrack_server.sessions.spec import RunSnapshot
from pftrack_server.sessions.worker import protocol
from pftrack_server.sessions.worker.worker import load_compiled, main

Result = TypeVar("Result")

log = structlog.get_logger(__name__)

LAST_WORDS_S = 2.0


class WorkerHandle:
    """One worker process and the pipe to it.

    Attributes:
        heard: When the worker last gave a sign of life (monotonic, s).
    """

    def __init__(
        self, config: protocol.WorkerConfig, on_event: Callable[[protocol.Event], None], on_lost: Callable[[str], None]
    ) -> None:
        self._config = config
        self._on_event = on_event
        self._on_lost = on_lost
        self._numbers = itertools.count(protocol.OPENING + 1)
        loop = asyncio.get_running_loop()
        self._ready: asyncio.Future[None] = loop.create_future()
        self._opened: asyncio.Future[None] = loop.create_future()
        self._waiting: dict[int, tuple[asyncio.Future[Any], Callable[[Any], object]]] = {
            protocol.OPENING: (self._opened, lambda _: None)
        }
        self._child: Child | None = None
        self._end: AsyncEnd | None = None
        self._reason: str | None = None
        self._closing = False
        self._gone = asyncio.Event()
        self._farewell: asyncio.Task[None] | None = None
        self.heard = time.monotonic()

    @property
    def pid(self) -> int | None:
        """The worker's process number."""
        return self._child.pid if self._child and not self._child.has_ended else None

    @property
    def is_asked(self) -> bool:
        """Whether somebody waits for an answer, or for the run to reach its frame."""
        return any(not future.done() for future, _ in self._waiting.values())

    async def start(self) -> None:
        """Start the worker and wait until its run is ready, at its beginning or its checkpoint.

        Raises:
            Exception: The worker's refusal of the config.
            ApiError: The worker ended first (503).
        """
        load = load_compiled, self._config.run.recipe.experiment
        self._child = await FORK_SERVER.fork_async(main, self._config, load=load)
        self._end = await AsyncEnd.connect(self._child.end, self._event, self._handle_loss)
        # Until now it could not give a sign of life.
        self.heard = time.monotonic()
        try:
            await asyncio.shield(self._ready)
        except BaseException:
            await self.close()
            raise

    async def wait_until_open(self, patience_s: float) -> None:
        """Wait at most `patience_s` seconds for the run to reach the config's goal.

        Raises:
            ApiError: The worker ended first (503).
        """
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(asyncio.shield(self._opened), patience_s)

    async def request(
        self, order: protocol.Order, then: Callable[[Any], Result], branch: str = "", known: RunSnapshot | None = None
    ) -> Result:
        """Send an order and return `then` of its result.

        `then` is called when the reply is read, before any later event: so it sees the state that the order left, even
        while the run plays.

        Args:
            order: The order.
            then: Turns the result into the answer.
            branch: Name for a branch that it makes.
            known: The known snapshot of the branch to show.

        Raises:
            Exception: The worker's refusal of the order.
            ApiError: The worker ended first (503).
        """
        if self._end is None or self._gone.is_set():
            raise unavailable("The session's worker has ended; resume the session.")
        number = next(self._numbers)
        future: asyncio.Future[Result] = asyncio.get_running_loop().create_future()
        self._waiting[number] = future, then
        self._end.send(protocol.Request(number, order, branch, known))
        try:
            return await future
        finally:
            self._waiting.pop(number, None)

    def credit(self, form: protocol.Form) -> None:
        """Let the worker send one more drawing in a form."""
        if self._end is not None:
            self._end.send(protocol.Credit(form))

    def kill(self, reason: str) -> None:
        """Kill the worker; `reason` is reported when its end is noticed."""
        self._reason = self._reason or reason
        if self._child is not None:
            self._child.kill()

    async def close(self) -> None:
        """Close the pipe, wait for the worker's end, and release everything."""
        self._closing = True
        if self._end is not None:
            self._end.close()
            await self._gone.wait()
        if self._farewell is not None:
            await self._farewell

    def _event(self, event: protocol.Event) -> None:
        self.heard = time.monotonic()
        match event:
            case protocol.Ready():
                # The next event may be read in the same pass.
                self._on_event(event)
                if not self._ready.done():
                    self._ready.set_result(None)
            case protocol.Reply(number=number, result=result, error=error):
                future, then = self._waiting.get(number, (None, None))
                if future is not None and then is not None and not future.done():
                    if error is None:
                        future.set_result(then(result))
                    else:
                        future.set_exception(error)
            case protocol.Failed(message=message, error=error):
                self._reason = message
                if error is not None and not self._ready.done():
                    self._ready.set_exception(error)
            case _:
                self._on_event(event)

    def _handle_loss(self) -> None:
        self._gone.set()
        self._farewell = asyncio.ensure_future(self._clean_up())

    async def _clean_up(self) -> None:
        """Wait for the process to end, and fail all pending requests with the reason."""
        status = None
        if self._child is not None:
            await self._child.wait(LAST_WORDS_S)
            self._child.kill()  # with its children, which may have outlived it and the fork server
            status = await self._child.wait(LAST_WORDS_S)
        reason = self._reason or _cause(status, self._config)
        lost = unavailable(reason)
        for future, _ in self._waiting.values():
            if not future.done():
                future.set_exception(lost)
        if not self._ready.done():
            self._ready.set_exception(lost)
        # Perhaps nobody waits for them any more.
        self._ready.exception()
        if not self._opened.cancelled():
            self._opened.exception()
        if not self._closing:
            log.warning("worker lost", session=self._config.session, status=status, reason=reason)
            self._on_lost(reason)


def _cause(status: int | None, config: protocol.WorkerConfig) -> str:
    """Return a sentence that explains an exit status."""
    how = None if status is None else ending(status)
    if how is Ending.OUT_OF_CPU_TIME:
        shell, used = allowed_cpu_seconds(config.cpu_seconds), f"its {config.cpu_seconds} s of processor time"
        if shell is not None:
            used = f"the {shell} s of processor time that the server's shell allows (ulimit -t)"
        return f"The session used up {used}. Resume it to continue with the same amount again."
    if how is Ending.KILLED:
        return "The session's worker was killed. Resume the session to continue at the same frame."
    if status is not None and how is Ending.CRASHED:
        return f"The session's worker crashed ({describe(status)}). Resume the session to continue at the same frame."
    return "The session's worker ended unexpectedly. Resume the session to continue at the same frame."
