"""Exports: files that an experiment offers of a frame and of those before it, declared as data.

A run is saved, and its series come as columns, without anybody's help. What a belief has beyond that and is worth
taking to another program, such as the model of a head, its experiment declares; commands and pages list what there is.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeAlias, TypeVar

from pftrack.core.model.diagnostics import Diagnostics

__all__ = ["Export", "ExportError", "Exported", "Make", "find_export"]

Make: TypeAlias = Callable[[Any, Sequence[Diagnostics]], bytes]
"""(the tracker's state, the rows of all frames from 0 to this one) -> the file; an `ExportError` says why not."""


class ExportError(ValueError):
    """No such file can be made of these frames; the sentence says why."""


@dataclass(frozen=True, slots=True)
class Export:
    """A file that can be made of a frame.

    Attributes:
        name: Name in commands and addresses.
        title: What it is, a few words.
        suffix: Of the file's name, without the dot; no other export of the experiment has it.
        media_type: Of the file.
        make: What makes it.
    """

    name: str
    title: str
    suffix: str
    media_type: str
    make: Make


@dataclass(frozen=True, slots=True)
class Exported:
    """What came of an export.

    Attributes:
        files: The file, and that of its manifest where it has one of its own.
        frames: How much of the run they hold, in words.
        complete: Whether that is all of it.
    """

    files: tuple[Path, ...]
    frames: str
    complete: bool


class Named(Protocol):
    """What has the name and the suffix of an export."""

    @property
    def name(self) -> str:
        """Name in commands and addresses."""

    @property
    def suffix(self) -> str:
        """Of the file's name, without the dot."""


N = TypeVar("N", bound=Named)


def find_export(exports: Iterable[N], name: str) -> N:
    """Return the export of a name, or with a suffix.

    Raises:
        LookupError: There is none.
    """
    offered = tuple(exports)
    found = [one for one in offered if name in {one.name, one.suffix}]
    if not found:
        known = ", ".join(one.name for one in offered) or "none"
        raise LookupError(f"there is no export {name!r}; there are {known}")
    return found[0]
