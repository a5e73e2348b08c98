"""The chain in the picture, in depth and by its lengths: measurements, beliefs and the truth.

A chain in the plane is seen as one line. Beliefs are drawn below that line and the truth above it, so neither hides the
measurements; in space everything is drawn at its place. Gaussians, regions and particles are drawn in one form: places
of hypotheses, weights, and extents.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats
from pftrack.core.model.drawing import (
    COLOURS,
    Arrows,
    Colour,
    Ellipsoids,
    Links,
    Mesh,
    Points,
    Polyline,
    Primitive,
    Text,
    WorldDrawing,
)
from pftrack.core.model.source import Frame
from pftrack.experiments.declared import read_worlds
from pftrack.experiments.linkage import model
from pftrack.experiments.linkage.scene import LinkageTarget, LinkMeasurements, attitude, places
from pftrack.experiments.linkage.sets.regions import CENTRE
from pftrack.experiments.linkage.sets.space import Strip, intersect
from pftrack.experiments.linkage.state import LinkageState, LinkageTrackerParameters
from pftrack.experiments.linkage.trackers import Region
from pftrack.experiments.shared.sketch import at_height, circle, dots, grid_faces, lines
from pftrack.filters.beam import Beam
from pftrack.filters.particles import ParticleSet

SIGMAS = 2.0
"""Extent of a Gaussian, in standard deviations."""

MOST_PARTICLES = 100
"""More would hide their centre."""


@dataclass(frozen=True, slots=True, eq=False)
class ShownHypothesis:
    """One hypothesis.

    Attributes:
        position: (6,) or (11,), an estimate.
        middle: (6,) of the ellipsoid, directions, rad, and lengths, px.
        weight: Its probability.
        low: (6,) of the box of directions, rad, and lengths, px, that it extends to.
        high: (6,) of the same.
        shape: (6, 6) of the ellipsoid, {x: x' shape^-1 x <= 1} from its middle; None where there is none.
    """

    position: Floats
    middle: Floats
    weight: float
    low: Floats
    high: Floats
    shape: Floats | None


def list_hypotheses(state: LinkageState) -> list[ShownHypothesis]:
    """Return the hypotheses of a state in its order; none of particles."""
    if not isinstance(state.belief, Beam):
        return []
    pairs = zip(state.belief.members, state.belief.weights.tolist(), strict=True)
    found = []
    for member, weight in pairs:
        if isinstance(member, model.Chain):
            found.append(_gaussian(member, weight, state))
        elif isinstance(member, Region):
            found.append(_region(member, weight, state))
    return found


def particles(state: LinkageState) -> Floats:
    """Return the estimates (m, 6) or (m, 11) of some particles, drawn by weight at equal steps; none of hypotheses."""
    size = len(state.mean)
    if not isinstance(state.belief, ParticleSet):
        return np.empty((0, size))
    shares = np.cumsum(state.belief.weights)
    steps = (np.arange(MOST_PARTICLES) + 0.5) / MOST_PARTICLES * shares[-1]
    states = state.belief.states[np.unique(np.searchsorted(shares, steps))]
    if not state.in_space:
        return np.hstack([states[:, : model.LINKS], states[:, -model.LINKS :]])
    # The first angle is part of the attitude.
    first = np.zeros((len(states), 1))
    return np.hstack([states[:, :5], first, states[:, 5:7], states[:, -model.LINKS :]])


def _gaussian(member: model.Chain, weight: float, state: LinkageState) -> ShownHypothesis:
    reference = model.reference_attitude(state.reference)
    position = model.describe(member.mean, member.covariance, member.attitude, reference)[0]
    size = len(member.mean)
    rows = np.zeros((2 * model.LINKS, size))
    # In space the first of the chain's own angles is none, and two stand behind the root.
    first, count = (0, model.LINKS) if not state.in_space else (model.pose_size(size) - 2, 2)
    for link in range(model.LINKS):
        rows[link, first : first + max(link + 1 - (model.LINKS - count), 0)] = 1.0
        rows[model.LINKS + link, size - model.LINKS + link] = 1.0
    shape = SIGMAS**2 * rows @ member.covariance @ rows.T
    half = np.sqrt(np.maximum(np.diagonal(shape), 0.0))
    return ShownHypothesis(position, member.pose, weight, member.pose - half, member.pose + half, shape)


def _region(member: Region, weight: float, state: LinkageState) -> ShownHypothesis:
    position = state.mean.copy()
    position[-2 * model.LINKS : -model.LINKS], position[-model.LINKS :] = (
        model.joint_angles(member.pose[: model.LINKS]),
        member.pose[model.LINKS :],
    )
    if state.in_space:
        position[: model.LINKS] = member.array[CENTRE, : model.LINKS] / member.scale
    shape = member.shape if member.has_ellipsoid else None
    return ShownHypothesis(position, member.pose, weight, member.low, member.high, shape)


def chain_of(position: Floats, state: LinkageState) -> Floats:
    """Return where root, joints and tip of an estimate are, (4, 3): column and row from the origin, and depth, px."""
    theta, r = position[-2 * model.LINKS : -model.LINKS], position[-model.LINKS :]
    if not state.in_space:
        return places(LinkageTarget(position, theta=theta, r=r))
    omega, t = position[:3], position[3:5]
    return places(LinkageTarget(position, theta=theta, r=r, omega=omega, t=t, reference=state.reference))


def turn_of(position: Floats, state: LinkageState) -> Floats:
    """Return how the plane of a chain lies, (3, 3): its first two directions and its normal, as columns."""
    if state.reference is None:
        return np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
    return np.asarray(state.reference @ attitude(position[:3]))


ABOVE_PX, BELOW_PX, NEXT_PX = -60.0, 56.0, 14.0
"""Rows from the line of a chain in the plane: of the truth and the estimate, and the hypothesis's distance below
that."""

DOT_PX, RING_PX, TICK_PX = 5.0, 6.0, 26.0
ROOT_AT = 0.3
"""Height of the root above the picture, as a share of the longer side: its camera sees along parallels."""
FARTHEST = 5.0
"""Distance from the picture's corner, in longer sides, beyond which nothing is drawn."""


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
            drawn[f"measured {number}"] = lines(ends[None], COLOURS["observation"], 2.0, "measurements")
    if isinstance(frame.measurements, LinkMeasurements) and frame.image_rgb is not None:
        height, width, _ = frame.image_rgb.shape
        sides: list[Strip] = [(np.array([1.0, 0.0]), 0.0, width - 1.0), (np.array([0.0, 1.0]), 0.0, height - 1.0)]
        for number in np.flatnonzero(np.isfinite(frame.measurements.offsets_px)).tolist():
            normal, offset = frame.measurements.normals[number], float(frame.measurements.offsets_px[number])
            ends = _ends(intersect([*sides, (normal, offset, offset)]), normal)
            if len(ends):
                drawn[f"measured line {number}"] = lines(ends[None], COLOURS["observation"], 1.0, "measurements")
    return drawn


def _ends(corners: Floats, normal: Floats) -> Floats:
    """Return the two ends (2, 2) of what is left of a line in the picture; none of nothing."""
    along = corners @ np.array([-normal[1], normal[0]])
    return corners[[along.argmin(), along.argmax()]] if len(corners) else corners


def draw_belief(state: LinkageState, number: int, longest: float) -> dict[str, Primitive]:
    """Draw the estimate, and one of the hypotheses.

    Args:
        state: State of the frame.
        number: Number of the hypothesis, 1 the most probable.
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
    points = np.column_stack([points, _to_viewer(places(target))])
    drawn = _chain("true", points, COLOURS["truth"], 1.5, "truth", longest)
    if not state.in_space:
        drawn |= _name("true name", "true", state, ABOVE_PX, COLOURS["truth"], "truth")
    return drawn


def second_run(estimate: Floats, state: LinkageState, longest: float) -> dict[str, Primitive]:
    """Draw where a second run has the chain."""
    points = _in_picture(chain_of(estimate, state), state, BELOW_PX - NEXT_PX)
    drawn = _chain("second", points, COLOURS["second"], 1.5, "second run", longest)
    return {"second links": drawn["second links"]}


def _in_picture(joints: Floats, state: LinkageState, row: float) -> Floats:
    places = joints[:, :2] + state.origin_px + np.array([0.0, 0.0 if state.in_space else row])
    return np.column_stack([places, _to_viewer(joints)])


def _to_viewer(joints: Floats) -> Floats:
    """Return the height of joints (n, 3) above the root, towards the viewer, (n,) px."""
    return np.asarray(joints[0, 2] - joints[:, 2])


def _chain(name: str, points: Floats, colour: Colour, width: float, layer: str, longest: float) -> dict[str, Primitive]:
    near = np.asarray((np.abs(points) < FARTHEST * longest).all(axis=1))
    points = points + np.array([0.0, 0.0, ROOT_AT * longest])
    ends = np.stack([points[:-1], points[1:]], axis=1)[near[:-1] & near[1:]]
    return {
        f"{name} links": lines(ends, colour, width, layer),
        f"{name} joints": replace(dots(points[near], colour, DOT_PX, layer), stems=True),
    }


def _name(name: str, text: str, state: LinkageState, row: float, colour: Colour, layer: str) -> dict[str, Primitive]:
    place = at_height(np.array([10.0, state.origin_px[1] + row + 4.0]), 2.0)
    return {name: Text(place, text, colour, layer)}


# The chain in depth, which no picture shows: the root is in the middle, the image coordinates run across, and depth
# away from the camera; seen from above, a chain in the plane lies flat. Lengths are shares of the longest chain that
# the bounds allow, so a large one fits as well. Around each link of a hypothesis lies a sector, which its tip may not
# leave: the range of directions by that of lengths. The curve within is the ellipsoid's shadow.

DEPTH_WORLD, LENGTHS_WORLD = read_worlds(Path(__file__).parent)

MOST_SHOWN = 8
STEPS = 24
"""Corners along an arc."""
JOINT, PARTICLE, AXIS_AT, CAMERA_AT = 0.04, 0.02, 0.8, 0.8
PALEST = 0.6
"""Share of white in the colour of a hypothesis without weight."""


def pale(colour: Colour, weight: float) -> Colour:
    """Return the colour of a hypothesis: the paler the less it weighs."""
    share = PALEST * (1.0 - min(max(weight, 0.0), 1.0))
    red, green, blue = (round(level + share * (255 - level)) for level in colour)
    return red, green, blue


def depth_world(
    state: LinkageState,
    target: object,
    parameters: LinkageTrackerParameters,
    second: Floats | None = None,
) -> WorldDrawing:
    """Draw the hypotheses with their sectors, the estimate, the truth if it is known, and a second run's estimate."""
    reach = float(sum(parameters.bounds.length_high))
    estimate = chain_of(state.mean, state)
    middle = estimate[0]
    ends = np.array([[[-AXIS_AT, 0.0, 0.0], [AXIS_AT, 0.0, 0.0]], [[0.0, 0.0, -AXIS_AT], [0.0, 0.0, AXIS_AT]]])
    way = np.array([[[0.0, 0.0, -CAMERA_AT], [0.0, 0.0, -0.8 * CAMERA_AT]]], np.float32)
    drawn: dict[str, Primitive] = {
        "axes": Links(ends.astype(np.float32), COLOURS["hidden"], 1.0, "axes"),
        "camera": Arrows(way, COLOURS["camera"], 2.0, "axes"),
        "name camera": Text(_at(0.06, 0.0, -0.8 * CAMERA_AT), "camera", COLOURS["camera"], "axes"),
        "name across": Text(_at(AXIS_AT, 0.0, -0.07), "image", COLOURS["camera"], "axes", "end"),
    }
    for number, one in enumerate(list_hypotheses(state)[:MOST_SHOWN]):
        joints = (chain_of(one.position, state) - middle) / reach
        drawn |= _extent(f"{number}", one, joints, turn_of(one.position, state), reach)
        colour = pale(COLOURS["prediction"], one.weight)
        drawn[f"hypothesis {number}"] = Links(_segments(joints), colour, 1.5 + 2.0 * one.weight, "hypotheses")
    if len(cloud := particles(state)):
        joints = np.concatenate([chain_of(one, state)[1:] - middle for one in cloud]) / reach
        drawn["particles"] = _dots(joints, COLOURS["prediction"], "particles", PARTICLE)
    if isinstance(target, LinkageTarget):
        true = (places(target) - middle) / reach
        drawn["truth"] = Links(_segments(true), COLOURS["truth"], 2.0, "truth")
        drawn["true joints"] = _dots(true, COLOURS["truth"], "truth")
    if second is not None:
        other = (chain_of(second, state) - middle) / reach
        drawn["second"] = Links(_segments(other), COLOURS["second"], 2.0, "second run")
    drawn["estimate"] = Links(_segments((estimate - middle) / reach), COLOURS["estimate"], 3.0, "estimate")
    drawn["joints"] = _dots((estimate - middle) / reach, COLOURS["estimate"], "estimate")
    return WorldDrawing(DEPTH_WORLD, drawn)


def _extent(name: str, one: ShownHypothesis, joints: Floats, turn: Floats, reach: float) -> dict[str, Primitive]:
    """Draw sectors of directions by lengths, and the ellipsoid's shadow in each."""
    drawn: dict[str, Primitive] = {}
    colour, opacity = pale(COLOURS["prediction"], one.weight), 0.15 + 0.25 * one.weight
    for link in range(model.LINKS):
        low, high = (np.array([ends[link], ends[model.LINKS + link]]) for ends in (one.low, one.high))
        high[0] = min(high[0], low[0] + 2.0 * np.pi)
        angles = np.linspace(low[0], high[0], STEPS)
        rims = [_place(angles, max(float(r), 0.0) / reach, turn) + joints[link] for r in (low[1], high[1])]
        vertices = np.concatenate(rims)
        if not _near(vertices):
            continue
        drawn[f"box {name} {link + 1}"] = Mesh(vertices.astype(np.float32), BAND, colour, opacity, "guide boxes")
        if one.shape is not None:
            curve = _shadow(one.shape, one.middle, link)
            along = joints[link] + _place(curve[:, 0], np.maximum(curve[:, 1], 0.0) / reach, turn)
            if _near(along):
                drawn[f"ellipsoid {name} {link + 1}"] = Polyline(along.astype(np.float32), colour, 1.5, "ellipsoids")
    return drawn


def _shadow(shape: Floats, middle: Floats, link: int) -> Floats:
    """Return points (2 STEPS, 2), direction and length of a link, on the border of the ellipsoid's projection."""
    rows = [link, model.LINKS + link]
    values, vectors = np.linalg.eigh(shape[np.ix_(rows, rows)])
    turns = np.linspace(0.0, 2.0 * np.pi, 2 * STEPS)
    round_ = np.stack([np.cos(turns), np.sin(turns)], axis=1) * np.sqrt(np.maximum(values, 0.0))
    return np.asarray(middle[rows] + round_ @ vectors.T)


def _place(angles: Floats, radius: Floats | float, turn: Floats) -> Any:  # noqa: ANN401
    flat = np.stack([radius * np.cos(angles), radius * np.sin(angles), np.zeros_like(angles)], axis=1)
    return flat @ turn.T


def _near(points: Floats) -> bool:
    return bool(_within(points).all())


def _within(points: Floats) -> Bools:
    """Whether points (..., 3) are in the world."""
    return np.asarray(np.sqrt(np.square(points).sum(axis=-1)) < DEPTH_WORLD.radius)


def _segments(joints: Floats) -> NDArray[np.float32]:
    """Return the links (n, 2, 3) of a chain (4, 3) that are near enough to be drawn."""
    ends = np.stack([joints[:-1], joints[1:]], axis=1)
    near = _within(ends).all(axis=1)
    return np.asarray(ends[near], np.float32)


def _dots(joints: Floats, colour: Colour, layer: str, size: float = JOINT) -> Points:
    return dots(joints[_within(joints)], colour, size, layer)


def _at(*place: float) -> NDArray[np.float32]:
    return np.array(place, np.float32)


BAND = grid_faces(2, STEPS)

# In the space of the three lengths, what the bounds allow is a cube. Each hypothesis is a box of the lengths that it
# has not excluded, and an ellipsoid. The truth is a point; for every method, the question is whether the point is
# inside, and how much of the cube remains.


DOT, CROSS, LEAST_HALF_PX = 0.13, 0.12, 0.5
NAME_AT = 1.35
CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float64)
EDGES = np.array([[a, b] for a in range(8) for b in range(a + 1, 8) if (a ^ b).bit_count() == 1])


