"""What is drawn of a look into a frame: the likelihood as heat over the picture, and what is looked at."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.drawing import Arrows, Drawing, Ellipse, Links, Picture, Polyline, Primitive
from pftrack.core.model.likelihood import LikelihoodMap
from pftrack.core.model.palette import COLOURS
from pftrack.vision.rendering.heat import over

__all__ = ["LAYER", "draw_arrows", "draw_likelihood", "draw_place"]

LAYER = "inspected"
"""Of what is looked at; it is no layer of an experiment, and is always shown."""

RING_SHARE = 0.022
"""Radius of the ring around the place, as a share of the picture's width; its cross reaches twice as far."""
SHORTEST_RING_PX = 4.0


def draw_likelihood(drawing: Drawing, found: LikelihoodMap) -> Drawing:
    """Return a drawing whose picture is grey, with a likelihood over it from purple, the lowest, to yellow.

    Its caption says which numbers these are. Where there is no picture, the likelihood lies on white paper.
    """
    items = drawing.primitives
    name = next((name for name, item in items.items() if isinstance(item, Picture)), None)
    if name is None:
        paper = np.full((drawing.height, drawing.width, 3), 255, np.uint8)
        heat = Picture(over(paper, found.levels, width=drawing.width))
        primitives: dict[str, Primitive] = {"likelihood": heat, **items}
    else:
        picture = items[name]
        assert isinstance(picture, Picture)  # noqa: S101 - found as one
        image = picture.image_rgb
        primitives = {**items, name: Picture(over(image, found.levels, width=image.shape[1]), picture.layer)}
    low, high = found.range
    scale = f"log likelihood from {low:.3g}, purple, to {high:.3g}, yellow"
    caption = f"{drawing.caption} · {scale}" if drawing.caption else scale
    return replace(drawing, primitives=primitives, caption=caption)


def draw_arrows(drawing: Drawing, arrows: Sequence[tuple[float, float, float, float]]) -> Drawing:
    """Return a drawing with arrows, x, y, x, y px each, that say which way something pulls."""
    ends = np.asarray(arrows, np.float32).reshape(-1, 2, 2)
    ends = ends[np.isfinite(ends).all(axis=(1, 2))]
    segments = np.concatenate([ends, np.zeros((len(ends), 2, 1), np.float32)], axis=2)
    pulls = Arrows(segments, COLOURS["inspected"], 2.0, LAYER)
    return replace(drawing, primitives={**drawing.primitives, "inspected pulls": pulls})


def draw_place(drawing: Drawing, place: NDArray[np.float64], path: NDArray[np.float64]) -> Drawing:
    """Return a drawing with a ring and a cross around a place, and the way that leads there.

    Args:
        drawing: What is to be seen.
        place: (2,) px.
        path: (A, 2) the place and where it was in the frames before, px; empty without.
    """
    colour = COLOURS["inspected"]
    radius = max(SHORTEST_RING_PX, RING_SHARE * drawing.width)
    u, v = place
    centre = np.array([u, v, 0.0], np.float32)
    ring = Ellipse(centre, radius * np.eye(2, dtype=np.float32), colour, 2.0, LAYER)
    arms = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)]
    cross = np.array([[(u + r * radius * a, v + r * radius * b, 0.0) for r in (1.0, 2.0)] for a, b in arms], np.float32)
    items: dict[str, Primitive] = {"inspected ring": ring, "inspected cross": Links(cross, colour, 2.0, LAYER)}
    if len(path) > 1:
        way = np.column_stack([path, np.zeros(len(path))]).astype(np.float32)
        items["inspected path"] = Polyline(way, colour, 2.0, LAYER)
    return replace(drawing, primitives={**drawing.primitives, **items})
