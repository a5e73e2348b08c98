"""The style of all figures in print: sizes, letters, colours, frames of panels; and a failing run beside its cure.

Runs, sweeps, reproductions and lessons draw in it, with matplotlib but without pyplot, so that nothing is kept behind.
Lengths are inches, sizes of letters points. matplotlib is loaded by the code that draws: a process that computes needs
none.
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
"""Width of a figure that stands in one column of a journal's page, and in both."""
LETTERS_PT, TEXT_PT, TITLE_PT, HEADING_PT = 8, 9, 10, 11
"""Of numbers and keys, of what is written beside them, of a panel's title, and of what stands above several panels."""

GRID_PT = 0.6

INK = {name: hexadecimal(colour) for name, colour in {**COLOURS, **NEUTRALS}.items()}
"""Colours by what they mean, and greys by use, as on the pages."""
CURVE_COLOURS = tuple(hexadecimal(colour) for colour in CURVES)
"""Of things side by side that have no meaning of their own, such as methods, in their order."""


def new_figure(
    height: float, *, width: float = TWO_COLUMNS_IN, rows: int = 1, columns: int = 1, share: str = ""
) -> "tuple[Figure, list[Axes]]":
    """Return a figure with its panels, row after row.

    Args:
        height: Of the figure.
        width: Of the figure.
        rows: How many panels stand above each other.
        columns: How many stand side by side.
        share: Which axes all panels have in common: "x", "y" or "xy".
    """
    from matplotlib.figure import Figure  # noqa: PLC0415 - see the module

    figure = Figure(figsize=(width, height), layout="constrained")
    panels: Any = figure.subplots(rows, columns, sharex="x" in share, sharey="y" in share, squeeze=False)
    for panel in panels.flat:
        bare(panel)
    return figure, list(panels.flat)


def bare(axes: "Axes", *, grid: str = "both") -> None:
    """Leave of a panel's frame the two sides with numbers, over a faint grid.

    Args:
        axes: Of the panel.
        grid: Lines of which axis: "x", "y" or "both".
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
    """Write above a panel what it shows."""
    panel.set_title(text, fontsize=TITLE_PT)


def write_heading(figure: "Figure", text: str) -> None:
    """Write above all panels of a figure what they show."""
    figure.suptitle(text, fontsize=HEADING_PT)


def draw_scale(
    figure: "Figure", panels: "Sequence[Axes]", colours: "Colormap", ends: tuple[float, float], text: str
) -> None:
    """Draw beside panels which amounts their colours stand for, from the lowest to the highest."""
    from matplotlib.cm import ScalarMappable  # noqa: PLC0415 - see the module
    from matplotlib.colors import Normalize  # noqa: PLC0415

    figure.colorbar(ScalarMappable(Normalize(*ends), colours), ax=list(panels), label=text)


def explain_below(figure: "Figure", panel: "Axes", columns: int) -> None:
    """Write below a figure what the lines of a panel are, which stand for those of all."""
    handles, names = panel.get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=columns, frameon=False, fontsize=LETTERS_PT)


def viridis(*, is_reversed: bool = False) -> "Colormap":
    """Return the map of amounts, on which more is brighter, or darker if it is reversed."""
    import matplotlib as mpl  # noqa: PLC0415 - see the module

    return mpl.colormaps["viridis_r" if is_reversed else "viridis"]


def diverging() -> "Colormap":
    """Return the map of differences, from the second ahead to the first ahead, with a neutral middle."""
    from matplotlib.colors import LinearSegmentedColormap  # noqa: PLC0415 - see the module

    return LinearSegmentedColormap.from_list("first-second", [hexadecimal(stop.light) for stop in DIVERGING])


HIGH_IN = 2.4


def draw_failure(
    failing: Sequence[float | None], cured: Sequence[float | None], *, title: str, unit: str, frame: int
) -> "Figure":
    """Draw both errors in one column of a journal's page.

    Args:
        failing: Error of each frame of the run that fails; None where it is not known.
        cured: Of the other one.
        title: What fails.
        unit: Of the errors.
        frame: The one before it happens; it is marked.
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


# Figures as pictures: the content of a PNG, SVG or PDF file that says what it shows and carries a manifest.

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
) -> bytes:
    """Return a figure as the content of a file; the same figure gives the same bytes, and letters in SVG stay letters.

    Args:
        figure: Drawn.
        form: Kind of the file.
        title: What it shows, in one line.
        manifest: JSON values; PNG has them as the text `pftrack`, SVG as its description, PDF as its subject.
        dots_per_inch: Of a PNG.
    """
    import matplotlib as mpl  # noqa: PLC0415 - see `style`

    told, data = json.dumps(dict(manifest)) if manifest else "", io.BytesIO()
    # Without a date, and with names of parts that are no random numbers.
    metadata: dict[PictureForm, dict[str, str | None]] = {
        "png": {"Title": title, **({"pftrack": told} if told else {})},
        "svg": {"Title": title, "Date": None} | ({"Description": told} if told else {}),
        "pdf": {"Title": title, "CreationDate": None} | ({"Subject": told} if told else {}),
    }
    with mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": "pftrack"}):
        figure.savefig(data, format=form, dpi=dots_per_inch, metadata=metadata[form])
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
