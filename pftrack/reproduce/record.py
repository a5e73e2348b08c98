"""A record: the findings of a run in a file, kept as they come, so that a second call goes on with what is left.

The file is JSON: by the name of a result the form in which it was computed, of which revision of pftrack, the hash of
the sources that it depends on, how many pieces of work it was, what they took, and the findings. A result whose
sources have changed is computed again. It is what docs/explanation/reproduction.md is written from.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias

from pftrack.core.files import write_whole
from pftrack.reproduce.finding import Finding

__all__ = ["Entry", "Form", "Record", "read_record"]

Form: TypeAlias = Literal["full", "quick"]


@dataclass(frozen=True, slots=True)
class Entry:
    """A result that was computed.

    Attributes:
        form: All trials of the protocol, or few.
        revision: Of pftrack.
        pieces: How many pieces of work it was; of most studies they are trials, of those of the ball 120 runs each.
        seconds: Processor time of these.
        findings: What came of it.
        sources: SHA-256 of the sources that it depends on (`hash_sources`); empty if that was not kept.
    """

    form: Form
    revision: str
    pieces: int
    seconds: float
    findings: tuple[Finding, ...]
    sources: str = ""


class Record:
    """The results in a file; one that is kept is on disk before the next one begins."""

    def __init__(self, path: Path, revision: str) -> None:
        """Begin a record, or go on with the one in the file.

        Args:
            path: The file; it need not be there.
            revision: What the results are of that are kept from now on.

        Raises:
            ValueError: The file holds something else.
            OSError: It cannot be read.
        """
        self.path, self.revision = path, revision
        self._entries = dict(read_record(path)) if path.exists() else {}

    def has(self, name: str, form: Form, sources: str) -> bool:
        """Return whether a result of these sources is there in this form, or for a quick one the full one of any."""
        entry = self._entries.get(name)
        return entry is not None and (
            (entry.form, entry.sources) == (form, sources) or (entry.form, form) == ("full", "quick")
        )

    def findings(self, name: str) -> list[Finding]:
        """Return the findings of a result that is there."""
        return list(self._entries[name].findings)

    def keep(
        self, name: str, form: Form, findings: Sequence[Finding], *, sources: str, pieces: int, seconds: float
    ) -> None:
        """Write a result into the file."""
        self._entries[name] = Entry(form, self.revision, pieces, round(seconds, 2), tuple(findings), sources)
        text = json.dumps({"results": _plain(self._entries)}, indent=1, ensure_ascii=False, allow_nan=False)
        write_whole(self.path, f"{text}\n".encode())


def read_record(path: Path) -> dict[str, Entry]:
    """Return the results in a file by name.

    Raises:
        ValueError: The file holds something else.
        OSError: It cannot be read.
    """
    try:
        kept: Mapping[str, Mapping[str, Any]] = json.loads(path.read_text(encoding="utf-8"))["results"]
        return {
            name: Entry(**{**entry, "findings": tuple(_finding(one) for one in entry["findings"])})
            for name, entry in kept.items()
        }
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ValueError(f"{path} is no record of reproduced results ({type(error).__name__})") from None


def _plain(entries: Mapping[str, Entry]) -> dict[str, object]:
    return {
        name: {
            "form": entry.form,
            "revision": entry.revision,
            "sources": entry.sources,
            "pieces": entry.pieces,
            "seconds": entry.seconds,
            "findings": [one.as_dict() for one in entry.findings],
        }
        for name, entry in sorted(entries.items())
    }


def _finding(values: Mapping[str, Any]) -> Finding:
    return Finding(**{**values, "ours": float("nan") if values["ours"] is None else values["ours"]})
