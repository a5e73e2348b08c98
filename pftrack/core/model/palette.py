"""The palette: every colour that carries a meaning, once, for scenes, films, figures, maps and pages.

All are, or are mixed from, the eight colours of Okabe and Ito (Color Universal Design, 2008), which can be
distinguished without red and green. A colour is sRGB, (red, green, blue) of 0 to 255; `hexadecimal` writes it as CSS,
matplotlib reads it. Where a page has a dark form of a colour, a `Themed` pair holds both. The colours stand in
`palette.yaml` beside this file.
"""

from pathlib import Path
from typing import Annotated, NamedTuple, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

from pftrack.core.texts import read_whole

Level: TypeAlias = Annotated[int, Field(ge=0, le=255)]
Colour: TypeAlias = tuple[Level, Level, Level]


class Themed(NamedTuple):
    """A colour on a light ground, and what stands for it on a dark one."""

    light: Colour
    dark: Colour


class Palette(BaseModel):
    """What `palette.yaml` declares.

    Attributes:
        okabe_ito: The eight colours by their authors' names.
        viridis: Map of amounts in equal steps.
        colours: One colour a meaning, the same in scene, plots, video and maps.
        curves: Of the curves of one figure, in order.
        branches: Of a session's branches, the active one first.
        verdicts: Outcome of a test between two methods.
        diverging: Map of differences in equal steps: second method ahead, neither, first method ahead.
        neutrals: Greys of a figure's furniture, by use.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    okabe_ito: dict[str, Colour]
    viridis: tuple[Colour, ...]
    colours: dict[str, Colour]
    curves: tuple[Colour, ...]
    branches: tuple[Colour, ...]
    verdicts: dict[str, Themed]
    diverging: tuple[Themed, ...]
    neutrals: dict[str, Colour]


_PALETTE = read_whole(Palette, Path(__file__).with_name("palette.yaml"))
OKABE_ITO, VIRIDIS, COLOURS = _PALETTE.okabe_ito, _PALETTE.viridis, _PALETTE.colours
CURVES, BRANCHES, VERDICTS = _PALETTE.curves, _PALETTE.branches, _PALETTE.verdicts
DIVERGING, NEUTRALS = _PALETTE.diverging, _PALETTE.neutrals


def hexadecimal(colour: Colour) -> str:
    """Return a colour as "#rrggbb"."""
    return "#{:02x}{:02x}{:02x}".format(*colour)
