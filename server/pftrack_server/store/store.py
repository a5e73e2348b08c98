"""The store: everything that is asked of database and data directory.

All methods block, for a few milliseconds; the web process calls them in threads.
"""

import sqlite3
from collections.abc import Iterable, Sequence
from typing import Any, TypeVar

import structlog
from sqlalchemy import CursorResult, delete, func, inspect, select, text, update
from sqlalchemy.exc import DataError, DBAPIError
from sqlalchemy.orm import sessionmaker
from sqlalchemy.sql.expression import SQLColumnExpression

from pftrack.core.files import write_whole
from pftrack_server.errors import DamagedError
from pftrack_server.settings import Settings
from pftrack_server.store.database import connect
from pftrack_server.store.disk_budget import DiskBudget
from pftrack_server.store.files import DataDirectory, now
from pftrack_server.store.tables import (
    FORM,
    Base,
    ComparisonRow,
    LectureRow,
    PollRow,
    RunRow,
    SessionRow,
    SweepRow,
    UploadRow,
)

log = structlog.get_logger(__name__)

Row = TypeVar("Row", UploadRow, RunRow, ComparisonRow, SessionRow, SweepRow, LectureRow, PollRow)
# What reading a row may raise whose content is not of its column's type; see `_is_damage`.
DAMAGED = (ValueError, TypeError, DBAPIError)


