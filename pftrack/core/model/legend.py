"""The legend of a drawing: what its colours mean, of the layers and colours that it really has.

An experiment declares keys for all that any of its trackers may draw. A Kalman filter draws no particles, and a filter
without observation proposals none in that colour; so keys are looked up among what was drawn.
"""

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.drawing import Drawing, Primitive
from pftrack.core.model.layer import Key, Layer
from pftrack.core.model.palette import COLOURS

__all__ = ["drawn_keys"]

EXTENTS = ("positions", "segments", "centres", "vertices")
"""Fields of primitives that hold as many places as there are to draw."""


def drawn_keys(drawing: Drawing, layers: Iterable[Layer]) -> tuple[tuple[str, Key], ...]:
    """Return the keys of a legend that a drawing needs, each with the name of its layer.

    Args:
        drawing: What is to be seen.
        layers: As its experiment declares them. A layer that shows something, but in none of its keys' colours, as with
            shades of them, needs all its keys.
    """
    items = [*drawing.primitives.values(), *(item for world in drawing.worlds for item in world.primitives.values())]
    return tuple((layer.name, key) for layer in layers if layer.legend for key in _keys(layer, items))


def _keys(layer: Layer, items: Iterable[Primitive]) -> tuple[Key, ...]:
    drawn = [colours for item in items if item.layer == layer.name for colours in _colours(item)]
    found = tuple(key for key in layer.legend if any(_has(colours, COLOURS[key.colour]) for colours in drawn))
    return found or (layer.legend if drawn else ())


def _colours(item: Primitive) -> Iterator[NDArray[np.uint8]]:
    """Yield the colours (n, 3) RGB of a primitive, if anything of it is seen."""
    if any(len(getattr(item, name, "?")) == 0 for name in EXTENTS):
        return
    colours = getattr(item, "colours", getattr(item, "colour", None))
    if colours is not None:
        yield np.atleast_2d(np.asarray(colours, dtype=np.uint8))


def _has(colours: NDArray[np.uint8], colour: tuple[int, int, int]) -> bool:
    return bool((colours == np.array(colour, dtype=np.uint8)).all(axis=1).any())
