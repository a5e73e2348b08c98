"""A chain of three links seen by one orthographic camera, as a source: in the plane or in space.

In the plane the camera has one line of pixels: a point's image coordinate is its first one, and the second is its
depth, which is not seen. In space it sees the first two coordinates. An absolute angle of 0 lies parallel to the image.
Joints move between keys, with eased angles: Shimada does not give a sequence in numbers; these show what he describes
(docs/methods/linkages.md).
"""

from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from typing import Literal, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats
from pftrack.core.model.parameters import parameter
from pftrack.core.model.source import Frame, History, Landmarks, Measurements, Target
from pftrack.core.numerics.elementary import sines_cosines
from pftrack.core.numerics.matrices import product
from pftrack.core.numerics.random import Purpose, Stream, standard_normals, uniforms
from pftrack.experiments.shared.recording import SHIFT, OccluderParameters, paint_strip, sixteenths, strip

PathName: TypeAlias = Literal["cross", "static", "mirror3", "mirror2", "two", "3d"]

Keys: TypeAlias = tuple[tuple[float, float, float, float], ...]
"""(frame, theta_1, theta_2, theta_3), the angles in rad, each relative to the link before."""

PATHS: dict[PathName, Keys] = {
    "cross": ((0, 1.35, 0.95, 1.35), (18, 1.35, 0.95, 0.84), (26, 1.35, 0.93, 0.6), (50, 1.25, 0.6, 0.15)),
    "static": ((0, 1.1, 0.9, 0.85), (299, 1.1, 0.9, 0.85)),
    "mirror3": ((0, 1.35, 0.95, 1.35), (30, 1.35, 0.95, 0.84), (45, 1.35, 0.93, 0.6), (90, 1.25, 0.6, 0.15)),
    "mirror2": ((0, -1.5, 0.2, 0.1), (20, -1.2, 0.6, 0.4), (40, -1.0, 0.8, 0.7), (80, -0.9, 1.3, 1.0)),
    "two": (
        (0, 0.2, 0.4, 0.3),
        (30, -0.15, 0.5, 0.15),
        (70, -1.25, 1.5, 1.4),
        (90, -1.4, 1.55, 1.54),
        (160, -2.85, 1.55, 1.54),
        (180, -3.05, 1.55, 1.54),
        (200, -2.8, 1.55, 1.54),
    ),
    "3d": ((0, 0.0, 0.5, 0.4), (70, 0.0, 1.1, 0.9), (140, 0.0, 1.5, 1.4), (199, 0.0, 1.0, 0.8)),
}

LENGTH: dict[PathName, int] = {name: int(keys[-1][0]) + 1 for name, keys in PATHS.items()}
"""Frames of each path."""

TURN_RAD, TURN_RATE, TURN_PHASE, TURN_OFF_RAD = (
    np.array([0.45, 0.45, 0.3]),
    np.array([0.016, 0.013, 0.01]),
    np.array([0.0, 0.3, 0.0]),
    np.array([0.0, -0.1, 0.0]),
)
"""The attitude in space: amplitude, rad a frame, phase, and what is added."""

MOVE_PX, MOVE_RATE = np.array([10.0, 8.0]), np.array([0.05, 0.04])


def ease(keys: Keys, frame: float) -> Floats:
    """Return the angles (3,) in a frame, rad: between two keys the weight of the later is (1 - cos(pi u)) / 2."""
    last = keys[0]
    for key in keys:
        if frame <= key[0]:
            u = (frame - last[0]) / (key[0] - last[0]) if key[0] > last[0] else 1.0
            weight = 0.5 - 0.5 * float(sines_cosines(np.array([np.pi * u]))[1][0])
            return np.asarray(np.array(last[1:]) + weight * (np.array(key[1:]) - np.array(last[1:])))
        last = key
    return np.array(last[1:])


def turn(frame: float) -> Floats:
    """Return the attitude of the chain in space, a rotation vector (3,) in rad relative to the reference."""
    return np.asarray(TURN_RAD * sines_cosines(TURN_RATE * frame + TURN_PHASE)[0] + TURN_OFF_RAD)


