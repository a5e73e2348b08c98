"""The model of a bending fish: its outline lies near the edges of the region with its colour.

The body is an ellipse, the tail a straight line that begins at the rear end of its long axis. A *pose* is (a, b, theta,
phi): the centre of the ellipse in px, the direction to the head and the bend of the tail against the body's axis in
rad, positive clockwise on the screen. The painted fish, which counts as the silhouette, has a tail of some width.

The picture is separated into the body and the rest, by the body's colour or by being darker or lighter than its
surroundings. The edges of that mask go into a distance transform: an image of each pixel's distance from the nearest
edge. A hypothesis then costs one look-up for each point of the model, and its log likelihood is -d_max^2 / sigma_d,
with the largest of these distances: one point that is far from any edge is enough to refuse it.

The likelihood requires that the model lies near edges, not that it explains all edges. A model turned head to tail, its
tail folded back along the body, therefore fits almost perfectly; a limit on the bend rules it out.

Source: Mitsugami et al. 2009, section 3.1, eq. 7; the limit is our own (docs/methods/diffusion.md).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from pftrack.core.arrays import Floats, check_picture
from pftrack.core.model.likelihood import Amount, Component, Part
from pftrack.core.model.model import Model, State, Values
from pftrack.core.model.series import SeriesValue
from pftrack.core.model.source import Frame
from pftrack.core.numerics.compiled import compiled, read_only
from pftrack.core.numerics.elementary import sines_cosines
from pftrack.experiments.declared import read_reported
from pftrack.experiments.fish.parameters import FishTrackerParameters, Told
from pftrack.experiments.shared import reports
from pftrack.experiments.shared.recording import keep_last
from pftrack.filters.particles import ParticleSet

BODY_POINTS, TAIL_POINTS = 24, 8
"""Points of the model that are compared with edges."""

ROOT_INSIDE, ROOT_HALF_WIDTH, TIP_HALF_WIDTH = 6.0 / 40.0, 4.5 / 15.0, 2.0 / 15.0
"""Depth of the painted tail's root inside the body, in half lengths, and its half widths, in half widths of the
body."""


class FishShape(NamedTuple):
    """The constant shape: the semi-axes of the body's ellipse and the length of the tail, px."""

    half_length: float
    half_width: float
    tail_length: float

    @property
    def reach(self) -> float:
        """Distance of a straight tail's tip from the body's centre, px."""
        return self.half_length + self.tail_length


GOLDFISH = FishShape(40.0, 15.0, 40.0)
"""Shape of the fish in the simulated tank."""


def body_points(pose: Floats, shape: FishShape, count: int = BODY_POINTS) -> Floats:
    """Return points of the body's outline (..., count, 2), px, for poses (..., 4)."""
    around = 2.0 * np.pi * (np.arange(count) + 0.5) / count
    along, across = shape.half_length * np.cos(around), shape.half_width * np.sin(around)
    cosine, sine = np.cos(pose[..., 2, None]), np.sin(pose[..., 2, None])
    x = pose[..., 0, None] + cosine * along - sine * across
    y = pose[..., 1, None] + sine * along + cosine * across
    return np.stack([x, y], axis=-1)


def tail_line(pose: Floats, shape: FishShape) -> Floats:
    """Return root and tip of the tail (..., 2, 2), px, for poses (..., 4)."""
    body, tail = pose[..., 2], pose[..., 2] + pose[..., 3]
    root = pose[..., :2] - shape.half_length * np.stack([np.cos(body), np.sin(body)], axis=-1)
    return np.stack([root, root - shape.tail_length * np.stack([np.cos(tail), np.sin(tail)], axis=-1)], axis=-2)


def model_points(pose: Floats, shape: FishShape) -> Floats:
    """Return all points that are compared with edges (..., 32, 2), px: of the body's outline, then of the tail."""
    ends = tail_line(pose, shape)
    share = (np.arange(TAIL_POINTS) + 1.0)[:, None] / TAIL_POINTS
    tail = ends[..., :1, :] + share * (ends[..., 1:, :] - ends[..., :1, :])
    return np.concatenate([body_points(pose, shape), tail], axis=-2)


