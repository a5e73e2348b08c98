"""The session: a run that somebody watches, in the web process.

All data about the run come from the worker and are kept in the session's state. Commands are carried out one at a time.
"""

import asyncio
import time
from collections.abc import Awaitable, Callable
from contextlib import nullcontext, suppress
from typing import TYPE_CHECKING, Any, TypeAlias

from pftrack.core.refusal import ConflictError
from pftrack_server.core.errors import ApiError, not_found
from pftrack_server.core.panel import PanelValues
from pftrack_server.core.settings import Settings
from pftrack_server.sessions.scene_feed import SceneFeed
from pftrack_server.sessions.spec import LIVE, Phase, SessionSpec
from pftrack_server.sessions.state import SessionState
from pftrack_server.sessions.stream import Refused, SessionPublic
from pftrack_server.sessions.worker import protocol
from pftrack_server.sessions.worker_handle import WorkerHandle

if TYPE_CHECKING:
    from pftrack_server.viewer import Endpoint


ConfigOf = Callable[[SessionSpec], Awaitable[protocol.WorkerConfig]]
Answer: TypeAlias = SessionPublic | protocol.Changed | protocol.InspectionPublic
"""The answer to a command."""


class Session(SessionState):
    """One session; call all methods in the event loop's thread.

    Attributes:
        scene_feed: Feeds its scene.
        worker: The worker, if there is one.
        left: When the last visitor left (monotonic, s).
    """

    def __init__(self, spec: SessionSpec, settings: Settings, config_of: ConfigOf) -> None:
        super().__init__(spec, lambda: self._credit("flat"), lambda: self.scene_feed.tell(self._in_force()))
        self._command_lock = asyncio.Lock()
        self.scene_feed = SceneFeed(
            credit=lambda: self._credit("scene"), carry_out=self.command, on_refusal=self._tell_refusal
        )
        self.left = time.monotonic()
        self._settings = settings
        self._config_of = config_of
        self.worker: WorkerHandle | None = None
        self._starting: WorkerHandle | None = None
        self._thumbnail: bytes | None = None
        self._reopening: asyncio.Future[None] | None = None

    # ------------------------------------------------------------ properties

    @property
    def live(self) -> bool:
        """Whether it has a worker, or one is starting."""
        return self.phase in LIVE

    @property
    def visitors(self) -> int:
        """Number of connections to its scene and its stream."""
        return len(self.stream) + self.scene_feed.watchers

    @property
    def is_free(self) -> bool:
        """Whether the next command can be carried out at once."""
        return not self._command_lock.locked()

    @property
    def is_unused(self) -> bool:
        """Whether it has a worker that nobody watches or waits for."""
        return self.worker is not None and self.is_free and not self.visitors and not self.worker.is_asked

    # ------------------------------------------------------------ life cycle

    async def start(self) -> None:
        """Start a worker for the run of the spec; the run may then still be computing up to its frame.

        Raises:
            ConflictError: The session was ended meanwhile.
            Exception: The worker's refusal of the spec.
        """
        async with self._command_lock:
            if self.phase is Phase.CLOSED:
                raise ConflictError("The session was ended.")
            if self.worker is not None:
                return
            self.enter(Phase.STARTING)
            try:
                self._starting = WorkerHandle(await self._config_of(self.spec), self._event, self._on_worker_lost)
                await self._starting.start()
            except BaseException as error:
                self.enter(Phase.CRASHED, str(error))
                raise
            finally:
                self._starting = None
            self.scene_feed.want()
            self.stream.want()

    async def wait_until_open(self, patience_s: float) -> None:
        """Wait at most `patience_s` seconds for the run to reach its frame; a page can watch meanwhile.

        Raises:
            ApiError: The worker ended first (503).
        """
        if self.worker is not None:
            await self.worker.wait_until_open(patience_s)

    async def suspend(self, message: str) -> None:
        """End the worker; the spec keeps everything."""
        async with self._command_lock:
            # Before the worker has ended, so that a page that connects meanwhile resumes it.
            self.enter(Phase.SUSPENDED, message)
            await self._stop_worker()
        await self.scene_feed.close()

    async def close(self, message: str) -> None:
        """End the session permanently, or until the server restarts."""
        self.enter(Phase.CLOSED, message)
        # Before the lock is taken, so that all commands waiting for the worker are refused.
        await self._stop_worker()
        async with self._command_lock:
            await self._stop_worker()
            self.stream.close()
        if self._reopening is not None:
            await self._reopening
        await self.scene_feed.close()

    def check(self, *, after_gap: bool) -> None:
        """End the worker if it was silent for too long.

        Args:
            after_gap: Whether the last check is long ago because this process itself was stopped. The worker may have
                been stopped too, so only its silence from now on counts.
        """
        # A worker is silent while it starts or compiles a function.
        is_quiet = self._starting is not None or self.spec.run.compiling is not None
        patience = self._settings.start_seconds if is_quiet else self._settings.hang_seconds
        worker = self._starting or self.worker
        if worker is None or worker.pid is None:
            return
        if after_gap:
            worker.heard = time.monotonic()
        elif time.monotonic() - worker.heard > patience:
            worker.kill(
                f"The session's worker did not respond for {patience:g} s and was stopped. "
                "Resume it to continue at the same frame."
            )

    def open_scene(self) -> "Endpoint":
        """Make the scene if there is none, and return the endpoint for its browsers."""
        return self.scene_feed.open(self.description, self._in_force())

    # ------------------------------------------------------------ commands

    async def command(self, command: protocol.Command) -> Answer:
        """Carry out a command.

        Returns:
            The command's answer, or the session right after the command; a playing session has moved on since.

        Raises:
            ConflictError: There is no worker, or the other branches rule the command out.
            ApiError: The branch does not exist (404).
            Exception: The worker's refusal.
        """

        def answer(result: Any) -> Answer:  # noqa: ANN401 - of any order
            if isinstance(command, protocol.MakeBranch) and command.title:
                self.spec.active.title = command.title
                self.keep()
            return self.view() if result is None else result

        if isinstance(command, protocol.ShowBranch) and command.branch not in self.spec.branches:
            raise not_found("The session has no branch of this name.")
        count = len(self.spec.branches)
        if isinstance(command, protocol.Restart) and command.seed not in {None, self.spec.recipe.seed} and count > 1:
            raise ConflictError(
                f"All {count} branches share the session's seed; start another session for seed {command.seed}."
            )
        answered: Answer = await self.order(command, answer)
        return answered

    async def order(self, order: protocol.Order, then: Callable[[Any], Any] = lambda result: result) -> Any:  # noqa: ANN401 - each has an answer of its own
        """Send an order to the worker, after the order before it if it has to wait for that.

        Args:
            order: The order.
            then: Turns its result into the answer before anything else happens to the session.

        Raises:
            ConflictError: There is no worker, or no room for another branch.
            Exception: The worker's refusal.
        """
        async with self._command_lock if order.queues else nullcontext():
            self.scene_feed.note_turn(order)
            if self._makes_branch(order) and len(self.spec.branches) >= self._settings.max_branches:
                raise ConflictError(f"A session holds at most {self._settings.max_branches} branches; start another.")
            if self.worker is None:
                raise ConflictError(f"The session is {self.phase}; resume it first.")
            known = self.spec.branches[order.branch].run if isinstance(order, protocol.ShowBranch) else None
            return await self.worker.request(order, then, self.spec.next_branch(), known)

    async def thumbnail(self) -> bytes | None:
        """Return a recent picture as PNG, or None if there was none since the server started."""
        if self.worker is not None and self.is_free:
            with suppress(ConflictError, ApiError):
                self._thumbnail = await self.order(protocol.Picture())
        return self._thumbnail

    def _makes_branch(self, order: protocol.Order) -> bool:
        if isinstance(order, protocol.ChangeValues):
            return bool(order.values) and self.spec.run.branch_point is not None
        if isinstance(order, protocol.MoveBelief):
            return self.spec.run.branch_point is not None
        return isinstance(order, protocol.MakeBranch | protocol.ReviseFilter)

    # ------------------------------------------------------------ news for the scene's panel

    def _tell_refusal(self, detail: dict[str, Any]) -> None:
        self.stream.emit(Refused(**detail))
        self.scene_feed.refuse(detail["message"])

    def _in_force(self) -> PanelValues:
        run = self.spec.run
        return PanelValues(run.parameters, run.tracker, run.recipe.seed, run.speed, run.branch_point)

    # ------------------------------------------------------------ reports of the worker

    def _credit(self, form: protocol.Form) -> None:
        if self.worker is not None:
            self.worker.credit(form)

    def _event(self, event: protocol.Event) -> None:
        if isinstance(event, protocol.Ready):
            self.worker = self._starting
            self.stream.change_worker(is_ahead=True)
            self.begin(event)
        if isinstance(event, protocol.Described):
            self.describe(event.description)
            self._reopening = asyncio.ensure_future(self.scene_feed.close())
        if isinstance(event, protocol.Progress):
            self.advance(event.changes, event.rows)
            if event.scene is not None:
                self.scene_feed.offer(event.scene, self.spec.run.position)
            self.stream.draw(event.flat, is_ahead=event.is_ahead)

    def _on_worker_lost(self, reason: str) -> None:
        self.worker = None
        self.stream.change_worker(is_ahead=False)
        self.enter(Phase.CRASHED, reason)

    async def _stop_worker(self) -> None:
        worker, self.worker = self.worker or self._starting, None
        self.stream.change_worker(is_ahead=False)
        if worker is not None:
            await worker.close()
