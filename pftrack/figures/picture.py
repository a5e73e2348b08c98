"""Figures as pictures: the content of a PNG or SVG file that says what it shows and carries a manifest."""

import io
import json
from collections.abc import Mapping
from typing import Any, Literal, TypeAlias

import matplotlib as mpl
from matplotlib.figure import Figure

__all__ = ["DOTS_PER_INCH", "PictureForm", "encoded"]

PictureForm: TypeAlias = Literal["png", "svg"]

DOTS_PER_INCH = 300
"""As printers ask for."""


def encoded(
    figure: Figure, form: PictureForm, title: str, manifest: Mapping[str, Any], dots_per_inch: int = DOTS_PER_INCH
) -> bytes:
    """Return a figure as the content of a file; the same figure gives the same bytes, and letters in SVG stay letters.

    Args:
        figure: Drawn.
        form: Kind of the file.
        title: What it shows, in one line.
        manifest: JSON values; PNG has them as the text `pftrack`, SVG as its description.
        dots_per_inch: Of a PNG.
    """
    told, data = json.dumps(manifest), io.BytesIO()
    # Without a date, and with names of parts that are no random numbers.
    metadata = {"Title": title, **({"pftrack": told} if form == "png" else {"Description": told, "Date": None})}
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": "pftrack"}):
        figure.savefig(data, format=form, dpi=dots_per_inch, metadata=metadata)
    return data.getvalue()
