"""The store: all operations on database and data directory.

All methods block for a few milliseconds; the web process calls them in threads.
"""

import sqlite3
from typing import Annotated, Any, TypeVar

import structlog
from sqlalchemy import CursorResult, delete, func, inspect, select, text, update
from sqlalchemy.exc import DataError, DBAPIError
from sqlalchemy.orm import sessionmaker

from pftrack.core.files import write_whole
from pftrack_server.core.errors import ApiError, gone, not_found
from pftrack_server.core.requests import service
from pftrack_server.core.settings import Settings
from pftrack_server.store.database import FORM, Base, ComparisonRow, RunRow, UploadRow, connect
from pftrack_server.store.disk_budget import DiskBudget
from pftrack_server.store.files import DataDirectory, is_name

log = structlog.get_logger(__name__)

Row = TypeVar("Row", bound=Base)
# Errors of reading a row whose content is not of its column's type; see `_is_damage`.
DAMAGED = (ValueError, TypeError, DBAPIError)


class Store:
    """Stores uploads, runs, comparisons, sessions, sweeps, lectures and polls.

    Attributes:
        files: The data directory.
        disk_budget: The free space on its disk.
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
        """Make sure that the data directory is writable and the database answers."""
        self.disk_budget.check_folder()
        with self._begin() as database:
            database.execute(text("SELECT 1"))

    def all(self, kind: type[Row]) -> list[Row]:
        """Return all readable rows of a kind, newest first."""
        query = select(kind).order_by(kind.created.desc())
        try:
            with self._begin() as database:
                return [_sound(row) for row in database.scalars(query)]
        except DAMAGED as error:
            if not _is_damage(error):
                raise
            with self._begin() as database:
                names = list(database.scalars(select(kind.id).order_by(kind.created.desc())))
            return [row for row in (self._readable(kind, name) for name in names) if row is not None]

    def get(self, kind: type[Row], name: str) -> Row | None:
        """Return a row of a kind; None if there is none.

        Raises:
            ApiError: The row cannot be read (410).
        """
        try:
            with self._begin() as database:
                row = database.get(kind, name)
                return None if row is None else _sound(row)
        except DAMAGED as error:
            if not _is_damage(error):
                raise
            if name not in self._complained:
                self._complained.add(name)
                log.warning("a stored row is damaged and left out", table=kind.__tablename__, id=name, error=str(error))
            raise gone("The stored data of this item is damaged; it can only be deleted.") from None

    def find(self, kind: type[Row], name: str) -> Row:
        """Return a row of a kind.

        Raises:
            ApiError: The row does not exist (404) or cannot be read (410).
        """
        found = self.get(kind, name)
        if found is None:
            raise _no_such(kind)
        return found

    def count(self, kind: type[Base]) -> int:
        """Return the number of rows of a kind."""
        with self._begin() as database:
            return database.scalar(select(func.count()).select_from(kind)) or 0

    def add(self, row: Base) -> None:
        """Store a new row, whose files must be in place."""
        with self._begin.begin() as database:
            database.add(row)

    def save(self, *rows: Base) -> None:
        """Store new and changed rows, all or none; columns that are not given stay unchanged."""

        def save() -> None:
            with self._begin.begin() as database:
                for row in rows:
                    database.merge(row)

        self.disk_budget.write(save)

    def rename(self, row: RunRow | ComparisonRow, title: str) -> None:
        """Rename a run or a comparison, if it still exists."""

        def save() -> None:
            with self._begin.begin() as database:
                database.execute(update(type(row)).where(type(row).id == row.id).values(title=title))

        self.disk_budget.write(save)
        row.title = title

    def remove(self, kind: type[Row], name: str) -> bool:
        """Delete a row, if it exists, and its files: the row first, so that a crash leaves no row without a file."""

        def remove() -> bool:
            with self._begin.begin() as database:
                done: CursorResult[Any] = database.execute(delete(kind).where(kind.id == name))  # type: ignore[assignment]  # of a deletion it is one
                return done.rowcount > 0

        found = self.disk_budget.write(remove)
        if found:
            self.files.remove(kind.__tablename__, name)
        return found

    def discard(self, kind: type[Row], name: str) -> None:
        """Delete a row and its files, even an unreadable row.

        Raises:
            ApiError: The row does not exist (404).
        """
        if not is_name(name) or not self.remove(kind, name):
            raise _no_such(kind)

    def add_run(self, row: RunRow, thumbnail: bytes) -> None:
        """Store a run whose record is already on disk."""
        try:
            write_whole(self.files.thumbnail(row.id), thumbnail)
            self.add(row)
        except BaseException:
            self.files.remove(RunRow.__tablename__, row.id)
            raise

    def uploads_bytes(self) -> int:
        """Return the total bytes of all uploads."""
        with self._begin() as database:
            return database.scalar(select(func.sum(UploadRow.size_bytes))) or 0

    def upload_of(self, sha256: str) -> UploadRow | None:
        """Return the newest upload with this content."""
        newest = select(UploadRow).where(UploadRow.sha256 == sha256).order_by(UploadRow.created.desc()).limit(1)
        with self._begin() as database:
            return database.scalars(newest).first()

    def _readable(self, kind: type[Row], name: str) -> Row | None:
        try:
            return self.get(kind, name)
        except ApiError:
            return None


def _no_such(kind: type[Base]) -> ApiError:
    return not_found(f"This {kind.__tablename__.removesuffix('s')} does not exist; it may have been deleted.")


def _is_damage(error: Exception) -> bool:
    """Return whether an error comes from stored content, not from a busy, missing or incomplete database."""
    if not isinstance(error, DBAPIError):
        return True
    if isinstance(error.orig, sqlite3.Error):
        # Python refuses text that does not decode, without an SQLite error code.
        code = getattr(error.orig, "sqlite_errorcode", None)
        return code is None or code & 0xFF == sqlite3.SQLITE_CORRUPT
    return isinstance(error, DataError)


def _sound(row: Row) -> Row:
    """Return a row after checking that its values have the types of their columns; SQLite does not check that.

    Raises:
        TypeError: A value has another type.
    """
    for column in inspect(type(row)).columns:
        value, kind = getattr(row, column.key), column.info.get(FORM, column.type.python_type)
        fits = isinstance(value, (float, int) if kind is float else kind)
        if not fits and not (value is None and column.nullable):
            raise TypeError(f"{column.key} is {value!r}, expected {kind.__name__}")
    return row


AStore = Annotated[Store, service(Store)]