def move(frame: float) -> Floats:
    """Return the motion of its root in the picture (2,), px."""
    return np.asarray(MOVE_PX * sines_cosines(MOVE_RATE * frame)[0])


CHAIN, MEASUREMENTS, START = "Chain", "Measurements", "Where the estimate begins"


class _Chain(OccluderParameters, group=CHAIN):
    """The chain and its path."""

    chain_path: PathName = parameter("mirror3", "Path", live=False)
    """How the joints move; the links of 3d move in space, those of all others in a plane."""
    path_slowing: int = parameter(1, "Slower by", within=(1, 20, 1), live=False)
    """Factor on the duration of the chain's path, and on the frames of its run."""
    true_length_1_px: float = parameter(70, "First link", unit="px", within=(10, 120, 1), live=False)
    """True length of the link at the root."""
    true_length_2_px: float = parameter(60, "Second link", unit="px", within=(10, 120, 1), live=False)
    """True length of the middle link."""
    true_length_3_px: float = parameter(50, "Third link", unit="px", within=(10, 120, 1), live=False)
    """True length of the link at the tip."""


OWN_PATH = {
    "from_1_deg": 40,
    "from_2_deg": 30,
    "from_3_deg": 20,
    "to_1_deg": 70,
    "to_2_deg": 60,
    "to_3_deg": 60,
    "swing_frames": 50,
}
"""Former parameters of a path between two poses that a person chose."""


class _Measured(_Chain, group=MEASUREMENTS, constants={"bounded_noise": True, **OWN_PATH}):
    """How the chain's points are measured."""

    measurement_noise_px: float = parameter(1, "Noise", unit="px", within=(0, 10, 0.1), role="world")
    """Standard deviation of a measured coordinate."""
    links_seen_as: Literal["points", "lines", "lines-and-ends"] = parameter("points", "Links seen as", live=False)
    """Measurements in space: root, joints and tip; or the line on which each link lies, without its ends; or the
    lines, and root and tip. The image of a chain in the plane has one coordinate, and no lines."""
    outlier_share: float = parameter(0, "Outliers", within=(0, 0.5, 0.01), role="world")
    """Share of the measured points that are far off."""
    outlier_px: float = parameter(40, "Size of outliers", unit="px", within=(0, 200, 5))
    """Largest error of such a point; the error is uniform."""


class LinkageSceneParameters(_Measured, group=START):
    """The scene: the chain, how it moves, how its points are measured, and where the estimate begins."""

    start_angle_rad: float = parameter(0, "Angles off by", unit="rad", within=(0, 0.5, 0.01), live=False)
    """Largest initial error of each angle; the error is uniform."""
    start_length_1_px: float = parameter(0, "First length off by", unit="px", within=(-30, 30, 1), live=False)
    """Excess of the first link's initial length."""
    start_length_2_px: float = parameter(0, "Second length off by", unit="px", within=(-30, 30, 1), live=False)
    """Excess of the second link's initial length."""
    start_length_3_px: float = parameter(0, "Third length off by", unit="px", within=(-30, 30, 1), live=False)
    """Excess of the third link's initial length."""


NAMES = ("root", "second joint", "third joint", "tip")
"""Names of the points of a chain; its first joint is the root."""

REFERENCE_RAD = np.array([0.5, -0.4, 0.2])
"""The reference attitude of the simulated chain in space, as a rotation vector."""

RAD_IN_DEG = 180.0 / np.pi

SMALL = 1e-12
"""Angle, rad, below which a rotation is none."""