def tail_corners(pose: Floats, shape: FishShape) -> Floats:
    """Return the corners (4, 2) of the painted tail, px, of a pose (4,); the tail begins inside the body."""
    root, tip = tail_line(pose, shape)
    begin = root + ROOT_INSIDE * shape.half_length * np.array([np.cos(pose[2]), np.sin(pose[2])])
    across = shape.half_width * np.array([-np.sin(pose[2] + pose[3]), np.cos(pose[2] + pose[3])])
    wide, narrow = ROOT_HALF_WIDTH * across, TIP_HALF_WIDTH * across
    return np.array([begin + wide, tip + narrow, tip - narrow, begin - wide])


def inside(point: Floats, pose: Floats, shape: FishShape) -> bool:
    """Return whether a point (2,) lies within the silhouette of a pose (4,): the body and the painted tail."""
    cosine, sine = np.cos(pose[2]), np.sin(pose[2])
    x, y = point - pose[:2]
    along, across = cosine * x + sine * y, cosine * y - sine * x
    if (along / shape.half_length) ** 2 + (across / shape.half_width) ** 2 <= 1.0:
        return True
    corners = tail_corners(pose, shape)
    edges, ways = np.roll(corners, -1, axis=0) - corners, point - corners
    sides = edges[:, 0] * ways[:, 1] - edges[:, 1] * ways[:, 0]
    return bool((sides >= 0.0).all() or (sides <= 0.0).all())


CAP_PX = 63
"""Largest distance, also used for points outside the picture."""
QUARTERS = 4
"""Distances are stored in quarters of a pixel, which fit into a byte."""

CANNY = (100, 200)
OPEN_PX, CLOSE_PX = 3, 5
"""Sides of the median that takes single pixels away, and of the closing that fills small holes."""

BENT = 0.5 * np.pi
"""The largest bend that a body can have, rad."""


class Foreground(NamedTuple):
    """Separation of the body's pixels from the rest.

    Attributes:
        told: Whether by colour, or by being darker or lighter than the mean around them.
        hue_low: Least hue of the colour, 0..179 as in OpenCV; above `hue_high` the range goes through 0.
        hue_high: Largest hue of the colour.
        saturation: At least, 0..255.
        value: At least, 0..255.
        contrast: Least difference in brightness, grey levels.
        around: Radius of the square whose mean is compared with, px.
    """

    told: Told
    hue_low: int
    hue_high: int
    saturation: int
    value: int
    contrast: int
    around: int


class Edges(NamedTuple):
    """The edges of a picture.

    Attributes:
        mask: (height, width) 255 where the body is.
        edges: (height, width) 255 on its edges.
        distances: (height + 2, width + 2) quarters of px to the nearest edge, capped, with a border of the cap.
    """

    mask: NDArray[np.uint8]
    edges: NDArray[np.uint8]
    distances: NDArray[np.uint8]


