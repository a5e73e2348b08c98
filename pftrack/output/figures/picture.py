"""Figures as pictures: the content of a PNG, SVG or PDF file that says what it shows and carries a manifest."""

import io
import json
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

if TYPE_CHECKING:
    from matplotlib.figure import Figure


PictureForm: TypeAlias = Literal["png", "svg", "pdf"]

SUFFIXES: Mapping[str, PictureForm] = MappingProxyType({".png": "png", ".svg": "svg", ".pdf": "pdf"})
"""Of the files that can be made of a figure."""

DOTS_PER_INCH = 300
"""As printers ask for."""
SCREEN_DOTS_PER_INCH = 160
"""Enough for a page or a notebook."""


def encode(
    figure: "Figure",
    form: PictureForm,
    title: str,
    manifest: Mapping[str, Any] = MappingProxyType({}),
    dots_per_inch: int = DOTS_PER_INCH,
    *,
    salt: str = "pftrack",
    transparent: bool = False,
) -> bytes:
    """Return a figure as the content of a file; the same figure gives the same bytes, and letters in SVG stay letters.

    Args:
        figure: Drawn.
        form: Kind of the file.
        title: What it shows, in one line.
        manifest: JSON values; PNG has them as the text `pftrack`, SVG as its description, PDF as its subject.
        dots_per_inch: Of a PNG.
        salt: From which the names of parts of an SVG are made; two in one page need different ones.
        transparent: Whether the page behind is seen through it.
    """
    import matplotlib as mpl  # noqa: PLC0415 - see `style`

    told, data = json.dumps(dict(manifest)) if manifest else "", io.BytesIO()
    # Without a date, and with names of parts that are no random numbers.
    metadata: dict[PictureForm, dict[str, str | None]] = {
        "png": {"Title": title, **({"pftrack": told} if told else {})},
        "svg": {"Title": title, "Date": None} | ({"Description": told} if told else {}),
        "pdf": {"Title": title, "CreationDate": None} | ({"Subject": told} if told else {}),
    }
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": salt}):
        figure.savefig(data, format=form, dpi=dots_per_inch, metadata=metadata[form], transparent=transparent)
    return data.getvalue()


def encode_as(figure: "Figure", suffix: str, title: str) -> bytes:
    """Return a figure as the content of a file for a screen, the same bytes whenever it is drawn.

    Args:
        figure: Drawn.
        suffix: One of `SUFFIXES`.
        title: What it shows, in one line.

    Raises:
        ValueError: The suffix is none of them.
    """
    if suffix not in SUFFIXES:
        raise ValueError(f"a figure is written as {', '.join(SUFFIXES)}, got {suffix!r}")
    return encode(figure, SUFFIXES[suffix], title, dots_per_inch=SCREEN_DOTS_PER_INCH)


def save(figure: "Figure", path: Path, title: str) -> None:
    """Write a figure as a PNG for a screen.

    Raises:
        OSError: The file cannot be written.
    """
    path.write_bytes(encode(figure, "png", title, dots_per_inch=SCREEN_DOTS_PER_INCH))
