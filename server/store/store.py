"""The store: everything that is asked of database and data directory.

All methods block, for a few milliseconds; the web process calls them in threads.
"""

from collections.abc import Iterable
from typing import Any, TypeVar

from sqlalchemy import delete, func, select, text
from sqlalchemy.orm import sessionmaker

from pftrack.files import write_whole
from server.settings import Settings
from server.store.database import connect
from server.store.files import DataDirectory, now
from server.store.room import Room
from server.store.tables import Base, RunRow, SessionRow, SweepRow, UploadRow

__all__ = ["Store"]

Row = TypeVar("Row", bound=Base)


class Store:
    """Uploads, runs, sessions and sweeps, kept.

    Attributes:
        files: The data directory.
        room: On its disk.
    """

    def __init__(self, settings: Settings) -> None:
        self.files = DataDirectory(settings.data_dir)
        try:
            self.room = Room(settings.data_dir, settings.reserve_bytes)
            self._engine = connect(settings.database)
        except BaseException:
            self.files.close()
            raise
        self._begin = sessionmaker(self._engine, expire_on_commit=False)
        self.room.take_ballast()

    def close(self) -> None:
        """Close database and data directory."""
        self._engine.dispose()
        self.files.close()

    def check(self) -> None:
        """Make sure that the database answers."""
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
        with self._begin() as database:
            return list(database.scalars(select(UploadRow).order_by(UploadRow.created.desc())))

    def upload(self, name: str) -> UploadRow | None:
        """Return an upload."""
        return self._get(UploadRow, name)

    def remove_upload(self, name: str) -> None:
        """Forget an upload: its row first, so that a crash leaves no row without a file."""
        self._remove(UploadRow, name)
        self.files.remove_upload(name)

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
        with self._begin() as database:
            return list(database.scalars(select(RunRow).order_by(RunRow.created.desc())))

    def run(self, name: str) -> RunRow | None:
        """Return a run."""
        return self._get(RunRow, name)

    def remove_run(self, name: str) -> None:
        """Forget a run: its row first, so that a crash leaves no row without a file."""
        self._remove(RunRow, name)
        self.files.remove_run(name)

    # ------------------------------------------------------------ sessions

    def save_sessions(self, specs: Iterable[tuple[str, str]]) -> None:
        """Keep sessions as (name, spec as JSON), all or none."""
        rows = [{"id": name, "spec": spec, "updated": now()} for name, spec in specs]

        def save() -> None:
            with self._begin.begin() as database:
                for row in rows:
                    database.merge(SessionRow(**row))

        self.room.write(save)

    def sessions(self) -> list[SessionRow]:
        """Return all sessions, the oldest first."""
        with self._begin() as database:
            return list(database.scalars(select(SessionRow).order_by(SessionRow.updated)))

    def remove_session(self, name: str) -> None:
        """Forget a session."""
        self._remove(SessionRow, name)

    # ------------------------------------------------------------ sweeps

    def save_sweep(self, values: dict[str, Any]) -> None:
        """Keep a sweep, given by its columns, or what has changed of it."""

        def save() -> None:
            with self._begin.begin() as database:
                database.merge(SweepRow(**values))

        self.room.write(save)

    def sweeps(self) -> list[SweepRow]:
        """Return all sweeps, the oldest first."""
        with self._begin() as database:
            return list(database.scalars(select(SweepRow).order_by(SweepRow.created)))

    def remove_sweep(self, name: str) -> None:
        """Forget a sweep: its row first, so that a crash leaves no row without a file."""
        self._remove(SweepRow, name)
        self.files.remove_sweep(name)

    # ------------------------------------------------------------ rows

    def count(self, kind: type[Base]) -> int:
        """Return how many rows of a kind there are."""
        with self._begin() as database:
            return database.scalar(select(func.count()).select_from(kind)) or 0

    def _add(self, row: Base) -> None:
        with self._begin.begin() as database:
            database.add(row)

    def _get(self, kind: type[Row], name: str) -> Row | None:
        with self._begin() as database:
            return database.get(kind, name)

    def _remove(self, kind: type[UploadRow | RunRow | SessionRow | SweepRow], name: str) -> None:
        def remove() -> None:
            with self._begin.begin() as database:
                database.execute(delete(kind).where(kind.id == name))

        self.room.write(remove)
