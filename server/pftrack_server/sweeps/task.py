"""Tasks: what the server has a child process do with a sweep."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

__all__ = ["Measure", "Pictures", "Report", "Resume", "Task"]

Pictures: TypeAlias = Literal["png", "svg", ""]


@dataclass(frozen=True, kw_only=True)
class Measure:
    """Measure how long a plan takes.

    Attributes:
        plan: As JSON values.
        jobs: Processes that would compute it.
        file_bytes: Length of any file that it writes.
    """

    plan: dict[str, Any]
    jobs: int
    file_bytes: int = 0


@dataclass(frozen=True, kw_only=True)
class Resume:
    """Go on with a sweep that was begun.

    Attributes:
        out: Its result file.
        jobs: Processes that compute.
        file_bytes: Length of any file that they write.
    """

    out: Path
    jobs: int
    file_bytes: int


@dataclass(frozen=True, kw_only=True)
class Report:
    """Write the report of a sweep.

    Attributes:
        result: The sweep's result file.
        folder: Where the report goes.
        pictures: What its maps are drawn as, beside those on its page.
        file_bytes: Length of any file of it.
    """

    result: Path
    folder: Path
    pictures: Pictures
    file_bytes: int


Task: TypeAlias = Measure | Resume | Report