@dataclass(frozen=True, slots=True)
class LinkageTarget(Target):
    """A chain of three links; `position` is (theta, r), in space (omega, t, theta, r), angles in degrees.

    In the plane its root is fixed at the origin.

    Attributes:
        theta: (3,) angles of the joints, rad, each relative to the link before; in space the first is 0.
        r: (3,) lengths of the links, px.
        omega: (3,) attitude relative to the reference, a rotation vector in rad; None in the plane.
        t: (2,) where the root is, from the origin, px; None in the plane.
        reference: (3, 3) the reference attitude; None in the plane.
        origin_px: (2,) where the origin of image coordinates is in the picture.
    """

    theta: Floats = field(default_factory=lambda: np.zeros(3))
    r: Floats = field(default_factory=lambda: np.zeros(3))
    omega: Floats | None = None
    t: Floats | None = None
    reference: Floats | None = None
    origin_px: Floats = field(default_factory=lambda: np.zeros(2))

    @classmethod
    def of(cls, target: Target) -> "LinkageTarget":
        """Return a target that is a chain.

        Raises:
            TypeError: It is something else.
        """
        if not isinstance(target, cls):
            raise TypeError(f"a tracker of a chain begins at the pose of one, got {type(target).__name__}")
        return target

    @property
    def numbers(self) -> Floats:
        """(theta, r), in space (omega, t, theta, r), rad and px."""
        moved = () if self.omega is None or self.t is None else (self.omega, self.t)
        return np.concatenate([*moved, self.theta, self.r])

    @property
    def is_spatial(self) -> bool:
        """Whether it moves in space rather than in a plane."""
        return self.omega is not None


def in_degrees(numbers: Floats) -> Floats:
    """Return (theta, r), (6,), or (omega, t, theta, r), (11,), with the angles in degrees instead of rad."""
    return np.asarray(numbers * _degrees(len(numbers)))


def in_radians(told: Floats) -> Floats:
    """Return the reverse of `in_degrees`."""
    return np.asarray(told / _degrees(len(told)))


def _degrees(count: int) -> Floats:
    """Return what turns the numbers of an estimate into degrees where they are angles."""
    factors = np.ones(count)
    factors[-6:-3] = RAD_IN_DEG
    if count > 6:
        factors[:3] = RAD_IN_DEG
    return factors


def attitude(omega: Floats) -> Floats:
    """Return the rotation (3, 3) of a rotation vector (3,) in rad (Rodrigues)."""
    angle = float(np.sqrt(np.square(omega).sum()))
    if angle < SMALL:
        return np.eye(3)
    x, y, z = omega / angle
    sine, cosine = (float(one[0]) for one in sines_cosines(np.array([angle])))
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + sine * across + (1.0 - cosine) * product(across, across)


def places(target: LinkageTarget) -> Floats:
    """Return where root, joints and tip are, (4, 3): column and row from the origin, and depth, px.

    In the plane the row is 0, so the depth is the third coordinate in both cases.
    """
    sines, cosines = sines_cosines(np.cumsum(target.theta))
    steps = target.r[:, None] * np.stack([cosines, sines, np.zeros(3)], axis=1)
    chain = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    if target.omega is None or target.t is None or target.reference is None:
        return np.asarray(chain[:, [0, 2, 1]])
    turn = product(target.reference, attitude(target.omega))
    return np.asarray(product(chain, turn.T) + np.append(target.t, 0.0))


# A chain in the plane turns about vertical axes, so the camera sees all of its joints in one row: its links are bars
# that become shorter as they turn away. Positions are in whole sixteenths of a pixel, as OpenCV takes them, so a pose
# has one picture.

LINKS = ((72, 99, 132), (95, 127, 163), (126, 157, 190))
"""Colours of the links, from the root on."""

RADII_PX = (13.0, 11.0, 9.0, 6.5)
"""Widths of the chain at its root, joints and tip."""

EDGE, BOLT, GROUND_TOP, GROUND_BOTTOM = (43, 58, 78), (233, 237, 242), 246.0, 224.0
SOCKET, SOCKET_SIDE_PX = (88, 92, 98), 38.0


def paint(
    points_px: Floats,
    depths: Floats | None,
    size: tuple[int, int],
    parameters: OccluderParameters,
) -> NDArray[np.uint8]:
    """Return a picture (height, width, 3) RGB, read-only.

    Args:
        points_px: (4, 2) of root, joints and tip in the picture.
        depths: (4,) distance of each from the camera; nearer links are in front. None: those further from the root are.
        size: Width and height of the picture, px.
        parameters: The occluder.
    """
    image = _ground(*size).copy()
    _paint_socket(image, points_px[0])
    links = range(len(LINKS))
    order = links if depths is None else sorted(links, key=lambda link: -(depths[link] + depths[link + 1]))
    for link in order:
        _paint_link(image, points_px[link : link + 2], RADII_PX[link : link + 2], LINKS[link])
    paint_strip(image, parameters)
    image.flags.writeable = False
    return image


