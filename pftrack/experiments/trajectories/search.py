"""How the selected track was looked for: the window over the picture, and the costs of all places in their own world.

The surface is the higher the less a place costs. On a lattice there is a peak at every crossing within reach, each
nearly as high as the right one; along a line there is a ridge. That is why a match jumps, and where to.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.drawing import COLOURS, Colour, Links, Mesh, Points, Primitive, Text, WorldDrawing
from pftrack.core.model.world import Viewpoint, World
from pftrack.experiments.shared.sketch import at_height
from pftrack.experiments.trajectories.trackers.corner_parameters import CornerParameters
from pftrack.experiments.trajectories.trackers.corners import Corners
from pftrack.vision.detection.matching import APART_PX, cost_map, cut
from pftrack.vision.likelihoods.template import luma
from pftrack.vision.rendering import heat

__all__ = ["SEARCH_WORLD", "TemplateSearch", "empty_search_world", "in_picture", "search_world"]

SHOWN_PX = 20
"""To so far from the middle costs are shown."""

RADIUS, HEIGHT, FLOOR = 30.0, 14.0, -7.0
PIXEL, PIECE_AT, BESIDE = 0.9, 22.0, 11.0
"""Side of a pixel of a template, how far behind the costs the templates stand, and how far beside the middle."""

MARK = 1.6
NEARLY = 1.5
"""What costs up to this many times the least is nearly as good."""
MOST_PEAKS = 40

SEARCH_WORLD = World(
    "search",
    "Search",
    "px",
    RADIUS,
    up=(0.0, 0.0, 1.0),
    front=(0.0, -1.0, 0.0),
    viewpoints=(
        Viewpoint("3-d", "3-D", -25.0, 42.0),
        Viewpoint("top", "Top", 0.0, 90.0),
        Viewpoint("front", "Front", 0.0, 0.0),
    ),
)


@dataclass(frozen=True, eq=False)
class TemplateSearch:
    """What was looked for in a frame, and what each place cost.

    Attributes:
        template: (b, b) grey levels.
        found: (b, b) grey levels at the match.
        around: (2,) pixel around which it was looked for.
        place: (2,) pixel of the match, or of the last one.
        costs: (n, n) of all places; infinite where there is none.
        reach: To how far it was looked for, px.
    """

    template: NDArray[np.uint8]
    found: NDArray[np.uint8]
    around: NDArray[np.int64]
    place: NDArray[np.int64]
    costs: NDArray[np.float64]
    reach: int

    @classmethod
    def of(
        cls, corners: Corners, image_rgb: NDArray[np.uint8], selected: int, parameters: CornerParameters
    ) -> "TemplateSearch":
        """Look for a corner once more.

        Args:
            corners: After the frame.
            image_rgb: Of the frame, (height, width, 3).
            selected: Number of the corner.
            parameters: In force in the frame.
        """
        grey, template = luma(image_rgb), corners.sought[selected]
        around, place, reach = corners.around[selected], corners.places[selected], parameters.search_reach_px
        x, y = around.tolist()
        costs = cost_map(grey, template, (x, y), reach, parameters.match_cost)
        return cls(template, cut(grey, place[None], len(template))[0], around, place, costs, reach)


def in_picture(sought: TemplateSearch) -> dict[str, Primitive]:
    """Draw the window in which the corner was looked for, the template at its match, and what looks alike."""
    half = len(sought.template) / 2.0
    places = sought.around + _peaks(sought.costs)[1:] - sought.reach
    colours = np.tile(np.array(COLOURS["lost"], np.uint8), (len(places), 1))
    return {
        "window": _square(sought.around, sought.reach + half, COLOURS["observation"], 1.0),
        "template": _square(sought.place, half, COLOURS["prediction"], 2.0),
        "look-alikes": Points(at_height(places.astype(np.float64), 1.7), colours, 3.0, "search"),
    }


def search_world(sought: TemplateSearch) -> WorldDrawing:
    """Draw the costs of all places as a surface, the best and those nearly as good, the template and what was found."""
    reach, costs = sought.reach, sought.costs
    shown = min(reach, SHOWN_PX)
    near = slice(reach - shown, reach + shown + 1)
    drawn: dict[str, Primitive] = {}
    peaks = _peaks(costs)
    if len(peaks):
        heights = _heights(costs)
        drawn["costs"] = _surface(heights[near, near], shown)
        offsets = (peaks - reach) * [1.0, -1.0]
        marks = np.column_stack([offsets, heights[peaks[:, 1], peaks[:, 0]] + 0.4]).astype(np.float32)
        inside = (np.abs(offsets) <= shown).all(axis=1)
        colours = np.tile(np.array(COLOURS["lost"], np.uint8), (len(marks), 1))
        colours[0] = COLOURS["prediction"]
        drawn["peaks"] = Points(marks[inside], colours[inside], MARK, "search")
    pieces = {"looked for": sought.template, "found": sought.found}
    for side, (name, piece) in zip((-1, 1), pieces.items(), strict=True):
        drawn[name] = _piece(piece, side * BESIDE)
        above = np.array([side * BESIDE, PIECE_AT, FLOOR + len(piece) * PIXEL + 2.0], np.float32)
        drawn[f"{name}, name"] = Text(above, name, COLOURS["camera"], "search", "middle")
    return WorldDrawing(SEARCH_WORLD, drawn)


def empty_search_world() -> WorldDrawing:
    """Say that nothing is looked for, as in a table of tracks."""
    text = Text(np.zeros(3, np.float32), "no picture to look in", COLOURS["hidden"], "search", "middle")
    return WorldDrawing(SEARCH_WORLD, {"nothing": text})


def _peaks(costs: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the least cost's place (n, 2), (column, row), and after it those of others that are nearly as good."""
    side = 2 * APART_PX - 1
    lowest = cv2.erode(costs, np.ones((side, side), np.uint8))
    rows, columns = np.nonzero(np.isfinite(costs) & (costs <= lowest) & (costs <= NEARLY * costs.min()))
    order = np.argsort(costs[rows, columns], kind="stable")[:MOST_PEAKS]
    return np.column_stack([columns, rows])[order]


