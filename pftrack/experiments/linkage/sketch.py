"""The chain in the picture: where its points and lines were measured, where it is believed to be, and the truth.

A chain in the plane is seen as one line. What is believed of it is drawn below that line and the truth above, so that
neither hides what was seen; in space all is drawn where it is.
"""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.drawing import COLOURS, Colour, Links, Points, Primitive, Text
from pftrack.core.model.frame import Frame
from pftrack.experiments.linkage.beliefs import chain_of, list_hypotheses
from pftrack.experiments.linkage.scene.lines import LinkMeasurements
from pftrack.experiments.linkage.scene.truth import LinkageTarget
from pftrack.experiments.linkage.sets.polygons import Strip, intersect
from pftrack.experiments.linkage.trackers.state import LinkageState
from pftrack.experiments.shared.sketch import at_height, circle

__all__ = ["draw_belief", "draw_measurements", "second_run", "truth"]

ABOVE_PX, BELOW_PX, NEXT_PX = -60.0, 56.0, 14.0
"""Rows from the line of a chain in the plane: of the truth, the estimate, and how far the hypothesis is below that."""

DOT_PX, RING_PX, TICK_PX = 5.0, 6.0, 26.0
FARTHEST = 5.0
"""What is further from the picture's corner than so many of its longer sides is not drawn."""


def draw_measurements(frame: Frame, state: LinkageState) -> dict[str, Primitive]:
    """Draw where points were measured: rings, and across the line of a chain in the plane ticks; and lines of links."""
    if frame.measurements is None:
        return {}
    points = frame.measurements.points_px
    drawn: dict[str, Primitive] = {}
    for number in np.flatnonzero(np.isfinite(points).all(axis=1)).tolist():
        if state.in_space:
            drawn[f"measured {number}"] = circle(points[number], RING_PX, COLOURS["observation"], "measurements")
        else:
            ends = points[number] + np.array([[0.0, -TICK_PX], [0.0, TICK_PX]])
            drawn[f"measured {number}"] = _links(ends[None], COLOURS["observation"], 2.0, "measurements")
    if isinstance(frame.measurements, LinkMeasurements) and frame.image_rgb is not None:
        height, width, _ = frame.image_rgb.shape
        sides: list[Strip] = [(np.array([1.0, 0.0]), 0.0, width - 1.0), (np.array([0.0, 1.0]), 0.0, height - 1.0)]
        for number in np.flatnonzero(np.isfinite(frame.measurements.offsets_px)).tolist():
            normal, offset = frame.measurements.normals[number], float(frame.measurements.offsets_px[number])
            ends = _ends(intersect([*sides, (normal, offset, offset)]), normal)
            if len(ends):
                drawn[f"measured line {number}"] = _links(ends[None], COLOURS["observation"], 1.0, "measurements")
    return drawn


def _ends(corners: NDArray[np.float64], normal: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the two ends (2, 2) of what is left of a line in the picture; none of nothing."""
    along = corners @ np.array([-normal[1], normal[0]])
    return corners[[along.argmin(), along.argmax()]] if len(corners) else corners


def draw_belief(state: LinkageState, number: int, longest: float) -> dict[str, Primitive]:
    """Draw the estimate, and one of the hypotheses.

    Args:
        state: Of the frame.
        number: Of the hypothesis, 1 the most probable.
        longest: Longer side of the picture, px.
    """
    drawn: dict[str, Primitive] = {}
    hypotheses = list_hypotheses(state)
    if len(hypotheses) > 1:
        one = hypotheses[min(number, len(hypotheses)) - 1]
        points = _in_picture(chain_of(one.position, state), state, BELOW_PX + NEXT_PX)
        drawn |= _chain("hypothesis", points, COLOURS["prediction"], 1.5, "hypotheses", longest)
    points = _in_picture(chain_of(state.mean, state), state, BELOW_PX)
    drawn |= _chain("estimate", points, COLOURS["estimate"], 2.5, "estimate", longest)
    if not state.in_space:
        drawn |= _name("estimate name", "believed", state, BELOW_PX, COLOURS["estimate"], "estimate")
    return drawn


def truth(target: LinkageTarget, state: LinkageState, longest: float) -> dict[str, Primitive]:
    """Draw where the chain truly is."""
    if target.landmarks is None:
        return {}
    points = target.landmarks.points_px + np.array([0.0, 0.0 if state.in_space else ABOVE_PX])
    drawn = _chain("true", points, COLOURS["truth"], 1.5, "truth", longest)
    if not state.in_space:
        drawn |= _name("true name", "true", state, ABOVE_PX, COLOURS["truth"], "truth")
    return drawn


def second_run(estimate: NDArray[np.float64], state: LinkageState, longest: float) -> dict[str, Primitive]:
    """Draw where a second run has the chain."""
    points = _in_picture(chain_of(estimate, state), state, BELOW_PX - NEXT_PX)
    drawn = _chain("second", points, COLOURS["second"], 1.5, "second run", longest)
    return {"second links": drawn["second links"]}


def _in_picture(joints: NDArray[np.float64], state: LinkageState, row: float) -> NDArray[np.float64]:
    return np.asarray(joints[:, :2] + state.origin_px + np.array([0.0, 0.0 if state.in_space else row]))


def _chain(
    name: str, points: NDArray[np.float64], colour: Colour, width: float, layer: str, longest: float
) -> dict[str, Primitive]:
    near = np.asarray((np.abs(points) < FARTHEST * longest).all(axis=1))
    ends = np.stack([points[:-1], points[1:]], axis=1)[near[:-1] & near[1:]]
    colours = np.tile(np.array(colour, np.uint8), (int(near.sum()), 1))
    return {
        f"{name} links": _links(ends, colour, width, layer),
        f"{name} joints": Points(at_height(points[near], 2.0), colours, DOT_PX, layer),
    }


def _links(ends: NDArray[np.float64], colour: Colour, width: float, layer: str) -> Links:
    return Links(at_height(ends.reshape(-1, 2), 1.5).reshape(-1, 2, 3), colour, width, layer)


def _name(name: str, text: str, state: LinkageState, row: float, colour: Colour, layer: str) -> dict[str, Primitive]:
    place = at_height(np.array([[10.0, state.origin_px[1] + row + 4.0]]), 2.0)[0]
    return {name: Text(place, text, colour, layer)}
