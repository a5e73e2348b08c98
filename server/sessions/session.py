"""The session: a run that somebody watches, as the web process knows it.

What it knows of the run comes from the worker alone and is taken down in its chronicle. Commands go through one door,
one at a time.
"""

import asyncio
import time
from collections.abc import Callable, Coroutine
from typing import TYPE_CHECKING, Any, cast

from pftrack.parameters import ParameterError
from pftrack.run import EndOfRun, PastError
from server.errors import ApiError, ConflictError, shape
from server.sessions import messages, protocol
from server.sessions.chronicle import Chronicle
from server.sessions.link import Link
from server.sessions.listeners import Listeners
from server.sessions.messages import State
from server.sessions.spec import LARGEST_SEED, Bookmark, SessionSpec, as_timeline
from server.sessions.stage import Stage
from server.settings import Settings

if TYPE_CHECKING:
    from server.viewer import Endpoint

__all__ = ["Session"]

Orders = Callable[[SessionSpec], protocol.Order]
MOST_BOOKMARKS = 500


class Session:
    """One session; all methods belong to the event loop's thread.

    Attributes:
        chronicle: What is known of it.
        stage: Its scene.
        left: When the last visitor left (monotonic, s).
    """

    def __init__(self, spec: SessionSpec, settings: Settings, orders: Orders, *, state: State = "suspended") -> None:
        self.chronicle = Chronicle(spec, state, self._tell_panel)
        self.stage = Stage(credit=self._credit, on_values=self._wish, on_transport=self._transport_wish)
        self.left = time.monotonic()
        self._settings = settings
        self._orders = orders
        self._link: Link | None = None
        self._door = asyncio.Lock()
        self._wishes: dict[str, Any] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    # ------------------------------------------------------------ what it is

    @property
    def spec(self) -> SessionSpec:
        """Everything that is kept of it."""
        return self.chronicle.spec

    @property
    def state(self) -> State:
        """What it is doing."""
        return self.chronicle.state

    @property
    def live(self) -> bool:
        """Whether it has a worker, or is about to have one."""
        return self.state in {"starting", "ready", "playing", "ended"}

    @property
    def listeners(self) -> Listeners:
        """Who hears its stream."""
        return self.chronicle.listeners

    @property
    def visitors(self) -> int:
        """How many connections look at it or listen to it."""
        return len(self.listeners) + self.stage.watchers

    @property
    def link(self) -> Link | None:
        """The worker, where there is one."""
        return self._link

    @property
    def card(self) -> protocol.Card:
        """What does not change while it lives."""
        if self.chronicle.card is None:
            raise ConflictError("The session has not started yet.")
        return self.chronicle.card

    def view(self) -> messages.SessionView:
        """Return it as everybody outside sees it."""
        return self.chronicle.view()

    # ------------------------------------------------------------ life

    async def start(self) -> None:
        """Start a worker that makes the run as the spec has it.

        Raises:
            Exception: Whatever refused the spec.
        """
        async with self._door:
            if self._link is not None:
                return
            self.chronicle.become("starting")
            try:
                link = Link(self._orders(self.spec), self._event, self._lost)
                ready = await link.start(self._settings.start_seconds)
            except BaseException as error:
                self.chronicle.become("crashed", str(error))
                raise
            self._link = link
            self.chronicle.begin(ready)
            self.stage.resumed()

    async def suspend(self, message: str) -> None:
        """End the worker; the spec remembers everything."""
        async with self._door:
            await self._hang_up()
            self.chronicle.become("suspended", message)
        await self.stage.close()

    async def close(self, message: str) -> None:
        """End it for good, or for this server's life."""
        # Before the door opens, so that whoever waits inside for the worker is sent away.
        await self._hang_up()
        async with self._door:
            await self._hang_up()
            self.chronicle.become("ended", message)
            self.listeners.close()
        for task in list(self._tasks):
            task.cancel()
        await self.stage.close()

    def check(self) -> None:
        """End the worker if it has been silent for too long."""
        link = self._link
        if link is not None and time.monotonic() - link.heard > self._settings.hang_seconds:
            link.kill(
                f"The session's worker gave no sign of life for {self._settings.hang_seconds:g} s and was stopped. "
                "Resume it to go on where it was."
            )

    async def open_stage(self) -> "Endpoint":
        """Make the scene unless there is one, and return where the bridge connects to it."""
        return await self.stage.open(self.card, self.spec.values, self.spec.active.tracker, self.spec.seed)

    # ------------------------------------------------------------ commands

    async def change(self, values: dict[str, Any]) -> int:
        """Change parameters; return the frame from which they count.

        Raises:
            ParameterError: A value is refused.
        """
        async with self._door:
            if not values:
                return self.spec.active.position + 1
            if self.spec.active.position < self.spec.active.head:
                self._room_for_branch()
            command = protocol.Change(values, self.spec.next_branch())
            return cast("int", await self._request(command, self._settings.command_seconds))

    async def transport(
        self, action: str, frame: int | None = None, speed: float | None = None, seed: object = None
    ) -> None:
        """Play, pause, step, back, seek, speed or restart, the last with another seed if one is given."""
        if action == "seek" and frame is None:
            raise ParameterError("frame", frame, f"a frame of the run, 0 to {self.card.frames - 1}")
        if action == "speed" and speed is None:
            raise ParameterError("speed", speed, "0 (as fast as possible) or between 0.1 and 10")
        command: protocol.Command
        match action:
            case "speed":
                command = protocol.Speed(speed or 0.0)
            case "restart":
                command = protocol.Restart(self._checked_seed(seed))
            case _:
                command = protocol.Transport(action, frame or 0)
        # Not through the door: a pause has to reach a worker that is busy with a long seek.
        await self._request(command, self._settings.seek_seconds)

    async def branch(self, frame: int, values: dict[str, Any], title: str | None) -> None:
        """Leave the active branch at a frame and go on in a new one."""
        async with self._door:
            self._room_for_branch()
            name = self.spec.next_branch()
            await self._request(protocol.Branch(name, frame, values), self._settings.command_seconds)
            if title:
                self.chronicle.name_branch(name, title)

    async def activate(self, branch: str) -> None:
        """Show another branch."""
        async with self._door:
            there = self.spec.branches[branch]
            first = there.first_tracker or there.tracker
            command = protocol.Activate(branch, first, as_timeline(there.timeline), there.head, there.position)
            await self._request(command, self._settings.seek_seconds)

    async def save(self, path: str) -> dict[str, Any]:
        """Write the active branch to a file; return its summary and a picture."""
        async with self._door:
            return cast("dict[str, Any]", await self._request(protocol.Save(path), self._settings.seek_seconds))

    async def picture(self) -> bytes:
        """Return the current frame as PNG."""
        return cast("bytes", await self._request(protocol.Picture(), self._settings.command_seconds))

    def bookmark(self, name: str, note: str) -> Bookmark:
        """Remember the frame that is shown."""
        if len(self.spec.bookmarks) >= MOST_BOOKMARKS:
            raise ConflictError(f"A session holds at most {MOST_BOOKMARKS} bookmarks; delete one first.")
        return self.chronicle.bookmark(name, note)

    async def _request(self, command: protocol.Command, timeout_s: float) -> object:
        if self._link is None:
            raise ConflictError(f"The session is {self.state}; resume it first.")
        return await self._link.request(command, timeout_s)

    def _checked_seed(self, seed: object) -> int | None:
        if seed is None:
            return None
        if not isinstance(seed, int) or isinstance(seed, bool) or not 0 <= seed <= LARGEST_SEED:
            raise ParameterError("seed", seed, f"a whole number, 0 to {LARGEST_SEED}")
        if seed != self.spec.seed and len(self.spec.branches) > 1:
            count = len(self.spec.branches)
            raise ConflictError(f"All {count} branches of the session have its seed; start another session for {seed}.")
        return seed

    def _room_for_branch(self) -> None:
        if len(self.spec.branches) >= self._settings.max_branches:
            raise ConflictError(f"A session holds at most {self._settings.max_branches} branches; start another.")

    # ------------------------------------------------------------ what the scene's panel wishes

    def _wish(self, values: dict[str, Any]) -> None:
        """Gather the panel's changes, the newest of each, while one is on its way."""
        idle = not self._wishes
        self._wishes.update(values)
        if idle:
            self._later(self._grant())

    async def _grant(self) -> None:
        async with self._door:
            values, self._wishes = self._wishes, {}
        await self._answered(self.change(values))

    def _transport_wish(self, wish: dict[str, Any]) -> None:
        self._later(self._answered(self.transport(**wish)))

    async def _answered(self, command: Coroutine[Any, Any, object]) -> None:
        """Carry out a command of the panel, and tell page and panel if it is refused."""
        try:
            await command
        except (ParameterError, EndOfRun, PastError, ApiError) as error:
            known = {name: getattr(error, name, None) for name in ("field", "bound", "value")}
            detail = shape(str(error), **known)
            self.listeners.emit(messages.Refused(**detail))
            self.stage.refuse(detail["message"])

    def _later(self, command: Coroutine[Any, Any, None]) -> None:
        task = asyncio.ensure_future(command)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _tell_panel(self) -> None:
        self.stage.tell(self.spec.values, self.spec.active.tracker, self.spec.speed, self.spec.seed)

    # ------------------------------------------------------------ what the worker says

    def _credit(self) -> None:
        if self._link is not None:
            self._link.credit()

    def _event(self, event: protocol.Event) -> None:
        if isinstance(event, protocol.Progress):
            self.chronicle.stand(event.standing, event.rows, event.shown["frame"] if event.shown else None)
            if event.drawing is not None and event.shown is not None:
                self.stage.offer(event.drawing, event.shown)

    def _lost(self, reason: str) -> None:
        self._link = None
        self.chronicle.playing = False
        self.chronicle.become("crashed", reason)

    async def _hang_up(self) -> None:
        link, self._link = self._link, None
        self.chronicle.playing = False
        if link is not None:
            await link.close()
