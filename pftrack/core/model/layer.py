"""Layers of a drawing, declared as data: what can be switched on and off, and what its colours mean.

An experiment lists its layers in the order in which they are shown, as it lists its plots. Each primitive of its
drawings names one of them. Whoever shows drawings, a viewer or a film, needs to know the roles below and nothing of the
experiment.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from pftrack.core.model.palette import COLOURS

__all__ = ["Key", "Layer", "LayerRole", "legend", "sort_keys"]

LayerRole: TypeAlias = Literal["", "through time", "flat only"]


@dataclass(frozen=True, slots=True)
class Key:
    """An entry of the legend.

    Attributes:
        colour: Name of a colour in `pftrack.core.model.palette.COLOURS`.
        meaning: What it stands for, a few words.

    Raises:
        ValueError: There is no such colour.
    """

    colour: str
    meaning: str

    def __post_init__(self) -> None:
        """Refuse a colour that has no meaning."""
        if self.colour not in COLOURS:
            raise ValueError(f"there is no colour {self.colour!r}; there are {', '.join(COLOURS)}")


@dataclass(frozen=True, slots=True)
class Layer:
    """What can be switched on and off in a drawing.

    A layer "through time" has the frames of the run as its third direction, which is worth seeing from aside only;
    there it takes the place of layers that are "flat only". A viewer without depth shows the latter.

    Attributes:
        name: What primitives call it.
        title: What it is called on the screen; its name with a capital letter by default.
        shown: Whether it is at first.
        legend: What colours mean on it, where that is not plain.
        role: What a viewer with depth may do with it.
    """

    name: str
    title: str = ""
    shown: bool = True
    legend: tuple[Key, ...] = ()
    role: LayerRole = ""

    def __post_init__(self) -> None:
        """Make a title from the name."""
        if not self.title:
            object.__setattr__(self, "title", self.name[:1].upper() + self.name[1:])


def legend(layers: Iterable[Layer]) -> tuple[Key, ...]:
    """Return what the colours of some layers mean, each meaning once, in the palette's order."""
    return sort_keys(key for layer in layers for key in layer.legend)


def sort_keys(keys: Iterable[Key]) -> tuple[Key, ...]:
    """Return keys, each once, in the palette's order."""
    return tuple(sorted(dict.fromkeys(keys), key=lambda key: list(COLOURS).index(key.colour)))
