"""Which form of results a file has, told by its beginning."""

from pftrack.sources.limits import HEAD_BYTES
from pftrack.sources.results.numbers import form_of_lines
from pftrack.sources.results.spreadsheet import columns_in, header_of
from pftrack.sources.results.table import Form
from pftrack.sources.text import decode

__all__ = ["form_of"]


def form_of(data: bytes) -> Form | None:
    """Return the form of a file by its beginning; None if it is none of results."""
    text = decode(data[:HEAD_BYTES]).lstrip()
    if not text.isprintable() and any(ord(letter) < 32 and not letter.isspace() for letter in text):
        return None  # no text
    if text.startswith("<"):
        return "cvat" if "<annotations" in text else None
    if text.startswith(("{", "[")):
        return (
            "coco" if any(f'"{name}"' in text for name in ("images", "annotations", "bbox", "info", "videos")) else None
        )
    lines = text.splitlines()
    # The last line of a beginning may be cut short.
    whole = lines[:-1] if len(data) >= HEAD_BYTES and len(lines) > 1 else lines
    if (found := form_of_lines(whole)) is not None:
        return found
    return "csv" if lines and columns_in(header_of(text)) is not None else None
