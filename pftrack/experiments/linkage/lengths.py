"""What is believed of the three lengths, in a space of their own: what the bounds allow is a cube.

Each hypothesis is a box of the lengths that it has not excluded, and an ellipsoid. The truth is a point; whatever
method runs, the question is whether the point is inside, and how much of the cube is left.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.drawing import COLOURS, Arrows, Ellipsoids, Links, Points, Primitive, Text, WorldDrawing
from pftrack.core.model.world import Viewpoint, World
from pftrack.experiments.linkage.beliefs import SIGMAS, ShownHypothesis, list_hypotheses, particles
from pftrack.experiments.linkage.depth import MOST_SHOWN, pale
from pftrack.experiments.linkage.scene.truth import LinkageTarget
from pftrack.experiments.linkage.shape import LINKS
from pftrack.experiments.linkage.trackers.parameters import LinkageTrackerParameters
from pftrack.experiments.linkage.trackers.state import LinkageState

__all__ = ["LENGTHS_WORLD", "lengths_world"]

RADIUS = 2.4
LENGTHS_WORLD = World(
    "lengths",
    "Lengths",
    "half ranges",
    RADIUS,
    up=(0.0, 0.0, 1.0),
    front=(0.0, -1.0, 0.0),
    viewpoints=(
        Viewpoint("3-d", "3-D", -30.0, 25.0),
        Viewpoint("front", "1, 3", 0.0, 0.0),
        Viewpoint("side", "2, 3", 90.0, 0.0),
        Viewpoint("top", "1, 2", 0.0, 90.0),
    ),
)

DOT, CROSS, LEAST_HALF_PX = 0.13, 0.12, 0.5
NAME_AT = 1.35
CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float64)
EDGES = np.array([[a, b] for a in range(8) for b in range(a + 1, 8) if (a ^ b).bit_count() == 1])


def lengths_world(
    state: LinkageState,
    target: object,
    parameters: LinkageTrackerParameters,
    second: NDArray[np.float64] | None = None,
) -> WorldDrawing:
    """Draw what each hypothesis has left of the allowed lengths, the estimate, the truth, and a second run's."""
    low, high = np.array(parameters.bounds.length_low), np.array(parameters.bounds.length_high)
    middle, half = 0.5 * (low + high), np.maximum(0.5 * (high - low), LEAST_HALF_PX)
    drawn: dict[str, Primitive] = {"cube": Links(_box(-np.ones(3), np.ones(3)), COLOURS["hidden"], 1.0, "axes")}
    drawn["ways"] = Arrows(_ways(), COLOURS["hidden"], 1.5, "axes")
    for link in range(LINKS):
        place = -np.ones(3)
        place[link] = NAME_AT
        text = f"link {link + 1}"
        drawn[f"name {link + 1}"] = Text(place.astype(np.float32), text, COLOURS["camera"], "axes", "middle")
    for number, one in enumerate(list_hypotheses(state)[:MOST_SHOWN]):
        drawn |= _extent(f"{number}", one, middle, half)
    if len(cloud := particles(state)):
        places = (cloud[:, -LINKS:] - middle) / half
        near = places[np.sqrt(np.square(places).sum(axis=1)) < RADIUS].astype(np.float32)
        colours = np.tile(np.array(COLOURS["prediction"], np.uint8), (len(near), 1))
        drawn["particles"] = Points(near, colours, 0.5 * DOT, "particles")
    if isinstance(target, LinkageTarget):
        drawn["truth"] = _dot((target.r - middle) / half, "truth", 1.2 * DOT)
    if second is not None:
        drawn["second"] = Links(_cross((second[-LINKS:] - middle) / half), COLOURS["second"], 2.0, "second run")
    drawn["estimate"] = _dot((state.mean[-LINKS:] - middle) / half, "estimate", DOT)
    return WorldDrawing(LENGTHS_WORLD, drawn)


def _extent(
    name: str, one: ShownHypothesis, middle: NDArray[np.float64], half: NDArray[np.float64]
) -> dict[str, Primitive]:
    """Draw the box and the ellipsoid of a hypothesis, as far as they are near."""
    colour = pale(COLOURS["prediction"], one.weight)
    low, high = ((ends[LINKS:] - middle) / half for ends in (one.low, one.high))
    drawn: dict[str, Primitive] = {}
    if float(np.linalg.norm(np.maximum(np.abs(low), np.abs(high)))) < RADIUS:
        drawn[f"box {name}"] = Links(_box(low, high), colour, 1.0 + one.weight, "guide boxes")
    if one.shape is not None:
        covariance = one.shape[LINKS:, LINKS:] / np.outer(half, half) / SIGMAS**2
        centre = (one.middle[LINKS:] - middle) / half
        reach = np.abs(centre) + SIGMAS * np.sqrt(np.maximum(np.diagonal(covariance), 0.0))
        if float(np.linalg.norm(reach)) < RADIUS:
            drawn[f"ellipsoid {name}"] = Ellipsoids(
                centre[None].astype(np.float32),
                covariance[None].astype(np.float32),
                np.array([colour], np.uint8),
                0.1 + 0.15 * one.weight,
                "ellipsoids",
                SIGMAS,
            )
    return drawn


def _box(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the edges (12, 2, 3) of a box."""
    corners = low + CORNERS * (high - low)
    return np.asarray(corners[EDGES], np.float32)


def _ways() -> NDArray[np.float32]:
    """Return arrows along which the lengths grow, from the corner of the shortest."""
    ends = np.full((LINKS, 2, 3), -1.0)
    ends[np.arange(LINKS), 1, np.arange(LINKS)] = 1.2
    return ends.astype(np.float32)


def _dot(place: NDArray[np.float64], colour: str, size: float) -> Points:
    near = np.array([place] if np.linalg.norm(place) < RADIUS else [], np.float32).reshape(-1, 3)
    return Points(near, np.tile(np.array(COLOURS[colour], np.uint8), (len(near), 1)), size, colour)


def _cross(place: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return three segments (3, 2, 3) that meet at a place; none where it is too far away."""
    arms = np.stack([place - CROSS * np.eye(3), place + CROSS * np.eye(3)], axis=1)
    near = float(np.linalg.norm(place)) + CROSS < RADIUS
    return np.asarray(arms if near else arms[:0], np.float32)