@lru_cache(maxsize=2)
def _ground(width: int, height: int) -> NDArray[np.uint8]:
    """Return a light ground that darkens downwards."""
    rows = np.linspace(GROUND_TOP, GROUND_BOTTOM, height)
    return np.broadcast_to(np.rint(rows)[:, None, None], (height, width, 3)).astype(np.uint8)


def _paint_socket(image: NDArray[np.uint8], root: Floats) -> None:
    half = np.array([0.5 * SOCKET_SIDE_PX, 0.5 * SOCKET_SIDE_PX])
    low, high = (tuple(map(int, sixteenths(corner))) for corner in (root - half, root + half))
    cv2.rectangle(image, low, high, SOCKET, -1, cv2.LINE_AA, SHIFT)


def _paint_link(image: NDArray[np.uint8], ends: Floats, radii: tuple[float, ...], colour: tuple[int, int, int]) -> None:
    """Paint a link as what a disc sweeps that shrinks on its way, with an edge, and a bolt at its joint."""
    for grown, tone in ((1.5, EDGE), (0.0, colour)):
        wide = [radius + grown for radius in radii]
        cv2.fillConvexPoly(image, sixteenths(_sides(ends, wide)), tone, cv2.LINE_AA, SHIFT)
        for end, radius in zip(ends, wide, strict=True):
            x, y = map(int, sixteenths(end))
            cv2.circle(image, (x, y), round(2**SHIFT * radius), tone, -1, cv2.LINE_AA, SHIFT)
    x, y = map(int, sixteenths(ends[0]))
    for share, tone in ((0.45, EDGE), (0.3, BOLT)):
        cv2.circle(image, (x, y), round(2**SHIFT * share * radii[0]), tone, -1, cv2.LINE_AA, SHIFT)


def _sides(ends: Floats, radii: list[float]) -> Floats:
    """Return the corners (4, 2) of the two tangents that discs at both ends have in common."""
    way = ends[1] - ends[0]
    length = float(np.sqrt(np.square(way).sum()))
    along = way / length if length > 0.0 else np.array([1.0, 0.0])
    sine = float(np.clip((radii[0] - radii[1]) / max(length, 1e-9), -1.0, 1.0))
    across = np.array([-along[1], along[0]]) * np.sqrt(1.0 - sine**2)
    left, right = sine * along + across, sine * along - across
    return np.array(
        [ends[0] + radii[0] * left, ends[1] + radii[1] * left, ends[1] + radii[1] * right, ends[0] + radii[0] * right]
    )


# In a silhouette the axis of an elongated shape is found more easily than its ends. The line of a link is observed by
# its unit normal n and its offset from the picture's corner: n . p = offset for each of its points p. Shimada 1997,
# eqs. 4.9 to 4.11, has (m, rho) with m the difference of the two ends' images; but the length of m is *not* seen, and
# rho must be defined by the normal rather than by m.
#
# Both ends of a link err across its line, independently and as much as measured points do; the line goes through their
# measured places. So a line is known the better the longer its link looks, and the distance of a true end from the
# observed line is never greater than its error: a bound of the errors bounds the distances.

SHORTEST_PX = 1.0
"""A link that looks shorter than this shows no line."""


@dataclass(frozen=True, slots=True, eq=False)
class LinkMeasurements(Measurements):
    """Points of a chain in space, and lines of its links.

    Attributes:
        normals: (3, 2) unit normal of the line of each link; NaN where none was seen.
        offsets_px: (3,) of it, n . p of its points in the picture; NaN where none was seen.
    """

    normals: Floats
    offsets_px: Floats


