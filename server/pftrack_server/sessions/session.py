"""The session: a run that somebody watches, as the web process knows it.

What it knows of the run comes from the worker alone and is kept in its state. Commands go through one door,
one at a time.
"""

import asyncio
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any, TypeVar

from pftrack.core.model.parameters import ParameterError
from pftrack.core.numerics.random import LARGEST_SEED
from pftrack_server.errors import ConflictError
from pftrack_server.flat.feed import DrawingFeed
from pftrack_server.schemas import messages
from pftrack_server.schemas.description import SessionDescription
from pftrack_server.schemas.inspection import InspectionPublic, InspectionUpdate
from pftrack_server.schemas.panel import PanelValues
from pftrack_server.schemas.sessions import Changed
from pftrack_server.schemas.snapshot import Bookmark, Phase
from pftrack_server.schemas.spec import SessionSpec
from pftrack_server.sessions.panel_commands import PanelCommands
from pftrack_server.sessions.scene_feed import SceneFeed
from pftrack_server.sessions.state import SessionState
from pftrack_server.sessions.worker_handle import WorkerHandle, WorkerLostError
from pftrack_server.settings import Settings
from pftrack_server.stream.listeners import SessionListeners
from pftrack_server.worker import protocol

if TYPE_CHECKING:
    from pftrack_server.viewer import Endpoint


ConfigOf = Callable[[SessionSpec], Awaitable[protocol.WorkerConfig]]
MOST_BOOKMARKS = 500
Result = TypeVar("Result")