def lengths_world(
    state: LinkageState,
    target: object,
    parameters: LinkageTrackerParameters,
    second: Floats | None = None,
) -> WorldDrawing:
    """Draw what each hypothesis has left of the allowed lengths, the estimate, the truth, and a second run's."""
    low, high = np.array(parameters.bounds.length_low), np.array(parameters.bounds.length_high)
    middle, half = 0.5 * (low + high), np.maximum(0.5 * (high - low), LEAST_HALF_PX)
    drawn: dict[str, Primitive] = {"cube": Links(_box(-np.ones(3), np.ones(3)), COLOURS["hidden"], 1.0, "axes")}
    drawn["ways"] = Arrows(_ways(), COLOURS["hidden"], 1.5, "axes")
    for link in range(model.LINKS):
        place = -np.ones(3)
        place[link] = NAME_AT
        text = f"link {link + 1}"
        drawn[f"name {link + 1}"] = Text(place.astype(np.float32), text, COLOURS["camera"], "axes", "middle")
    for number, one in enumerate(list_hypotheses(state)[:MOST_SHOWN]):
        drawn |= _box_of_lengths(f"{number}", one, middle, half)
    if len(cloud := particles(state)):
        places = (cloud[:, -model.LINKS :] - middle) / half
        near = places[np.sqrt(np.square(places).sum(axis=1)) < LENGTHS_WORLD.radius]
        drawn["particles"] = dots(near, COLOURS["prediction"], 0.5 * DOT, "particles")
    if isinstance(target, LinkageTarget):
        drawn["truth"] = _dot((target.r - middle) / half, "truth", 1.2 * DOT)
    if second is not None:
        drawn["second"] = Links(_cross((second[-model.LINKS :] - middle) / half), COLOURS["second"], 2.0, "second run")
    drawn["estimate"] = _dot((state.mean[-model.LINKS :] - middle) / half, "estimate", DOT)
    return WorldDrawing(LENGTHS_WORLD, drawn)