def observe_lines(points_px: Floats, errors_px: Floats, visible: Bools) -> tuple[Floats, Floats]:
    """Return normals (3, 2) and offsets (3,) of the lines of links; NaN where none is seen.

    Args:
        points_px: (4, 2) true places of root, joints and tip.
        errors_px: (3, 2) measurement errors of the beginning and the end of each link, across it.
        visible: (4,) whether each point is in sight; of a link with a visible end a part is.
    """
    normals, offsets = np.full((len(errors_px), 2), np.nan), np.full(len(errors_px), np.nan)
    for link, (first, last) in enumerate(errors_px):
        beginning, way = points_px[link], points_px[link + 1] - points_px[link]
        length = float(np.sqrt(np.square(way).sum()))
        if length < SHORTEST_PX or not visible[link : link + 2].any():
            continue
        across = np.array([-way[1], way[0]]) / length
        seen = way + (last - first) * across
        normals[link] = np.array([-seen[1], seen[0]]) / np.sqrt(np.square(seen).sum())
        offsets[link] = float((normals[link] * (beginning + first * across)).sum())
    return normals, offsets


FRAME_RATE_HZ = 15.0
PLANE_SIZE_PX, SPACE_SIZE_PX = (480, 240), (480, 400)
"""Width and height of the picture of a chain in the plane, and in space."""

BOUND_SDS = 3.0
"""Noise beyond so many standard deviations is drawn again."""

MOST_DRAWS = 64
"""After so many draws the noise is cut: one in 370 is beyond the bound."""

START_DRAW, LINES_DRAW = 1_000_000, 2_000
"""Numbers of the draws of where the estimate begins, and of the errors of lines, beyond those of the points' noise."""


