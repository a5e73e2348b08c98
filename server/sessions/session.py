"""The session: a run that somebody watches, as the web process knows it.

It holds the newest spec, the diagnostics of every branch and those who listen; what it knows of the run comes from the
worker alone. Commands go through one door, one at a time.
"""

import asyncio
import time
from collections.abc import Callable
from typing import Any

from pftrack.parameters import ParameterError
from server.errors import ConflictError, shape
from server.sessions import messages, protocol
from server.sessions.history import History, finite
from server.sessions.link import Link, WorkerLostError
from server.sessions.listeners import Listeners
from server.sessions.messages import State
from server.sessions.spec import Bookmark, BranchSpec, SessionSpec, as_models, as_timeline, colour
from server.sessions.stage import Stage
from server.sessions.view import branch_views, view
from server.settings import Settings

__all__ = ["Session"]

Orders = Callable[[SessionSpec], protocol.Order]
LONGEST_BOOKMARKS = 500


class Session:
    """One session; all methods belong to the event loop's thread.

    Attributes:
        spec: Everything that is kept of it.
        state: What it is doing.
        message: Why it is in this state, where there is something to say.
        dirty: Whether the spec has changed since it was last stored.
        left: When the last visitor left (monotonic, s).
        frames_computed: Frames that its workers have computed.
    """

    def __init__(self, spec: SessionSpec, settings: Settings, orders: Orders, *, state: State = "suspended") -> None:
        self.spec = spec
        self.state: State = state
        self.message: str | None = None
        self.dirty = True
        self.left = time.monotonic()
        self.frames_computed = 0
        self._settings = settings
        self._orders = orders
        self._link: Link | None = None
        self._card = protocol.Card(**spec.card) if spec.card else None
        self._playing = False
        self._ended = False
        self._beginnings = 0
        self._histories: dict[str, History] = {}
        self._door = asyncio.Lock()
        self._wishes: dict[str, Any] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self.listeners = Listeners(self.hello)
        self.stage = Stage(credit=self._credit, on_values=self._wish, on_transport=self._transport_wish)

    # ------------------------------------------------------------ what it is

    @property
    def live(self) -> bool:
        """Whether it has a worker, or is about to have one."""
        return self.state in {"starting", "ready", "playing", "ended"}

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
        if self._card is None:
            raise ConflictError("The session has not started yet.")
        return self._card

    def view(self) -> messages.SessionView:
        """Return it as everybody outside sees it."""
        return view(self.spec, self.card, self.state, self.message, playing=self._playing)

    def hello(self) -> messages.Hello:
        """Return everything there is to know."""
        return messages.Hello(session=self.view(), diagnostics=self.columns(self.spec.branch))

    def columns(self, branch: str) -> dict[str, list[Any]]:
        """Return the diagnostics of a branch."""
        history = self._histories.get(branch)
        return dict(history.columns) if history else {}

    # ------------------------------------------------------------ life

    async def start(self) -> None:
        """Start a worker that makes the run as the spec has it.

        Raises:
            Exception: Whatever refused the spec.
        """
        async with self._door:
            if self._link is not None:
                return
            self._become("starting")
            link = Link(self._orders(self.spec), self._event, self._lost)
            try:
                ready = await link.start(self._settings.start_seconds)
            except BaseException as error:
                self._become("crashed", str(error))
                raise
            self._link = link
            self._card = ready.card
            self.spec.card = {name: getattr(ready.card, name) for name in protocol.Card.__slots__}
            self.spec.frames = ready.card.frames
            self._histories[self.spec.branch] = History()
            self._histories[self.spec.branch].put([finite(row) for row in ready.rows])
            self._beginnings = ready.standing.beginnings
            self._stand(ready.standing)
            self.listeners.greet()
            self.stage.resumed()

    async def open_stage(self) -> int:
        """Make the scene unless there is one, and return the port of its viser server."""
        return await self.stage.open(self.card, self.spec.values, self.spec.active.tracker)

    async def suspend(self, message: str) -> None:
        """End the worker; the spec remembers everything."""
        async with self._door:
            await self._hang_up()
            self._become("suspended", message)
        await self.stage.close()

    async def close(self, message: str) -> None:
        """End it for good, or for this server's life."""
        async with self._door:
            await self._hang_up()
            self.listeners.emit(messages.SessionNews(state="ended", message=message))
            self.listeners.close()
            self.state = "ended"
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
            frame = await self._request(command, self._settings.command_seconds)
            return int(frame) if isinstance(frame, int) else self.spec.active.position + 1

    async def transport(self, action: str, frame: int | None = None, speed: float | None = None) -> None:
        """Play, pause, step, back, seek, speed or restart."""
        if action == "seek" and frame is None:
            raise ParameterError("frame", frame, f"a frame of the run, 0 to {self.card.frames - 1}")
        if action == "speed" and speed is None:
            raise ParameterError("speed", speed, "0 (as fast as possible) or between 0.1 and 10")
        command: protocol.Command
        match action:
            case "speed":
                command = protocol.Speed(speed or 0.0)
            case "restart":
                command = protocol.Restart()
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
                self.spec.branches[name].title = title
                self._tell_branches()

    async def activate(self, branch: str) -> None:
        """Show another branch."""
        async with self._door:
            there = self.spec.branches[branch]
            command = protocol.Activate(
                branch,
                there.first_tracker or there.tracker,
                as_timeline(there.timeline),
                there.head,
                there.position,
            )
            await self._request(command, self._settings.seek_seconds)

    async def save(self, path: str) -> dict[str, Any]:
        """Write the active branch to a file; return its summary and a picture."""
        async with self._door:
            saved = await self._request(protocol.Save(path), self._settings.seek_seconds)
        assert isinstance(saved, dict)  # noqa: S101 - for the type checker
        return saved

    async def picture(self) -> bytes:
        """Return the current frame as PNG."""
        png = await self._request(protocol.Picture(), self._settings.command_seconds)
        assert isinstance(png, bytes)  # noqa: S101 - for the type checker
        return png

    def bookmark(self, name: str, note: str) -> Bookmark:
        """Remember the frame that is shown."""
        if len(self.spec.bookmarks) >= LONGEST_BOOKMARKS:
            raise ConflictError(f"A session holds at most {LONGEST_BOOKMARKS} bookmarks; delete one first.")
        made = Bookmark(id=name, frame=self.spec.active.position, note=note, branch=self.spec.branch)
        self.spec.bookmarks = sorted([*self.spec.bookmarks, made], key=lambda item: item.frame)
        self._tell_bookmarks()
        return made

    def unbookmark(self, name: str) -> bool:
        """Forget a bookmark; return whether there was one."""
        kept = [item for item in self.spec.bookmarks if item.id != name]
        found = len(kept) < len(self.spec.bookmarks)
        self.spec.bookmarks = kept
        self._tell_bookmarks()
        return found

    async def _request(self, command: protocol.Command, timeout_s: float) -> object:
        if self._link is None:
            raise ConflictError(f"The session is {self.state}; resume it first.")
        return await self._link.request(command, timeout_s)

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
            pass
        values, self._wishes = self._wishes, {}
        await self._answered(self.change(values))

    def _transport_wish(self, wish: dict[str, Any]) -> None:
        self._later(self._answered(self.transport(**wish)))

    async def _answered(self, command: Any) -> None:  # noqa: ANN401 - the coroutine of any command
        """Carry out a command of the panel, and tell page and panel if it is refused."""
        try:
            await command
        except (ParameterError, ConflictError, WorkerLostError, TypeError) as error:
            known = {name: getattr(error, name, None) for name in ("field", "bound", "value")}
            detail = shape(str(error), **known)
            self.listeners.emit(messages.Refused(**detail))
            self.stage.refuse(detail["message"])

    def _later(self, command: Any) -> None:  # noqa: ANN401 - any coroutine
        task = asyncio.ensure_future(command)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    # ------------------------------------------------------------ what the worker says

    def _credit(self) -> None:
        if self._link is not None:
            self._link.credit()

    def _event(self, event: protocol.Event) -> None:
        if not isinstance(event, protocol.Progress):
            return
        shown = event.shown["frame"] if event.shown else None
        rows = [finite(row) for row in event.rows]
        self._stand(event.standing)
        if rows:
            self.frames_computed += len(rows)
            self._history(event.standing.branch).put(rows)
            self._tell_rows(event.standing.branch, rows, shown)
        if event.drawing is not None and event.shown is not None:
            self.stage.offer(event.drawing, finite(event.shown))

    def _stand(self, now: protocol.Standing) -> None:
        """Take over where the run stands, and tell what has changed."""
        known = self.spec.branches.get(now.branch)
        if known is None:
            known = self._new_branch(now)
        switched = self.spec.branch != now.branch
        before = (known.position, known.head, self._playing, self.spec.speed)
        changed = {name: value for name, value in now.values.items() if self.spec.values.get(name) != value}
        if known.tracker != now.tracker and not switched:
            changed["tracker"] = now.tracker
        timeline_changed = len(now.timeline) != len(known.timeline) or bool(changed) or switched
        self.spec.branch = now.branch
        known.position, known.head = now.position, now.head
        known.first_tracker, known.tracker = now.first_tracker, now.tracker
        self.spec.speed, self._playing, self._ended = now.speed, now.playing, now.ended
        self.spec.values = now.values
        if timeline_changed:
            known.timeline = as_models(now.timeline)
        self.dirty = True
        if now.beginnings != self._beginnings:
            self._beginnings = now.beginnings
            self._histories[now.branch] = History()
            self._forget_bookmarks(now.branch)
            self.listeners.greet()
        self._become("playing" if now.playing else "ended" if now.ended else "ready")
        if switched:
            self._tell_branches()
        if changed or switched:
            self._tell_values(changed)
        if switched or before != (now.position, now.head, now.playing, now.speed):
            self.listeners.emit(
                messages.Position(
                    branch=now.branch, frame=now.position, head=now.head, playing=now.playing, speed=now.speed
                )
            )

    def _new_branch(self, now: protocol.Standing) -> BranchSpec:
        """Take note of a branch that the worker made."""
        parent, number = self.spec.branch, self.spec.branches_made
        frame = min(now.position, now.head)
        made = BranchSpec(
            id=now.branch,
            title=f"{self.card.trackers.get(now.tracker, now.tracker)} from frame {frame}",
            parent=parent,
            frame=frame,
            tracker=now.tracker,
            colour=colour(number),
        )
        self.spec.branches_made = number + 1
        self.spec.branches[made.id] = made
        self._histories[made.id] = self._history(parent).upto(frame)
        return made

    def _history(self, branch: str) -> History:
        return self._histories.setdefault(branch, History())

    def _lost(self, reason: str) -> None:
        self._link = None
        self._playing = False
        self._become("crashed", reason)

    async def _hang_up(self) -> None:
        link, self._link = self._link, None
        self._playing = False
        if link is not None:
            await link.close()

    def _become(self, state: State, message: str | None = None) -> None:
        """Be in another state, and say so unless the transport says it already."""
        if state == self.state and message == self.message:
            return
        between = {self.state, state} <= {"ready", "playing"}
        self.state, self.message = state, message
        if not between:
            self.listeners.emit(messages.SessionNews(state=state, message=message))

    # ------------------------------------------------------------ what is told

    def _tell_rows(self, branch: str, rows: list[dict[str, Any]], shown: int | None) -> None:
        if len(rows) == 1:
            row = rows[0]
            self.listeners.emit(messages.Frame(branch=branch, diagnostics=row, shown=shown == row["frame"]))
        else:
            self.listeners.emit(messages.Frames(branch=branch, rows=rows))

    def _tell_values(self, changed: dict[str, Any]) -> None:
        active = self.spec.active
        self.stage.tell(self.spec.values, active.tracker, self.spec.speed)
        self.listeners.emit(
            messages.Parameters(
                branch=active.id,
                frame=active.position + 1,
                parameters=self.spec.values,
                tracker=active.tracker,
                values=changed,
            )
        )

    def _tell_branches(self) -> None:
        self.dirty = True
        self.listeners.emit(messages.Branches(branch=self.spec.branch, branches=branch_views(self.spec)))

    def _forget_bookmarks(self, branch: str) -> None:
        kept = [item for item in self.spec.bookmarks if item.branch != branch]
        if len(kept) < len(self.spec.bookmarks):
            self.spec.bookmarks = kept
            self._tell_bookmarks()

    def _tell_bookmarks(self) -> None:
        self.dirty = True
        self.listeners.emit(messages.Bookmarks(bookmarks=self.spec.bookmarks))
