"""The file of a lecture: read as hostile as a lecturer's lesson is, and written so that a person can go on in it.

---
title: From Bayes to particles
items:
- lesson: bayes
  minutes: 8
- poll: Will it survive the pillar?
  answers: [Yes, No]
---
Notes.
"""

from functools import lru_cache
from typing import Any, Final, NamedTuple

import yaml

from pftrack.core.refusal import RefusedError
from pftrack.teaching.lessons.document import EXPONENT, DocumentError, ask, decode, document_of
from pftrack_server.teaching.messages import LectureItem, LectureUpdate

LARGEST_BYTES: Final = 128 * 1024
"""Items may hold whole recipes; a lecture of lessons has a hundredth of it."""
KEPT: Final = 64
"""Files whose content is kept as it was read: a long one takes a second, and a list of lectures reads them all."""
MOST_TOLD: Final = 5
FENCE: Final = "---"
WIDTH: Final = 100


class LectureText(NamedTuple):
    """What a file says.

    Attributes:
        lecture: All of it.
        lines: Of each item, from 1.
    """

    lecture: LectureUpdate
    lines: tuple[int, ...]


@lru_cache(KEPT)
def read(data: bytes) -> LectureText:
    """Return what a file says.

    Raises:
        RefusedError: It is too large, no text, or no lecture; the sentence names the lines.
    """
    if len(data) > LARGEST_BYTES:
        raise RefusedError(f"The file is larger than {LARGEST_BYTES // 1024} KiB, which no lecture needs.")
    try:
        document = document_of(decode(data))
    except DocumentError as error:
        raise _refusal([error]) from None
    head = ask(document, LectureUpdate, "a lecture", "docs/how-to/lectures.md")
    if isinstance(head, list):
        raise _refusal(head)
    lines = tuple(document.line(("items", place)) for place in range(len(head.items)))
    whole = {**dict(head), "notes": document.text or head.notes}
    if len(document.text) > _longest_notes():
        message = f"the text has more than the {_longest_notes():,} characters that notes may have"
        raise _refusal([DocumentError(document.text_line, message)])
    return LectureText(LectureUpdate.model_construct(**whole), lines)


def write(lecture: LectureUpdate) -> str:
    """Return the text of a lecture's file.

    Raises:
        RefusedError: It is too large.
    """
    head = {"title": lecture.title, "items": [_values(item) for item in lecture.items]}
    listed = yaml.dump(head, Dumper=_Writer, sort_keys=False, allow_unicode=True, width=WIDTH)
    text = f"{FENCE}\n{listed}{FENCE}\n" + (f"{lecture.notes.strip()}\n" if lecture.notes.strip() else "")
    if len(text.encode()) > LARGEST_BYTES:
        raise RefusedError(f"The lecture would have more than {LARGEST_BYTES // 1024} KiB; leave an item out.")
    return text


class _Writer(yaml.SafeDumper):  # type: ignore[misc]  # PyYAML has no types
    """Writes what is read as the same, in which a number may have an exponent without a point."""

    def represent_str(self, data: str) -> yaml.ScalarNode:
        """Put a text into quotes that would be read as a number."""
        style = "'" if EXPONENT.fullmatch(data) else None
        return self.represent_scalar("tag:yaml.org,2002:str", data, style)


_Writer.add_representer(str, _Writer.represent_str)


def _values(item: LectureItem) -> dict[str, Any]:
    return item.model_dump(mode="json", exclude_defaults=True)


def _longest_notes() -> int:
    [longest] = [each.max_length for each in LectureUpdate.model_fields["notes"].metadata]
    return int(longest)


def _refusal(errors: list[DocumentError]) -> RefusedError:
    told = [f"line {error.line}: {error.message}" if error.line else error.message for error in errors[:MOST_TOLD]]
    more = f"; and {len(errors) - MOST_TOLD} more" if len(errors) > MOST_TOLD else ""
    sentence = "; ".join(told)
    return RefusedError(f"{sentence[:1].upper()}{sentence[1:]}{more}.", field="file")
