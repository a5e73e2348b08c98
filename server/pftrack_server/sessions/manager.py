"""The manager: all sessions of a server, and the housekeeping around them.

It makes room, ends and resumes sessions, stops workers that fall silent, suspends sessions that nobody watches, and
stores every change, so that each session resumes at the same frame after a restart of the server.
"""

import asyncio
import contextlib
import itertools
import time
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any, TypeAlias

import structlog

from pftrack.core.refusal import ConflictError
from pftrack.sources.sequence import Recording
from pftrack_server.core.errors import not_found, unavailable
from pftrack_server.core.log import RateLimitedLogger
from pftrack_server.core.settings import Settings
from pftrack_server.jobs.child_tasks import ChildTasks
from pftrack_server.sessions.session import Session
from pftrack_server.sessions.spec import Phase, SessionSpec
from pftrack_server.sessions.worker.protocol import Play, ReviseFilter, WorkerConfig
from pftrack_server.store import Store
from pftrack_server.store.database import SessionRow
from pftrack_server.store.disk_budget import failure_message, is_busy, is_full
from pftrack_server.store.files import is_name
from pftrack_server.uploads.intake import limits_of, recording_of

Prepare: TypeAlias = Callable[[Session], Awaitable[None]]
"""Prepares a started session before its client receives it."""

log = structlog.get_logger(__name__)

ROUND_S = 0.5
# Positions are stored every ten seconds; after a crash the run computes the rest again.
POSITIONS_EVERY = 20
LONGEST_CATCH_S = 5.0
# How long a start or resume waits for a session to reach its frame; then the answer reports how far it is.
OPENING_S = 2.0