def _heights(costs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return costs as heights, the less the higher; what cannot be is on the floor."""
    finite = costs[np.isfinite(costs)]
    low, high = float(finite.min()), float(finite.max())
    shares = np.where(np.isfinite(costs), (high - costs) / max(high - low, 1e-9), 0.0)
    return np.asarray(FLOOR + HEIGHT * shares)


def _surface(heights: NDArray[np.float64], reach: int) -> Mesh:
    """Draw heights (n, n) as a surface, yellow where it is high."""
    side = len(heights)
    steps = np.arange(-reach, reach + 1, dtype=np.float64)
    across, down = np.meshgrid(steps, -steps)
    vertices = np.stack([across, down, heights], axis=-1).reshape(-1, 3).astype(np.float32)
    numbers = np.arange(side * side).reshape(side, side)
    corners = numbers[:-1, :-1].ravel(), numbers[:-1, 1:].ravel(), numbers[1:, 1:].ravel(), numbers[1:, :-1].ravel()
    colours = heat.viridis((heights.ravel() - FLOOR) / HEIGHT)
    return Mesh(vertices, _two_triangles(corners), colours, 1.0, "search")


def _piece(grey: NDArray[np.uint8], middle: float) -> Mesh:
    """Draw a small picture upright behind the costs, a square for each pixel."""
    size = len(grey)
    rows, columns = (each.ravel() for each in np.indices(grey.shape))
    left, top = middle + (columns - size / 2.0) * PIXEL, FLOOR + (size - rows) * PIXEL
    places = [(left, top), (left + PIXEL, top), (left + PIXEL, top - PIXEL), (left, top - PIXEL)]
    vertices = np.stack([np.stack([x, np.full(x.shape, PIECE_AT), z], axis=-1) for x, z in places], axis=1)
    first = 4 * np.arange(size * size)
    colours = np.repeat(np.repeat(grey.ravel(), 4)[:, None], 3, axis=1)
    faces = _two_triangles((first, first + 1, first + 2, first + 3))
    return Mesh(vertices.reshape(-1, 3).astype(np.float32), faces, colours, 1.0, "search")


def _two_triangles(corners: tuple[NDArray[np.int64], ...]) -> NDArray[np.int32]:
    """Return the triangles of squares, given the numbers of their corners, clockwise."""
    one, two, three, four = corners
    return np.concatenate([np.stack([one, two, three], axis=1), np.stack([one, three, four], axis=1)]).astype(np.int32)


def _square(middle: NDArray[np.int64], half: float, colour: Colour, width: float) -> Links:
    x, y = middle.tolist()
    corners = np.array([[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]])
    ends = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1).reshape(-1, 2)
    return Links(at_height(ends, 1.6).reshape(-1, 2, 3), colour, width, "search")