@keep_last
def edges_of(image_rgb: NDArray[np.uint8], foreground: Foreground) -> Edges:
    """Return mask, edges and distances of a picture (height, width, 3).

    Raises:
        TypeError: The picture is not an array of bytes.
        ValueError: It is not (height, width, 3).
    """
    check_picture(image_rgb)
    mask = cv2.medianBlur(_classify_pixels(image_rgb, foreground), OPEN_PX)
    mask = cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((CLOSE_PX, CLOSE_PX), np.uint8))
    edges = cv2.Canny(mask, *CANNY)
    away = cv2.distanceTransform(cv2.bitwise_not(edges), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    if not edges.any():  # OpenCV does not define the distance without an edge
        away = np.full(edges.shape, CAP_PX, np.float32)
    quarters = np.rint(QUARTERS * np.minimum(away, CAP_PX)).astype(np.uint8)
    cap = (QUARTERS * CAP_PX,)
    padded = cv2.copyMakeBorder(quarters, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=cap)
    return Edges(np.asarray(mask, np.uint8), np.asarray(edges, np.uint8), read_only(np.asarray(padded, np.uint8)))


def _classify_pixels(image_rgb: NDArray[np.uint8], foreground: Foreground) -> NDArray[np.uint8]:
    if foreground.told == "colour":
        hsv = cv2.cvtColor(image_rgb, cv2.COLOR_RGB2HSV)
        low, high = foreground.hue_low, foreground.hue_high
        ranges = [(low, high)] if low <= high else [(low, 179), (0, high)]
        least = (foreground.saturation, foreground.value)
        masks = [cv2.inRange(hsv, (first, *least), (last, 255, 255)) for first, last in ranges]
        return np.asarray(masks[0] if len(masks) == 1 else cv2.bitwise_or(*masks), np.uint8)
    grey = cv2.cvtColor(image_rgb, cv2.COLOR_RGB2GRAY)
    side = 2 * foreground.around + 1
    mean = cv2.blur(grey, (side, side))
    difference = cv2.subtract(mean, grey) if foreground.told == "dark" else cv2.subtract(grey, mean)
    return np.asarray(cv2.inRange(difference, (foreground.contrast,), (255,)), np.uint8)


@compiled
def largest_distances(distances: NDArray[np.uint8], states: Floats, shape: FishShape) -> NDArray[np.uint8]:
    """Return the largest distance (N,) of each hypothesis's points from an edge, quarters of px.

    Args:
        distances: As in `Edges`.
        states: (N, d) whose first two columns are a, b and whose last two are theta, phi.
        shape: Shape of the body.

    Raises:
        ValueError: The states have fewer than four columns.
    """
    if states.shape[1] < 4:
        raise ValueError("expected states (N, d) with d >= 4, got fewer columns")
    count, last = states.shape[0], states.shape[1] - 1
    right, below = distances.shape[1] - 0.5, distances.shape[0] - 0.5
    flat, row = distances.ravel(), distances.shape[1]
    largest = np.zeros(count, np.uint8)
    place = np.empty(count, np.int32)
    x0, y0, theta = states[:, 0].copy(), states[:, 1].copy(), states[:, last - 1].copy()
    tail = theta + states[:, last]
    sine, cosine = sines_cosines(theta)
    tail_sine, tail_cosine = sines_cosines(tail)
    for point in range(BODY_POINTS + TAIL_POINTS):
        if point < BODY_POINTS:
            around = 2.0 * np.pi * (point + 0.5) / BODY_POINTS
            along, across, back = shape.half_length * np.cos(around), shape.half_width * np.sin(around), 0.0
        else:
            along, across = -shape.half_length, 0.0
            back = shape.tail_length * (point - BODY_POINTS + 1) / TAIL_POINTS
        for n in range(count):
            # Half a pixel to round, one for the border; what is outside ends on the border.
            x = x0[n] + along * cosine[n] - across * sine[n] - back * tail_cosine[n] + 1.5
            y = y0[n] + along * sine[n] + across * cosine[n] - back * tail_sine[n] + 1.5
            place[n] = np.int32(min(max(y, 0.0), below)) * row + np.int32(min(max(x, 0.0), right))
        for n in range(count):
            largest[n] = max(largest[n], flat[place[n]])
    return largest


@compiled
def log_likelihoods(largest: NDArray[np.uint8], states: Floats, sigma_d: float, limited: bool) -> Floats:
    """Return -d_max^2 / sigma_d (N,), eq. 7; -inf for a bend beyond a right angle where it is limited.

    Args:
        largest: (N,) largest distances, quarters of px.
        states: (N, d) whose last column is phi.
        sigma_d: In px^2.
        limited: Whether the bend is.

    Raises:
        ValueError: There are not as many states as distances.
    """
    if largest.shape[0] != states.shape[0]:
        raise ValueError("expected states (N, d) for distances (N,), got another number")
    count, last = states.shape[0], states.shape[1] - 1
    found = np.empty(count)
    for n in range(count):
        distance = largest[n] / QUARTERS
        found[n] = -distance * distance / sigma_d
        if limited and abs(states[n, last]) > BENT:
            found[n] = -np.inf
    return found


class Weighing(NamedTuple):
    """How particles are weighed: the shape, sigma_d in px^2, and whether the bend is limited."""

    shape: FishShape
    sigma_d: float
    limited: bool


def shape(parameters: FishTrackerParameters) -> FishShape:
    """Return the shape of the fish that is followed."""
    lengths = (parameters.half_length_px, parameters.half_width_px, parameters.tail_length_px)
    return FishShape(*map(float, lengths))


def weighing(parameters: FishTrackerParameters) -> Weighing:
    """Return how particles are weighed."""
    return Weighing(shape(parameters), float(parameters.sigma_d_px2), parameters.bend_limited)


def foreground(parameters: FishTrackerParameters) -> Foreground:
    """Return the separation of the fish from the rest."""
    return Foreground(
        parameters.foreground,
        parameters.lowest_hue,
        parameters.highest_hue,
        parameters.saturation_low,
        parameters.value_low,
        parameters.least_contrast,
        parameters.contrast_radius_px,
    )


def find_edges(frame: Frame, parameters: FishTrackerParameters) -> Edges:
    """Return the edges of the region with the fish's colour in a frame.

    Raises:
        ValueError: The frame has no picture.
    """
    return edges_of(frame.picture, foreground(parameters))


COORDINATES = ("a", "b", "along", "across", "theta", "phi")
"""Numbers of a particle: place in px, velocity along and across the body in px/frame, heading and bend in rad."""

UNITS = ("px", "px", "px/frame", "px/frame", "rad", "rad")
"""Units of these numbers."""


@dataclass(frozen=True, slots=True)
class FishState:
    """The posterior of one frame, immutable; all trackers use the same type, so a run can switch trackers.

    Attributes:
        particles: (N, 6) states, see `COORDINATES`.
        changes: (N, 3) since each one's parent: gain of the velocity across the body, px/frame, turn and bend, rad.
        mean: (6,) of the posterior; the mean heading is on the circle, within half a turn of 0.
        spread: (4,) standard deviations of the pose, px and rad.
        distance: d_max of the particle with the greatest weight, px.
        log_evidence: Up to the constant that the likelihood leaves out.
    """

    particles: ParticleSet
    changes: Floats
    mean: Floats
    spread: Floats
    distance: float
    log_evidence: float = 0.0

    @property
    def estimate(self) -> Floats:
        """(2,) posterior mean of the centre of the body, px."""
        return self.mean[:2]

    @property
    def sigma(self) -> Floats:
        """(2,) posterior standard deviations of the same, px."""
        return self.spread[:2]

    @property
    def pose(self) -> Floats:
        """(4,) posterior mean (a, b, theta, phi), px and rad."""
        return self.mean[[0, 1, 4, 5]]

    def arrays(self) -> Mapping[str, Floats]:
        """Return states and log weights of the particles."""
        return self.particles.arrays()


SERIES = (*reports.CLOUD, *read_reported(Path(__file__).parent).values())
"""Series that all of them report. `body` is what is learned from: px, px, rad, rad; the heading is within half a turn
of 0."""


class Outline(Model):
    """Fit of a fish's outline to the edges of the picture."""

    title = "outline beside the edges"
    evidence = "relative"
    movable = True

    @override
    def components(self, parameters: Values) -> tuple[Component, ...]:
        return tuple(map(Component, COORDINATES, UNITS))

    @override
    def log_likelihood(self, states: Floats, frame: Frame, parameters: FishTrackerParameters, known: State) -> Floats:
        weighed, laid = weighing(parameters), np.asfortranarray(states)
        largest = largest_distances(find_edges(frame, parameters).distances, laid, weighed.shape)
        return np.asarray(log_likelihoods(largest, laid, weighed.sigma_d, weighed.limited))

    def measure(self, state: FishState) -> Mapping[str, SeriesValue]:
        """Report particles, pose, velocity and fit; a fit at the cap means that the nearest edge is far away."""
        a, b, along, across, theta, phi = state.mean.tolist()
        return {
            **reports.cloud(state.particles, resampled=True),
            "body": (a, b, theta, phi),
            "heading": float(np.rad2deg(theta)),
            "bend": float(np.rad2deg(phi)),
            "heading_sd": float(np.rad2deg(state.spread[2])),
            "bend_sd": float(np.rad2deg(state.spread[3])),
            "velocity": (along, across),
            "d_max": min(state.distance, float(CAP_PX)),
        }

    @override
    def centre(self, state: FishState) -> Floats:
        return state.mean

    @override
    def moved(self, state: FishState, particle: int | None, place: Floats) -> FishState:
        before = state.estimate if particle is None else state.particles.states[particle, :2]
        particles = state.particles.shifted(np.append(place - before, np.zeros(4)), particle)
        mean, spread = state.mean.copy(), state.spread.copy()
        if particle is None:
            mean[:2] = place
        else:
            mean[:2], spread[:2] = particles.mean[:2], np.sqrt(particles.covariance.diagonal()[:2])
        return replace(state, particles=particles, mean=mean, spread=spread)

    @override
    def parts(self, one: Floats, frame: Frame, parameters: FishTrackerParameters, known: State) -> tuple[Part, ...]:
        """Return the largest distance of the outline's points from an edge."""
        laid = np.asfortranarray(one[None])
        (largest,) = largest_distances(find_edges(frame, parameters).distances, laid, weighing(parameters).shape)
        return (Amount("farthest point from an edge", float(largest) / 4.0, "px"),)


MODEL = Outline()
