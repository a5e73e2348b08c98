"""The database: its rows, and one engine; the tables are made at the first start.

If the database cannot be used, one sentence says why and what to do.
"""

import sqlite3
from typing import Any

from sqlalchemy import JSON, Connection, Engine, create_engine, event, inspect, text
from sqlalchemy.exc import DBAPIError
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

from pftrack_server.store.disk_budget import DISK_FULL, is_busy, is_full

FORM = "form"
"""Key in a JSON column's `info` of the types of its values."""

BUSY_S = 2
"""How long to wait for another writer, s; one of ours takes milliseconds."""
APPLICATION = int.from_bytes(b"pftk")
"""Application id in SQLite's header that marks a database as ours."""
VERSION = 1
"""Version of the tables, in the same header; 0 if not all exist."""

UNRELEASED = "alembic_version"
"""A table of databases from before the first release."""

AWAY = "move it away to begin with an empty one, or choose another --data-dir"


class Base(DeclarativeBase):
    """Base of all rows, which are listed by their time of creation."""

    id: Mapped[str] = mapped_column(primary_key=True)
    created: Mapped[str] = mapped_column(index=True)


class UploadRow(Base):
    """An uploaded video, GIF or set of pictures, which was decoded once from end to end."""

    __tablename__ = "uploads"

    name: Mapped[str]
    kind: Mapped[str]
    frames: Mapped[int]
    width: Mapped[int]
    height: Mapped[int]
    frame_rate_hz: Mapped[float]
    duration_s: Mapped[float]
    sha256: Mapped[str] = mapped_column(index=True)
    warnings: Mapped[list[str]] = mapped_column(JSON, info={FORM: list})
    size_bytes: Mapped[int]


class RunRow(Base):
    """A saved run; its record is a file."""

    __tablename__ = "runs"

    title: Mapped[str]
    experiment: Mapped[str]
    tracker: Mapped[str]
    seed: Mapped[int]
    frames: Mapped[int]
    position: Mapped[int]
    computed: Mapped[int]
    outcome: Mapped[str]
    summary: Mapped[dict[str, Any]] = mapped_column(JSON, info={FORM: dict})
    bookmarks: Mapped[list[dict[str, Any]]] = mapped_column(JSON, info={FORM: list})


class ComparisonRow(Base):
    """A saved comparison: the recipes of its runs, and their view."""

    __tablename__ = "comparisons"

    title: Mapped[str]
    content: Mapped[dict[str, Any]] = mapped_column(JSON, info={FORM: dict})


class SessionRow(Base):
    """A session's spec, kept until the session is ended."""

    __tablename__ = "sessions"

    spec: Mapped[str]


class SweepRow(Base):
    """A sweep; its rows are files, complete or not."""

    __tablename__ = "sweeps"

    title: Mapped[str]
    experiment: Mapped[str]
    plan: Mapped[str]
    state: Mapped[str]
    message: Mapped[str | None]
    runs: Mapped[int]
    done: Mapped[int]
    successes: Mapped[int | None]
    problems: Mapped[int]
    seconds: Mapped[float]


class LectureRow(Base):
    """A lecture, as the text of its file."""

    __tablename__ = "lectures"

    title: Mapped[str]
    text: Mapped[str]
    updated: Mapped[str]


class PollRow(Base):
    """A poll's question, time of creation and counts of answers; who gave an answer is not stored."""

    __tablename__ = "polls"

    lecture: Mapped[str | None] = mapped_column(index=True)
    title: Mapped[str]
    question: Mapped[str]
    answers: Mapped[list[str]] = mapped_column(JSON, info={FORM: list})
    counts: Mapped[list[int]] = mapped_column(JSON, info={FORM: list})
    followers: Mapped[int]


def connect(url: str) -> Engine:
    """Open the database, with its tables.

    Raises:
        RuntimeError: The database is damaged, of a newer or unreleased version, of another program, or cannot be
            opened.
    """
    engine = create_engine(url)
    name = f"The database {engine.url.database or url}"
    try:
        _prepare(engine, name)
    except DBAPIError as error:
        engine.dispose()
        raise RuntimeError(f"{name} {_trouble(error)}.") from None
    except BaseException:
        engine.dispose()
        raise
    return engine


def _prepare(engine: Engine, name: str) -> None:
    event.listen(engine, "connect", _pragmas)
    with engine.begin() as connection:
        found = _find_version(connection, name)
        if found == VERSION:
            return
        if found > VERSION:
            raise RuntimeError(
                f"{name} was written by a newer version of pftrack (its tables are {found}, and this version knows "
                f"{VERSION}): update pftrack, or {AWAY}."
            )
        connection.execute(text(f"PRAGMA application_id={APPLICATION}"))
        Base.metadata.create_all(connection)
        connection.execute(text(f"PRAGMA user_version={VERSION}"))


def _find_version(connection: Connection, name: str) -> int:
    """Return the version of a database, 0 if it is empty; refuse one that this program must not touch."""
    found = connection.execute(text("PRAGMA quick_check(1)")).scalar()
    if found != "ok":
        raise RuntimeError(f"{name} is damaged: restore a copy of it, or {AWAY}.")
    if connection.execute(text("PRAGMA application_id")).scalar() == APPLICATION:
        return int(connection.execute(text("PRAGMA user_version")).scalar_one())
    tables = set(inspect(connection).get_table_names())
    if UNRELEASED in tables and tables & set(Base.metadata.tables):
        raise RuntimeError(f"{name} was written by a version of pftrack before the first release: {AWAY}.")
    if tables:
        some = ", ".join(sorted(tables)[:3])
        raise RuntimeError(f"{name} belongs to another program, since it has tables {some}: choose another one.")
    return 0


def _trouble(error: DBAPIError) -> str:
    """Return what is wrong with a database, and what to do."""
    if is_full(error):
        return f"cannot be opened. {DISK_FULL.rstrip('.')}"
    if is_busy(error):
        return "is locked by another program: close that, or choose another --data-dir"
    code = getattr(error.orig, "sqlite_errorcode", 0) & 0xFF
    match code:
        case sqlite3.SQLITE_NOTADB:
            return f"is not a database, or is damaged: restore a copy of it, or {AWAY}"
        case sqlite3.SQLITE_CORRUPT:
            return f"is damaged: restore a copy of it, or {AWAY}"
        case sqlite3.SQLITE_CANTOPEN | sqlite3.SQLITE_PERM | sqlite3.SQLITE_READONLY:
            return "cannot be written by this user: change its owner or rights, or choose another --data-dir"
    reason = str(error.orig).strip().splitlines()[0]
    return f"cannot be used ({reason}): fix that, or choose another --data-dir"


def _pragmas(connection: sqlite3.Connection, _record: Any) -> None:  # noqa: ANN401 - SQLAlchemy's own
    cursor = connection.cursor()
    # First, since each of the others may find another process at work.
    cursor.execute(f"PRAGMA busy_timeout={BUSY_S * 1000}")
    cursor.execute("PRAGMA journal_mode=WAL")
    # A commit survives a power failure.
    cursor.execute("PRAGMA synchronous=FULL")
    cursor.execute("PRAGMA foreign_keys=ON")
    cursor.close()