class Session:
    """One session; all methods belong to the event loop's thread.

    Attributes:
        state: What is known of it.
        scene_feed: Its scene.
        drawing_feed: Its drawings for flat views.
        left: When the last visitor left (monotonic, s).
    """

    def __init__(
        self, spec: SessionSpec, settings: Settings, config_of: ConfigOf, *, phase: Phase = "suspended"
    ) -> None:
        self.state = SessionState(spec, phase, self._tell_panel)
        self._command_lock = asyncio.Lock()
        self._panel = PanelCommands(self._command_lock, self.change, self.transport, self._tell_refusal)
        self.drawing_feed = DrawingFeed(lambda: self._credit("flat"))
        self.scene_feed = SceneFeed(
            credit=lambda: self._credit("scene"),
            on_values=self._panel.change,
            on_transport=self._panel.steer,
        )
        self.left = time.monotonic()
        self._settings = settings
        self._config_of = config_of
        self._worker: WorkerHandle | None = None
        self._starting: WorkerHandle | None = None
        self._is_closed = False
        self._thumbnail: bytes | None = None
        self._reopening: asyncio.Future[None] | None = None

    # ------------------------------------------------------------ what it is

    @property
    def spec(self) -> SessionSpec:
        """Everything that is kept of it."""
        return self.state.spec

    @property
    def phase(self) -> Phase:
        """Its phase."""
        return self.state.snapshot.state

    @property
    def live(self) -> bool:
        """Whether it has a worker, or is about to have one; "ended" is a run that has come to its last frame."""
        return not self._is_closed and self.phase in {"starting", "ready", "playing", "ended"}

    @property
    def listeners(self) -> SessionListeners:
        """The listeners of its stream."""
        return self.state.listeners

    @property
    def visitors(self) -> int:
        """Number of connections that look at it or listen to it."""
        return len(self.listeners) + self.scene_feed.watchers + len(self.drawing_feed)

    @property
    def worker(self) -> WorkerHandle | None:
        """The worker, where there is one."""
        return self._worker

    @property
    def is_free(self) -> bool:
        """Whether no command is under way that the next one has to wait for."""
        return not self._command_lock.locked()

    @property
    def is_unused(self) -> bool:
        """Whether it has a worker, which nobody watches or waits for."""
        return self._worker is not None and self.is_free and not self.visitors and not self._worker.is_asked

    @property
    def description(self) -> SessionDescription:
        """What is fixed of it while it lives."""
        return self.state.description

    def view(self) -> messages.SessionPublic:
        """Return it as everybody outside sees it."""
        return self.state.view()

    # ------------------------------------------------------------ life

    async def start(self) -> None:
        """Start a worker that makes the run as the spec has it; it may then still be on its way to where it was.

        Raises:
            ConflictError: It was ended while this waited.
            Exception: Whatever refused the spec.
        """
        async with self._command_lock:
            if self._is_closed:
                raise ConflictError("The session was ended.")
            if self._worker is not None:
                return
            self.state.set_phase("starting")
            try:
                self._starting = WorkerHandle(await self._config_of(self.spec), self._event, self._on_worker_lost)
                await self._starting.start()
            except BaseException as error:
                self.state.set_phase("crashed", str(error))
                raise
            finally:
                self._starting = None
            self.scene_feed.on_worker_started()
            self.drawing_feed.on_worker_started()

    async def wait_until_open(self, patience_s: float) -> None:
        """Wait for the run to be where it was, but no longer than this; who wants to see it can watch it on its way.

        Raises:
            WorkerLostError: The worker ended first.
        """
        if self._worker is not None:
            await self._worker.wait_until_open(patience_s)

    async def suspend(self, message: str) -> None:
        """End the worker; the spec remembers everything."""
        async with self._command_lock:
            # Before the worker has ended, so that a page that comes meanwhile resumes it.
            self.state.set_phase("suspended", message)
            await self._stop_worker()
        await self.scene_feed.close()

    async def close(self, message: str) -> None:
        """End it for good, or for this server's life."""
        self._is_closed = True
        # Before the door opens, so that whoever waits inside for the worker is sent away.
        await self._stop_worker()
        async with self._command_lock:
            await self._stop_worker()
            self.state.set_phase("ended", message)
            self.listeners.close()
            self.drawing_feed.close()
        self._panel.close()
        await self.scene_feed.close()

    def check(self, *, after_gap: bool) -> None:
        """End the worker if it has been silent for too long.

        Args:
            after_gap: Nobody has looked for a while because this process itself was stopped. Then the worker may have
                been stopped as well, and only its silence from now on counts.
        """
        # While it starts, or compiles a function, a worker has nothing to say.
        is_quiet = self._starting is not None or self.spec.run.compiling is not None
        patience = self._settings.start_seconds if is_quiet else self._settings.hang_seconds
        worker = self._starting or self._worker
        if worker is None or worker.pid is None:
            return
        if after_gap:
            worker.heard = time.monotonic()
        elif time.monotonic() - worker.heard > patience:
            worker.kill(
                f"The session's worker did not respond for {patience:g} s and was stopped. "
                "Resume it to continue where it was."
            )

    async def open_scene(self) -> "Endpoint":
        """Make the scene unless there is one, and return where the bridge connects to it."""
        return await self.scene_feed.open(self.description, self._in_force())

    # ------------------------------------------------------------ commands

    async def change(self, values: dict[str, Any]) -> Changed:
        """Change parameters; return what is then in force, and from which frame on.

        Raises:
            ParameterError: A value is refused.
        """
        async with self._command_lock:
            if not values:
                return self._change_result(self.spec.run.position + 1)
            if self.spec.run.branch_point is not None:
                self._room_for_branch()
            command = protocol.Change(values, self.spec.next_branch())
            return await self._request(command, self._change_result)

    async def transport(
        self,
        action: str,
        frame: int | None = None,
        speed: float | None = None,
        seed: object = None,
        probability: float | None = None,
    ) -> messages.SessionPublic:
        """Play, pause, step, back, seek, before_loss, speed, stop_at or restart, with what belongs to the action.

        Returns:
            The session as the command left it, which is not where it is by now if it plays.
        """
        if action == "seek" and frame is None:
            raise ParameterError("frame", frame, f"a frame of the run, 0 to {self.description.frames - 1}")
        if action == "speed" and speed is None:
            raise ParameterError("speed", speed, "0 (as fast as possible) or between 0.1 and 10")
        command: protocol.Command
        match action:
            case "speed":
                command = protocol.Speed(speed or 0.0)
            case "stop_at":
                command = protocol.StopAt(probability)
            case "restart":
                command = protocol.Restart(self._check_seed(seed))
            case "before_loss":
                command = protocol.Transport("seek", self._before_loss())
            case _:
                command = protocol.Transport(action, frame or 0)
        # Not through the door: a pause has to reach a worker that is busy with a long seek.
        return await self._request(command, self._view)

    async def revise_filter(self, name: str, text: str) -> None:
        """Go on with another version of a filter's file, from the frame where the run stands."""
        async with self._command_lock:
            self._room_for_branch()
            await self._request(protocol.ReviseFilter(name, text, self.spec.next_branch()), _plain)

    async def branch(self, frame: int, values: dict[str, Any], title: str | None) -> messages.SessionPublic:
        """Leave the active branch at a frame and go on in a new one; return the session as it is then."""
        async with self._command_lock:
            self._room_for_branch()
            name = self.spec.next_branch()

            def titled(result: object) -> messages.SessionPublic:
                if title:
                    self.state.name_branch(name, title)
                return self._view(result)

            return await self._request(protocol.Branch(name, frame, values), titled)

    async def activate(self, branch: str) -> messages.SessionPublic:
        """Show another branch; return the session as it is then."""
        async with self._command_lock:
            return await self._request(protocol.Activate(self.spec.branches[branch].run), self._view)

    async def save(self, path: str) -> dict[str, Any]:
        """Write the active branch to a file; return its summary and a picture."""
        async with self._command_lock:
            saved: dict[str, Any] = await self._request(protocol.Save(path), _plain)
            return saved

    async def picture(self) -> bytes:
        """Return the current frame as PNG."""
        png: bytes = await self._request(protocol.Picture(), _plain)
        return png

    async def inspect(self, wanted: InspectionUpdate) -> InspectionPublic:
        """Look at something in the frame that is shown, and have it drawn from now on; return what is found.

        Raises:
            ParameterError: There is no such thing to look at.
        """
        found: InspectionPublic = await self._request(protocol.Inspect(wanted), _plain)
        return found

    async def explain(self, frame: int | None) -> dict[str, Any]:
        """Return why the target was lost in the active branch, or what is wrong in a frame, as JSON values."""
        explanation: dict[str, Any] = await self._request(protocol.Explain(frame), _plain)
        return explanation

    async def thumbnail(self) -> bytes | None:
        """Return a picture of about where it is as PNG, or None if there has been none while this server runs."""
        if self.worker is not None and self.is_free:
            with suppress(ConflictError, WorkerLostError):
                self._thumbnail = await self.picture()
        return self._thumbnail

    def bookmark(self, name: str, note: str) -> Bookmark:
        """Remember the frame that is shown."""
        if len(self.spec.bookmarks) >= MOST_BOOKMARKS:
            raise ConflictError(f"A session holds at most {MOST_BOOKMARKS} bookmarks; delete one first.")
        return self.state.bookmark(name, note)

    async def _request(self, command: protocol.Command, then: Callable[[Any], Result]) -> Result:
        if self._worker is None:
            raise ConflictError(f"The session is {self.phase}; resume it first.")
        return await self._worker.request(command, then)

    def _view(self, result: object) -> messages.SessionPublic:
        del result  # the commands that are answered so have none
        return self.view()

    def _change_result(self, frame: int) -> Changed:
        run = self.spec.run
        return Changed(parameters=run.parameters, tracker=run.tracker, frame=frame, branch=run.branch)

    def _check_seed(self, seed: object) -> int | None:
        if seed is None:
            return None
        if not isinstance(seed, int) or isinstance(seed, bool) or not 0 <= seed <= LARGEST_SEED:
            raise ParameterError("seed", seed, f"a whole number, 0 to {LARGEST_SEED}")
        if seed != self.spec.recipe.seed and len(self.spec.branches) > 1:
            count = len(self.spec.branches)
            raise ConflictError(f"All {count} branches of the session have its seed; start another session for {seed}.")
        return seed

    def _before_loss(self) -> int:
        frame = self.state.before_loss()
        if frame is None:
            raise ConflictError("The target has not been lost so far.")
        return frame

    def _room_for_branch(self) -> None:
        if len(self.spec.branches) >= self._settings.max_branches:
            raise ConflictError(f"A session holds at most {self._settings.max_branches} branches; start another.")

    # ------------------------------------------------------------ what the scene's panel hears

    def _tell_refusal(self, detail: dict[str, Any]) -> None:
        self.listeners.emit(messages.Refused(**detail))
        self.scene_feed.refuse(detail["message"])

    def _tell_panel(self) -> None:
        self.scene_feed.tell(self._in_force())

    def _in_force(self) -> PanelValues:
        run = self.spec.run
        return PanelValues(run.parameters, run.tracker, run.recipe.seed, run.speed, run.branch_point)

    # ------------------------------------------------------------ what the worker says

    def _credit(self, form: protocol.Form) -> None:
        if self._worker is not None:
            self._worker.credit(form)

    def _event(self, event: protocol.Event) -> None:
        if isinstance(event, protocol.Ready):
            self._worker = self._starting
            self.state.begin(event)
        if isinstance(event, protocol.Described):
            self.state.describe(event.description)
            self._reopening = asyncio.ensure_future(self.scene_feed.close())
        if isinstance(event, protocol.Progress):
            self.state.advance(event.changes, event.rows)
            if event.scene is not None:
                self.scene_feed.offer(event.scene, self.spec.run.position)
            if event.flat is not None:
                self.drawing_feed.offer(event.flat)

    def _on_worker_lost(self, reason: str) -> None:
        self._worker = None
        self.state.set_phase("crashed", reason)

    async def _stop_worker(self) -> None:
        worker, self._worker = self._worker or self._starting, None
        if worker is not None:
            await worker.close()


def _plain(result: Any) -> Any:  # noqa: ANN401 - whatever the command gives
    return result