class Store:
    """Uploads, runs, comparisons, sessions, sweeps, lectures and polls, kept.

    Attributes:
        files: The data directory.
        room: On its disk.
    """

    def __init__(self, settings: Settings) -> None:
        self.files = DataDirectory(settings.data_dir)
        try:
            self.disk_budget = DiskBudget(settings.data_dir, settings.reserve_bytes)
            self._engine = connect(settings.database)
        except BaseException:
            self.files.close()
            raise
        self._begin = sessionmaker(self._engine, expire_on_commit=False)
        self._complained: set[str] = set()
        self.disk_budget.take_ballast()

    def close(self) -> None:
        """Close database and data directory."""
        self._engine.dispose()
        self.files.close()

    def check(self) -> None:
        """Make sure that the data directory can be written and the database answers."""
        self.disk_budget.check_folder()
        with self._begin() as database:
            database.execute(text("SELECT 1"))

    # ------------------------------------------------------------ uploads

    def add_upload(self, row: UploadRow) -> None:
        """Keep an upload whose files are in place."""
        self._add(row)

    def uploads_bytes(self) -> int:
        """Return how large all uploads are together."""
        with self._begin() as database:
            return database.scalar(select(func.sum(UploadRow.size_bytes))) or 0

    def uploads(self) -> list[UploadRow]:
        """Return all uploads, the newest first."""
        return self._all(UploadRow, UploadRow.created.desc())

    def upload(self, name: str) -> UploadRow | None:
        """Return an upload.

        Raises:
            DamagedError: Its row cannot be read.
        """
        return self._get(UploadRow, name)

    def remove_upload(self, name: str) -> bool:
        """Forget an upload, if there is one: its row first, so that a crash leaves no row without a file."""
        found = self._remove(UploadRow, name)
        if found:
            self.files.remove_upload(name)
        return found

    def upload_of(self, sha256: str) -> UploadRow | None:
        """Return the newest upload with this content."""
        newest = select(UploadRow).where(UploadRow.sha256 == sha256).order_by(UploadRow.created.desc()).limit(1)
        with self._begin() as database:
            return database.scalars(newest).first()

    # ------------------------------------------------------------ runs

    def add_run(self, row: RunRow, thumbnail: bytes) -> None:
        """Keep a run whose record is in place and on the disk."""
        try:
            write_whole(self.files.thumbnail(row.id), thumbnail)
            self._add(row)
        except BaseException:
            self.files.remove_run(row.id)
            raise

    def runs(self) -> list[RunRow]:
        """Return all runs, the newest first."""
        return self._all(RunRow, RunRow.created.desc())

    def run(self, name: str) -> RunRow | None:
        """Return a run.

        Raises:
            DamagedError: Its row cannot be read.
        """
        return self._get(RunRow, name)

    def rename_run(self, name: str, title: str) -> None:
        """Give a run another title, if there is one."""
        self._rename(RunRow, name, title)

    def remove_run(self, name: str) -> bool:
        """Forget a run, if there is one: its row first, so that a crash leaves no row without a file."""
        found = self._remove(RunRow, name)
        if found:
            self.files.remove_run(name)
        return found

    # ------------------------------------------------------------ comparisons

    def add_comparison(self, row: ComparisonRow) -> None:
        """Keep a comparison."""
        self.disk_budget.check()
        self._add(row)

    def comparisons(self) -> list[ComparisonRow]:
        """Return all comparisons, the newest first."""
        return self._all(ComparisonRow, ComparisonRow.created.desc())

    def comparison(self, name: str) -> ComparisonRow | None:
        """Return a comparison.

        Raises:
            DamagedError: Its row cannot be read.
        """
        return self._get(ComparisonRow, name)

    def rename_comparison(self, name: str, title: str) -> None:
        """Give a comparison another title, if there is one."""
        self._rename(ComparisonRow, name, title)

    def remove_comparison(self, name: str) -> bool:
        """Forget a comparison, if there is one."""
        return self._remove(ComparisonRow, name)

    # ------------------------------------------------------------ sessions

    def save_sessions(self, specs: Iterable[tuple[str, str]]) -> None:
        """Keep sessions as (name, spec as JSON), all or none."""
        self._merge([SessionRow(id=name, spec=spec, updated=now()) for name, spec in specs])

    def sessions(self) -> list[SessionRow]:
        """Return all sessions, the oldest first."""
        return self._all(SessionRow, SessionRow.updated)

    def remove_session(self, name: str) -> bool:
        """Forget a session, if there is one."""
        return self._remove(SessionRow, name)

    # ------------------------------------------------------------ sweeps

    def save_sweep(self, values: dict[str, Any]) -> None:
        """Keep a sweep, given by its columns, or what has changed of it."""
        self._merge([SweepRow(**values)])

    def sweeps(self) -> list[SweepRow]:
        """Return all sweeps, the oldest first."""
        return self._all(SweepRow, SweepRow.created)

    def remove_sweep(self, name: str) -> bool:
        """Forget a sweep, if there is one: its row first, so that a crash leaves no row without a file."""
        found = self._remove(SweepRow, name)
        if found:
            self.files.remove_sweep(name)
        return found

    # ------------------------------------------------------------ lectures and polls

    def save_lecture(self, row: LectureRow) -> None:
        """Keep a lecture, in place of what it was before."""
        self._merge([row])

    def lectures(self) -> list[LectureRow]:
        """Return all lectures, the newest first."""
        return self._all(LectureRow, LectureRow.created.desc())

    def lecture(self, name: str) -> LectureRow | None:
        """Return a lecture.

        Raises:
            DamagedError: Its row cannot be read.
        """
        return self._get(LectureRow, name)

    def remove_lecture(self, name: str) -> bool:
        """Forget a lecture, if there is one; what was answered in it stays."""
        return self._remove(LectureRow, name)

    def save_polls(self, rows: Iterable[PollRow]) -> None:
        """Keep polls, in place of what was known of them before, all or none."""
        self._merge(list(rows))

    def polls(self) -> list[PollRow]:
        """Return all polls, the newest first."""
        return self._all(PollRow, PollRow.asked.desc())

    def poll(self, name: str) -> PollRow | None:
        """Return a poll.

        Raises:
            DamagedError: Its row cannot be read.
        """
        return self._get(PollRow, name)

    def remove_poll(self, name: str) -> bool:
        """Forget a poll, if there is one."""
        return self._remove(PollRow, name)

    # ------------------------------------------------------------ rows

    def count(self, kind: type[Base]) -> int:
        """Return how many rows of a kind there are."""
        with self._begin() as database:
            return database.scalar(select(func.count()).select_from(kind)) or 0

    def _add(self, row: Base) -> None:
        with self._begin.begin() as database:
            database.add(row)

    def _merge(self, rows: Sequence[Base]) -> None:
        """Keep rows, new ones and those that have changed, all or none."""

        def save() -> None:
            with self._begin.begin() as database:
                for row in rows:
                    database.merge(row)

        self.disk_budget.write(save)

    def _get(self, kind: type[Row], name: str) -> Row | None:
        try:
            with self._begin() as database:
                row = database.get(kind, name)
                return None if row is None else _sound(row)
        except DAMAGED as error:
            if not _is_damage(error):
                raise
            self._complain(kind, name, error)
            raise DamagedError("The stored data of this item is damaged; it can only be deleted.") from None

    def _all(self, kind: type[Row], place: SQLColumnExpression[Any]) -> list[Row]:
        """Return all rows of a kind that can be read, in order."""
        query = select(kind).order_by(place)
        try:
            with self._begin() as database:
                return [_sound(row) for row in database.scalars(query)]
        except DAMAGED as error:
            if not _is_damage(error):
                raise
            with self._begin() as database:
                names = list(database.scalars(select(kind.id).order_by(place)))
            return [row for row in (self._readable(kind, name) for name in names) if row is not None]

    def _readable(self, kind: type[Row], name: str) -> Row | None:
        try:
            return self._get(kind, name)
        except DamagedError:
            return None

    def _complain(self, kind: type[Row], name: str, error: Exception) -> None:
        """Tell the log once of a row that cannot be read."""
        if name not in self._complained:
            self._complained.add(name)
            log.warning("a stored row is damaged and left out", table=kind.__tablename__, id=name, error=str(error))

    def _rename(self, kind: type[RunRow | ComparisonRow], name: str, title: str) -> None:
        def save() -> None:
            with self._begin.begin() as database:
                database.execute(update(kind).where(kind.id == name).values(title=title))

        self.disk_budget.write(save)

    def _remove(self, kind: type[Row], name: str) -> bool:
        def remove() -> bool:
            with self._begin.begin() as database:
                done: CursorResult[Any] = database.execute(delete(kind).where(kind.id == name))  # type: ignore[assignment]  # of a deletion it is one
                return done.rowcount > 0

        return self.disk_budget.write(remove)


def _is_damage(error: Exception) -> bool:
    """Tell whether what is stored is to blame for an error, and not a database that is busy, away or without files."""
    if not isinstance(error, DBAPIError):
        return True
    if isinstance(error.orig, sqlite3.Error):
        # Text that does not decode is refused by Python, which has no code for it.
        code = getattr(error.orig, "sqlite_errorcode", None)
        return code is None or code & 0xFF == sqlite3.SQLITE_CORRUPT
    return isinstance(error, DataError)


def _sound(row: Row) -> Row:
    """Return a row whose values have the types of their columns, which SQLite does not see to.

    Raises:
        TypeError: A value has another type.
    """
    for column in inspect(type(row)).columns:
        value, kind = getattr(row, column.key), column.info.get(FORM, column.type.python_type)
        fits = isinstance(value, (float, int) if kind is float else kind)
        if not fits and not (value is None and column.nullable):
            raise TypeError(f"{column.key} is {value!r}, expected {kind.__name__}")
    return row