class Manager:
    """All sessions of a server.

    Attributes:
        is_followed: Returns whether a class follows the session of a name.
    """

    def __init__(
        self, settings: Settings, store: Store, tasks: ChildTasks, wait_for: Callable[[str], Awaitable[None]]
    ) -> None:
        """Begin without sessions.

        Args:
            settings: Settings of the server.
            store: Holds the sessions.
            tasks: Decodes an upload again if its index is damaged.
            wait_for: Waits for an experiment to be compiled; raises an error if it takes longer.
        """
        self._settings = settings
        self._wait_for = wait_for
        self._store = store
        self._tasks = tasks
        self._sessions: dict[str, Session] = {}
        self._rounds: asyncio.Task[None] | None = None
        self._writing = asyncio.Lock()
        self._warnings = RateLimitedLogger(__name__, every_s=60.0)
        self.is_followed: Callable[[str], bool] = lambda _: False

    async def open(self) -> None:
        """Load the stored sessions, all suspended, and begin the periodic rounds."""
        for row in reversed(await asyncio.to_thread(self._store.all, SessionRow)):
            try:
                spec = SessionSpec.model_validate_json(row.spec)
                if spec.follow is not None:
                    # Its class ended with the server.
                    await asyncio.to_thread(self._store.remove, SessionRow, spec.id)
                    continue
                session = Session(spec, self._settings, self.config)
                if spec.description is not None:
                    session.view()
            except (ValueError, TypeError, LookupError, AttributeError) as error:
                log.warning("a stored session is damaged and left out", session=row.id, error=repr(error))
                continue
            session.enter(Phase.SUSPENDED, "The server was restarted; the session resumes at the same frame.")
            session.dirty = False
            self._sessions[spec.id] = session
        self._rounds = asyncio.create_task(self._watch_sessions())

    async def close(self) -> None:
        """Store everything and end all workers."""
        if self._rounds is not None:
            self._rounds.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._rounds
        await self._attempt(self.keep())
        message = "The server was stopped; the session resumes when it is back."
        await asyncio.gather(*(session.close(message) for session in self._sessions.values()))
        self._sessions.clear()

    @property
    def all(self) -> list[Session]:
        """All sessions, newest first."""
        return sorted(self._sessions.values(), key=lambda session: session.spec.created, reverse=True)

    def find(self, name: str) -> Session | None:
        """Return a session, or None if it does not exist."""
        session = self._sessions.get(name)
        return session if session is not None and session.spec.description is not None else None

    def get(self, name: str) -> Session:
        """Return a session.

        Raises:
            ApiError: The session does not exist (404).
        """
        session = self.find(name)
        if session is None:
            raise not_found("This session does not exist; it may have been ended.")
        return session

    async def create(self, spec: SessionSpec, prepare: Prepare | None = None) -> Session:
        """Start a new session and prepare it for its client; if that fails, end it.

        Raises:
            ApiError: All places are taken (503).
            ConflictError: A session of that name exists.
            Exception: The refusal of the spec, or the failure of the preparation.
        """
        await asyncio.to_thread(self._store.disk_budget.check)
        while spec.id not in self._sessions and len(self._sessions) >= self._settings.max_stored_sessions:
            await self._drop_oldest(spec)
        if spec.id in self._sessions:
            raise ConflictError(f"There is already a session {spec.id}.")
        session = Session(spec, self._settings, self.config)
        self._sessions[spec.id] = session
        try:
            await self._start(session)
            await self.keep(positions=False)
            await session.wait_until_open(OPENING_S)
            if prepare is not None:
                await prepare(session)
        except BaseException:
            with contextlib.suppress(Exception):
                await self.end(session)
            raise
        return session

    async def resume(self, session: Session) -> None:
        """Start a worker for a session again, at the same frame.

        Raises:
            ApiError: All places are taken (503).
        """
        if not session.live:
            await self._start(session)
            await session.wait_until_open(OPENING_S)

    async def measure_by(self, session: Session, truth: dict[int, tuple[float, ...]] | None) -> None:
        """Measure a session by another truth: remake its run with the same estimates; resume it if it was playing."""
        playing = session.phase is Phase.PLAYING
        session.keep(truth=truth)
        await self.note()
        if session.live:
            await session.suspend("The run is measured again.")
            await self.resume(session)
            if playing:
                await session.command(Play())

    async def revise_filter(self, experiment: str, name: str, text: str) -> None:
        """Switch all live sessions of an experiment to a new version of a filter file."""
        for session in list(self._sessions.values()):
            if session.spec.recipe.experiment == experiment and session.worker is not None:
                await self._attempt(session.order(ReviseFilter(name, text)))
        await self.note()

    async def end(self, session: Session) -> None:
        """End a session permanently."""
        self._sessions.pop(session.spec.id, None)
        await session.close("The session was ended.")
        async with self._writing:
            await asyncio.to_thread(self._store.remove, SessionRow, session.spec.id)
        await asyncio.to_thread(self._store.files.remove_states, session.spec.id)

    async def forget(self, name: str) -> bool:
        """Delete a stored session that could not be read; return whether it existed."""
        if name in self._sessions or not is_name(name):
            return False
        async with self._writing:
            return await asyncio.to_thread(self._store.remove, SessionRow, name)

    async def keep(self, *, positions: bool = True) -> None:
        """Store every session that has changed, including those whose position alone moved if `positions`."""
        async with self._writing:
            known = [session for session in self._sessions.values() if session.spec.description]
            changed = [each for each in known if each.dirty or (positions and each.moved)]
            for session in changed:
                session.dirty = session.moved = False
            if not changed:
                return
            specs = (session.spec for session in changed)
            rows = [SessionRow(id=spec.id, spec=spec.model_dump_json(), created=spec.created) for spec in specs]
            try:
                await asyncio.to_thread(self._store.save, *rows)
            except Exception:
                for session in changed:
                    session.dirty = True
                raise

    async def note(self) -> None:
        """Store what has changed; if that fails, every round tries again."""
        await self._attempt(self.keep(positions=False))

    def uses(self, upload: str) -> bool:
        """Return whether a session needs an upload."""
        return any(session.spec.upload == upload for session in self._sessions.values())

    async def _start(self, session: Session) -> None:
        await self._wait_for(session.spec.recipe.experiment)
        began = time.perf_counter()
        if session.spec.upload:
            await self._recording(session.spec.upload)
        # Last, since other sessions may start meanwhile: after making room nothing is awaited before the place is
        # taken.
        if not session.live:
            await self._make_room()
        await session.start()
        session.left = time.monotonic()
        log.info(
            "session started",
            session=session.spec.id,
            experiment=session.spec.recipe.experiment,
            milliseconds=round(1000 * (time.perf_counter() - began)),
        )

    async def _make_room(self) -> None:
        """Suspend sessions that nobody watches, those left longest first, until a place is free."""
        while sum(session.live for session in self._sessions.values()) >= self._settings.max_sessions:
            unused = [session for session in self._sessions.values() if session.is_unused]
            if not unused:
                raise unavailable(
                    f"All {self._settings.max_sessions} session slots are in use; end a session or close its page."
                )
            longest_left = min(unused, key=lambda session: session.left)
            await longest_left.suspend("Paused to free a slot for another session; it resumes at the same frame.")

    async def _drop_oldest(self, new: SessionSpec) -> None:
        """End the session that was left longest ago, among those that nothing keeps.

        Raises:
            ApiError: All are kept, or the new one is a follower's copy, for which no session is ended (503).
        """
        plain = [session for session in self._sessions.values() if not self._is_held(session)]
        if new.follow or not plain:
            held = "" if new.follow else ", and all of them are open, named, bookmarked or followed by a class"
            who = "Ask the lecturer to end" if new.follow else "End"
            raise unavailable(
                f"The server keeps at most {self._settings.max_stored_sessions} sessions{held}. "
                f"{who} some in My work and try again."
            )
        oldest = min(plain, key=lambda session: session.left)
        log.info("a session gives way to a new one", session=oldest.spec.id)
        await self.end(oldest)

    def _is_held(self, session: Session) -> bool:
        """Return whether a worker, visitor, name, bookmark or class keeps a session from being ended."""
        spec = session.spec
        # A session without a description still waits for its first worker.
        used = session.live or not spec.description or session.visitors or spec.name or spec.bookmarks
        return bool(used or self.is_followed(spec.id))

    async def config(self, spec: SessionSpec) -> WorkerConfig:
        """Return a worker's configuration for the active branch of a spec."""
        recipes = [branch.run.recipe for branch in spec.branches.values()]
        filters = await asyncio.to_thread(self._store.files.filters_of, *recipes)
        recording = await self._recording(spec.upload) if spec.upload else None
        return WorkerConfig(
            session=spec.id,
            run=spec.run.model_copy(update={"recipe": spec.recipe.with_footage(truth=spec.truth)}),
            recording=recording,
            states=str(self._store.files.states_of(spec.id)),
            reserve_bytes=self._settings.reserve_bytes,
            memory_bytes=self._settings.worker_memory_bytes,
            cpu_seconds=self._settings.worker_cpu_seconds,
            limits=limits_of(self._settings),
            max_particles=self._settings.max_particles,
            gives_way=spec.follow is not None,
            filters=filters,
        )

    async def _recording(self, upload: str) -> Recording:
        return await recording_of(self._store, self._settings, self._tasks, upload)

    async def _watch_sessions(self) -> None:
        """Check workers and visitors, and store changes, periodically."""
        last = time.monotonic()
        longest_s = min(LONGEST_CATCH_S, max(2 * ROUND_S, self._settings.hang_seconds / 2))
        for number in itertools.count(1):
            await asyncio.sleep(ROUND_S)
            now = time.monotonic()
            after_gap, last = now - last > longest_s, now
            for session in list(self._sessions.values()):
                session.check(after_gap=after_gap)
                if session.visitors:
                    session.left = now
                # A command may be waiting for a hung worker, which only this round ends.
                elif session.is_unused and now - session.left > self._settings.idle_seconds:
                    message = "Session paused after inactivity. It resumes at the same frame."
                    await self._attempt(session.suspend(message))
            seldom = number % POSITIONS_EVERY == 0
            await self._attempt(self.keep(positions=seldom))
            if seldom:
                await self._attempt(asyncio.to_thread(self._remove_orphans))

    async def _attempt(self, duty: Coroutine[Any, Any, None]) -> None:
        """Do a duty; if it fails, log that and continue with the others."""
        try:
            await duty
        except Exception as error:
            if not is_full(error) and not is_busy(error):
                log.exception("housekeeping failed")
            else:
                self._warnings.warn("changes cannot be stored yet", reason=failure_message(error))

    def _remove_orphans(self) -> None:
        self._store.files.trim_states(self._settings.max_states_bytes)
        self._store.disk_budget.take_ballast()
