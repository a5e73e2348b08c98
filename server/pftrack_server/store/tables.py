"""The rows of the database."""

from typing import Any

from sqlalchemy import JSON, BigInteger, Float, Integer, String, Text
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column

FORM = "form"
"""Key of a JSON column's `info` under which it says which JSON values it holds."""


class Base(DeclarativeBase):
    """Base of all rows, which are listed by when they were created."""

    id: Mapped[str] = mapped_column(String(32), primary_key=True)
    created: Mapped[str] = mapped_column(String(32), index=True)


class UploadRow(Base):
    """A video, GIF or set of pictures that somebody sent and that was decoded once from end to end."""

    __tablename__ = "uploads"

    name: Mapped[str] = mapped_column(String(200))
    kind: Mapped[str] = mapped_column(String(16))
    frames: Mapped[int] = mapped_column(Integer)
    width: Mapped[int] = mapped_column(Integer)
    height: Mapped[int] = mapped_column(Integer)
    frame_rate_hz: Mapped[float] = mapped_column(Float)
    duration_s: Mapped[float] = mapped_column(Float)
    sha256: Mapped[str] = mapped_column(String(64), index=True)
    warnings: Mapped[list[str]] = mapped_column(JSON, info={FORM: list})
    size_bytes: Mapped[int] = mapped_column(BigInteger)


class RunRow(Base):
    """A saved run; its record is a file."""

    __tablename__ = "runs"

    title: Mapped[str] = mapped_column(String(200))
    experiment: Mapped[str] = mapped_column(String(64))
    tracker: Mapped[str] = mapped_column(String(64))
    seed: Mapped[int] = mapped_column(BigInteger)
    frames: Mapped[int] = mapped_column(Integer)
    position: Mapped[int] = mapped_column(Integer)
    computed: Mapped[int] = mapped_column(Integer)
    outcome: Mapped[str] = mapped_column(String(200))
    summary: Mapped[dict[str, Any]] = mapped_column(JSON, info={FORM: dict})
    bookmarks: Mapped[list[dict[str, Any]]] = mapped_column(JSON, info={FORM: list})


class ComparisonRow(Base):
    """A saved comparison: the recipes of its runs, and how they were looked at."""

    __tablename__ = "comparisons"

    title: Mapped[str] = mapped_column(String(200))
    content: Mapped[dict[str, Any]] = mapped_column(JSON, info={FORM: dict})


class SessionRow(Base):
    """A session's spec, kept for as long as the session is not ended."""

    __tablename__ = "sessions"

    spec: Mapped[str] = mapped_column(Text)


class SweepRow(Base):
    """A sweep; its rows are files, complete or not."""

    __tablename__ = "sweeps"

    title: Mapped[str] = mapped_column(String(200))
    experiment: Mapped[str] = mapped_column(String(64))
    plan: Mapped[str] = mapped_column(Text)
    state: Mapped[str] = mapped_column(String(16))
    message: Mapped[str | None] = mapped_column(Text)
    runs: Mapped[int] = mapped_column(BigInteger)
    done: Mapped[int] = mapped_column(BigInteger)
    successes: Mapped[int | None] = mapped_column(BigInteger)
    problems: Mapped[int] = mapped_column(BigInteger)
    seconds: Mapped[float] = mapped_column(Float)


class LectureRow(Base):
    """A lecture, as the text of its file."""

    __tablename__ = "lectures"

    title: Mapped[str] = mapped_column(String(200))
    text: Mapped[str] = mapped_column(Text)
    updated: Mapped[str] = mapped_column(String(32))


class PollRow(Base):
    """What a class was asked, when that was created, and how many gave which answer; who gave it is kept nowhere."""

    __tablename__ = "polls"

    lecture: Mapped[str | None] = mapped_column(String(32), index=True)
    title: Mapped[str] = mapped_column(String(200))
    question: Mapped[str] = mapped_column(Text)
    answers: Mapped[list[str]] = mapped_column(JSON, info={FORM: list})
    counts: Mapped[list[int]] = mapped_column(JSON, info={FORM: list})
    followers: Mapped[int] = mapped_column(Integer)