def _box_of_lengths(name: str, one: ShownHypothesis, middle: Floats, half: Floats) -> dict[str, Primitive]:
    """Draw the box and the ellipsoid of a hypothesis, as far as they are near."""
    colour = pale(COLOURS["prediction"], one.weight)
    low, high = ((ends[model.LINKS :] - middle) / half for ends in (one.low, one.high))
    drawn: dict[str, Primitive] = {}
    if float(np.linalg.norm(np.maximum(np.abs(low), np.abs(high)))) < LENGTHS_WORLD.radius:
        drawn[f"box {name}"] = Links(_box(low, high), colour, 1.0 + one.weight, "guide boxes")
    if one.shape is not None:
        covariance = one.shape[model.LINKS :, model.LINKS :] / np.outer(half, half) / SIGMAS**2
        centre = (one.middle[model.LINKS :] - middle) / half
        reach = np.abs(centre) + SIGMAS * np.sqrt(np.maximum(np.diagonal(covariance), 0.0))
        if float(np.linalg.norm(reach)) < LENGTHS_WORLD.radius:
            drawn[f"ellipsoid {name}"] = Ellipsoids(
                centre[None].astype(np.float32),
                covariance[None].astype(np.float32),
                np.array([colour], np.uint8),
                0.1 + 0.15 * one.weight,
                "ellipsoids",
                SIGMAS,
            )
    return drawn


def _box(low: Floats, high: Floats) -> NDArray[np.float32]:
    """Return the edges (12, 2, 3) of a box."""
    corners = low + CORNERS * (high - low)
    return np.asarray(corners[EDGES], np.float32)


def _ways() -> NDArray[np.float32]:
    """Return arrows along which the lengths grow, from the corner of the shortest."""
    ends = np.full((model.LINKS, 2, 3), -1.0)
    ends[np.arange(model.LINKS), 1, np.arange(model.LINKS)] = 1.2
    return ends.astype(np.float32)


def _dot(place: Floats, colour: str, size: float) -> Points:
    near = np.array([place] if np.linalg.norm(place) < LENGTHS_WORLD.radius else [], np.float32).reshape(-1, 3)
    return dots(near, COLOURS[colour], size, colour)


def _cross(place: Floats) -> NDArray[np.float32]:
    """Return three segments (3, 2, 3) that meet at a place; none where it is too far away."""
    arms = np.stack([place - CROSS * np.eye(3), place + CROSS * np.eye(3)], axis=1)
    near = float(np.linalg.norm(place)) + CROSS < LENGTHS_WORLD.radius
    return np.asarray(arms if near else arms[:0], np.float32)
