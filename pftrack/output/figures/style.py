"""The style of all printed figures: sizes, fonts, colours and panel frames; and the figure of a failure and its cure.

Runs, sweeps, reproductions and lessons use it, with matplotlib but without pyplot, which would keep figures alive.
Lengths are in inches, font sizes in points. Only the functions that draw import matplotlib, so that a process that
computes does not need it.
"""

import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from pftrack.core.model.drawing import COLOURS, CURVES, DIVERGING, NEUTRALS, hexadecimal

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure

ONE_COLUMN_IN, TWO_COLUMNS_IN = 3.5, 7.2
"""Width of a figure in one column, and in both columns, of a journal."""
LETTERS_PT, TEXT_PT, TITLE_PT, HEADING_PT = 8, 9, 10, 11
"""Font sizes of numbers and legends, of text, of a panel's title, and of the heading over several panels."""

GRID_PT = 0.6

INK = {name: hexadecimal(colour) for name, colour in {**COLOURS, **NEUTRALS}.items()}
"""Colours by meaning and greys by use, as on the pages."""
CURVE_COLOURS = tuple(hexadecimal(colour) for colour in CURVES)
"""Colours, in order, for items without a colour of their own, such as methods."""


def new_figure(
    height: float, *, width: float = TWO_COLUMNS_IN, rows: int = 1, columns: int = 1, share: str = ""
) -> "tuple[Figure, list[Axes]]":
    """Return a figure with its panels, row after row.

    Args:
        height: Height of the figure.
        width: Width of the figure.
        rows: Number of rows of panels.
        columns: Number of columns of panels.
        share: Axes that all panels share: "x", "y" or "xy".
    """
    from matplotlib.figure import Figure  # noqa: PLC0415 - see the module

    figure = Figure(figsize=(width, height), layout="constrained")
    panels: Any = figure.subplots(rows, columns, sharex="x" in share, sharey="y" in share, squeeze=False)
    for panel in panels.flat:
        bare(panel)
    return figure, list(panels.flat)


def bare(axes: "Axes", *, grid: str = "both") -> None:
    """Keep only the two sides of a panel's frame that have numbers, and draw a faint grid.

    Args:
        axes: Axes of the panel.
        grid: Axis of the grid lines: "x", "y" or "both".
    """
    axes.grid(visible=True, axis=grid, color=INK["grid"], linewidth=GRID_PT)  # type: ignore[arg-type]
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=LETTERS_PT)
    for axis in (axes.xaxis, axes.yaxis):
        axis.label.set_fontsize(TEXT_PT)
    for name, spine in axes.spines.items():
        spine.set_visible(name not in {"top", "right"})
        spine.set_color(INK["frame"])


def write_title(panel: "Axes", text: str) -> None:
    """Write the title of a panel."""
    panel.set_title(text, fontsize=TITLE_PT)


def write_heading(figure: "Figure", text: str) -> None:
    """Write the heading over all panels of a figure."""
    figure.suptitle(text, fontsize=HEADING_PT)


def draw_scale(
    figure: "Figure", panels: "Sequence[Axes]", colours: "Colormap", ends: tuple[float, float], text: str
) -> None:
    """Draw the colour scale of panels next to them, from the lowest to the highest value."""
    from matplotlib.cm import ScalarMappable  # noqa: PLC0415 - see the module
    from matplotlib.colors import Normalize  # noqa: PLC0415

    figure.colorbar(ScalarMappable(Normalize(*ends), colours), ax=list(panels), label=text)


def explain_below(figure: "Figure", panel: "Axes", columns: int) -> None:
    """Draw below a figure the legend of one panel, which is valid for all."""
    handles, names = panel.get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=columns, frameon=False, fontsize=LETTERS_PT)


def viridis(*, is_reversed: bool = False) -> "Colormap":
    """Return the colour map of amounts, brighter for larger ones, or darker if reversed."""
    import matplotlib as mpl  # noqa: PLC0415 - see the module

    return mpl.colormaps["viridis_r" if is_reversed else "viridis"]