class LinkageSource:
    """A chain whose root, joints and tip are measured; the root of one in the plane is known and not measured.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: Frames a second at which it is meant to be seen.
        frame_count: Frames of the path.
        start: The first estimate: the truth of frame 0 plus the errors set by the parameters.
        noisy: The measurements depend on the seed.
    """

    noisy = True
    frame_rate_hz = FRAME_RATE_HZ

    def __init__(self, seed: int, parameters: LinkageSceneParameters) -> None:
        """Set the scene; the seed is that of the noise, and of where the estimate begins."""
        self._seed = seed
        self._parameters = parameters
        self.size = SPACE_SIZE_PX if parameters.chain_path == "3d" else PLANE_SIZE_PX
        self.frame_count: int | None = parameters.path_slowing * (LENGTH[parameters.chain_path] - 1) + 1
        self.start: Target = self._start()

    def target(self, index: int) -> LinkageTarget:
        """Return the truth of a frame without hidden values."""
        parameters = self._parameters
        lengths = (parameters.true_length_1_px, parameters.true_length_2_px, parameters.true_length_3_px)
        chain = partial(_chain, np.array(lengths, dtype=np.float64), self.size)
        moment = index / parameters.path_slowing
        theta = ease(PATHS[parameters.chain_path], moment)
        if parameters.chain_path != "3d":
            return chain(theta)
        return chain(theta, turn(moment), move(moment))

    def frame(self, index: int, history: History[LinkageSceneParameters]) -> Frame:
        """Return a frame; the same arguments give the same frame, to the bit."""
        parameters = history.at(index)
        target = self.target(index)
        if target.landmarks is None:
            raise RuntimeError("the points of a simulated chain are known")
        true_px = target.landmarks.points_px
        left, right = strip(parameters, self.size[0])
        visible = ~((left <= true_px[:, 0]) & (true_px[:, 0] < right))
        depths = places(target)[:, 2] if target.is_spatial else None
        image = paint(true_px, depths, self.size, parameters)
        landmarks = replace(target.landmarks, visible=visible)
        target = replace(target, landmarks=landmarks, hidden=not bool(visible[1:].any()))
        first = 0 if target.is_spatial else 1
        measured = self._measure(index, true_px[first:], visible[first:], parameters, spatial=target.is_spatial)
        return Frame(index, index / FRAME_RATE_HZ, image_rgb=image, measurements=measured, target=target)

    def _measure(
        self,
        index: int,
        true_px: Floats,
        visible: Bools,
        parameters: LinkageSceneParameters,
        *,
        spatial: bool,
    ) -> Measurements:
        """Measure points (n, 2); in the plane only across, since the row is the same for all."""
        sd = np.full(true_px.shape, float(parameters.measurement_noise_px))
        points = true_px + sd * self._noise(index, true_px.shape)
        stream = Stream(self._seed, index, Purpose.SCENE)
        chances, ways = stream.random(len(points)), stream.random(points.shape)
        points = points + _outliers(chances, ways, parameters)
        if not spatial:
            points[:, 1], sd[:, 1] = true_px[:, 1], np.inf
        if not spatial or parameters.links_seen_as == "points":
            return measure_points(points, sd, visible)
        measured = visible & False
        if parameters.links_seen_as == "lines-and-ends":
            measured[[0, -1]] = visible[[0, -1]]
        seen = measure_points(points, sd, measured)
        errors = sd[1:] * self._noise(index, (len(points) - 1, 2), LINES_DRAW)
        numbers = uniforms(self._seed, index, Purpose.SCENE.value, LINES_DRAW - 1, 3 * len(errors)).reshape(3, -1)
        errors = errors + _outliers(numbers[0], numbers[1:].T, parameters)
        return LinkMeasurements(seen.points_px, seen.sd_px, *observe_lines(true_px, errors, visible))

    def _noise(self, index: int, shape: tuple[int, ...], first: int = 2) -> Floats:
        """Return standard normal numbers, each drawn again as long as it is beyond the bound."""
        count = int(np.prod(shape))
        # Draws 0 and 1 are the stream's, of outliers.
        draw = partial(standard_normals, self._seed, index, Purpose.SCENE.value)
        numbers = draw(first, count)
        for again in range(first + 1, first + 1 + MOST_DRAWS):
            beyond = np.abs(numbers) > BOUND_SDS
            if not beyond.any():
                break
            numbers = np.where(beyond, draw(again, count), numbers)
        return np.asarray(np.clip(numbers, -BOUND_SDS, BOUND_SDS).reshape(shape))

    def _start(self) -> LinkageTarget:
        true, parameters = self.target(0), self._parameters
        numbers = 2.0 * uniforms(self._seed, 0, Purpose.SCENE.value, START_DRAW, 6) - 1.0
        angles = parameters.start_angle_rad * numbers
        off = (parameters.start_length_1_px, parameters.start_length_2_px, parameters.start_length_3_px)
        lengths = np.maximum(true.r + np.array(off), 1.0)
        if true.omega is None or true.t is None:
            return _chain(lengths, self.size, true.theta + angles[:3])
        # The first angle is part of the attitude.
        return _chain(lengths, self.size, true.theta + angles[:3] * (0, 1, 1), true.omega + angles[3:], true.t)


def _outliers(chances: Floats, ways: Floats, parameters: LinkageSceneParameters) -> Floats:
    """Return the outliers added to measurements (n, 2), given uniform numbers for occurrence (n,) and size (n, 2)."""
    off = (chances < parameters.outlier_share)[:, None]
    return np.where(off, parameters.outlier_px * (2.0 * ways - 1.0), 0.0)


def measure_points(points: Floats, sd: Floats, seen: Bools) -> Measurements:
    """Return points (n, 2) with their deviations, but for those that are not seen (n,)."""
    return Measurements(np.where(seen[:, None], points, np.nan), np.where(seen[:, None], sd, np.inf))


def _chain(
    r: Floats,
    size: tuple[int, int],
    theta: Floats,
    omega: Floats | None = None,
    t: Floats | None = None,
) -> LinkageTarget:
    """Return a chain with the points of it, all of them in sight."""
    reference = None if omega is None else attitude(REFERENCE_RAD)
    origin = np.array(size) / 2.0
    target = LinkageTarget(np.empty(0), theta=theta, r=r, omega=omega, t=t, reference=reference, origin_px=origin)
    at = places(target)
    points = at[:, :2] + origin
    landmarks = Landmarks(points, np.ones(len(NAMES), dtype=np.bool_), at - at[0], NAMES)
    size_px = float(np.ptp(points, axis=0).max())
    return replace(target, position=in_degrees(target.numbers), size=size_px, landmarks=landmarks)