def diverging() -> "Colormap":
    """Return the colour map of differences, from "second better" to "first better", with a neutral middle."""
    from matplotlib.colors import LinearSegmentedColormap  # noqa: PLC0415 - see the module

    return LinearSegmentedColormap.from_list("first-second", [hexadecimal(stop.light) for stop in DIVERGING])


HIGH_IN = 2.4


def draw_failure(
    failing: Sequence[float | None], cured: Sequence[float | None], *, title: str, unit: str, frame: int
) -> "Figure":
    """Draw the errors of a failing and a cured run, one journal column wide.

    Args:
        failing: Error of the failing run in each frame; None where unknown.
        cured: Error of the cured run.
        title: Title of the failure.
        unit: Unit of the errors.
        frame: The marked frame, just before the failure.
    """
    figure, (panel,) = new_figure(HIGH_IN, width=ONE_COLUMN_IN)
    panel.axvline(frame, color=INK["frame"], linewidth=0.8, linestyle=":")
    panel.plot(np.array(cured, dtype=float), color=INK["second"], linewidth=1.2, linestyle="--", label="cured")
    panel.plot(np.array(failing, dtype=float), color=INK["lost"], linewidth=1.5, label="fails")
    panel.set_ylim(bottom=0.0)
    panel.set_xlabel("frame")
    panel.set_ylabel(f"error, {unit}" if unit else "error")
    write_title(panel, title)
    explain_below(figure, panel, 2)
    return figure


# Figures as pictures: PNG, SVG or PDF files with a title and a manifest.

PictureForm: TypeAlias = Literal["png", "svg", "pdf"]

SUFFIXES: Mapping[str, PictureForm] = MappingProxyType({".png": "png", ".svg": "svg", ".pdf": "pdf"})
"""File suffixes of pictures, with their formats."""

DOTS_PER_INCH = 300
"""Resolution for print."""
SCREEN_DOTS_PER_INCH = 160
"""Resolution for pages and notebooks."""


def encode(
    figure: "Figure",
    form: PictureForm,
    title: str,
    manifest: Mapping[str, Any] = MappingProxyType({}),
    dots_per_inch: int = DOTS_PER_INCH,
) -> bytes:
    """Return a figure as the content of a file. Equal figures give equal bytes, and text in SVG stays text.

    Args:
        figure: The drawn figure.
        form: Format of the file.
        title: Title in one line.
        manifest: JSON values, stored in PNG as the text `pftrack`, in SVG as its description, in PDF as its subject.
        dots_per_inch: Resolution of a PNG.
    """
    import matplotlib as mpl  # noqa: PLC0415 - see `style`

    told, data = json.dumps(dict(manifest)) if manifest else "", io.BytesIO()
    # Without a date, and with fixed names of parts instead of random ones.
    metadata: dict[PictureForm, dict[str, str | None]] = {
        "png": {"Title": title, **({"pftrack": told} if told else {})},
        "svg": {"Title": title, "Date": None} | ({"Description": told} if told else {}),
        "pdf": {"Title": title, "CreationDate": None} | ({"Subject": told} if told else {}),
    }
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": "pftrack"}):
        figure.savefig(data, format=form, dpi=dots_per_inch, metadata=metadata[form])
    return data.getvalue()


def encode_as(figure: "Figure", suffix: str, title: str) -> bytes:
    """Return a figure as the content of a file for screens; equal figures give equal bytes.

    Args:
        figure: The drawn figure.
        suffix: One of `SUFFIXES`.
        title: Title in one line.

    Raises:
        ValueError: The suffix is unknown.
    """
    if suffix not in SUFFIXES:
        raise ValueError(f"a figure is written as {', '.join(SUFFIXES)}, got {suffix!r}")
    return encode(figure, SUFFIXES[suffix], title, dots_per_inch=SCREEN_DOTS_PER_INCH)


def save(figure: "Figure", path: Path, title: str) -> None:
    """Write a figure as a PNG for screens.

    Raises:
        OSError: The file cannot be written.
    """
    path.write_bytes(encode(figure, "png", title, dots_per_inch=SCREEN_DOTS_PER_INCH))
