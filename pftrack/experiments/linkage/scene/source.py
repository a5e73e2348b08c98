"""The measured points of a chain, frame by frame, and a picture of it."""

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame, Landmarks, Measurements, Target
from pftrack.core.model.source import History
from pftrack.core.numerics.random import Purpose, Stream, standard_normals, uniforms
from pftrack.experiments.linkage.scene.lines import LinkMeasurements, observe_lines
from pftrack.experiments.linkage.scene.painting import paint
from pftrack.experiments.linkage.scene.parameters import LinkageSceneParameters
from pftrack.experiments.linkage.scene.paths import LENGTH, PATHS, ease, move, swinging, turn
from pftrack.experiments.linkage.scene.truth import NAMES, REFERENCE_RAD, LinkageTarget, attitude, in_degrees, places
from pftrack.sources.overlay import strip

__all__ = ["FRAME_RATE_HZ", "PLANE_SIZE_PX", "SPACE_SIZE_PX", "LinkageSource"]

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
        start: Where the estimate begins: off the truth of frame 0 by what the parameters say.
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
        """Return the truth of a frame, of which nothing is hidden."""
        parameters = self._parameters
        lengths = (parameters.true_length_1_px, parameters.true_length_2_px, parameters.true_length_3_px)
        chain = partial(_chain, np.array(lengths, dtype=np.float64), self.size)
        moment = index / parameters.path_slowing
        if parameters.chain_path == "own":
            one = np.deg2rad((parameters.from_1_deg, parameters.from_2_deg, parameters.from_3_deg))
            other = np.deg2rad((parameters.to_1_deg, parameters.to_2_deg, parameters.to_3_deg))
            return chain(swinging(one, other, parameters.swing_frames, moment))
        theta = ease(PATHS[parameters.chain_path], moment)
        if parameters.chain_path != "3d":
            return chain(theta)
        return chain(theta, turn(moment), move(moment))

    def frame(self, index: int, history: History[LinkageSceneParameters]) -> Frame:
        """Return a frame; the same arguments give the same frame, to the bit."""
        parameters = history.at(index)
        target = self.target(index)
        if target.landmarks is None:
            raise RuntimeError("a simulated chain knows its points")
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
        true_px: NDArray[np.float64],
        visible: NDArray[np.bool_],
        parameters: LinkageSceneParameters,
        *,
        spatial: bool,
    ) -> Measurements:
        """Measure points (n, 2); in the plane only across, since the row is the same for all."""
        sd = np.full(true_px.shape, float(parameters.measurement_noise_px))
        points = true_px + sd * self._noise(index, true_px.shape, bounded=parameters.bounded_noise)
        stream = Stream(self._seed, index, Purpose.SCENE)
        chances, ways = stream.random(len(points)), stream.random(points.shape)
        points = points + _outliers(chances, ways, parameters)
        if not spatial:
            points[:, 1], sd[:, 1] = true_px[:, 1], np.inf
        if not spatial or parameters.links_seen_as == "points":
            return _measurements(points, sd, visible)
        measured = visible & False
        if parameters.links_seen_as == "lines-and-ends":
            measured[[0, -1]] = visible[[0, -1]]
        seen = _measurements(points, sd, measured)
        errors = sd[1:] * self._noise(index, (len(points) - 1, 2), LINES_DRAW, bounded=parameters.bounded_noise)
        numbers = uniforms(self._seed, index, Purpose.SCENE.value, LINES_DRAW - 1, 3 * len(errors)).reshape(3, -1)
        errors = errors + _outliers(numbers[0], numbers[1:].T, parameters)
        return LinkMeasurements(seen.points_px, seen.sd_px, *observe_lines(true_px, errors, visible))

    def _noise(self, index: int, shape: tuple[int, ...], first: int = 2, *, bounded: bool) -> NDArray[np.float64]:
        """Return standard normal numbers, each drawn again as long as it is beyond the bound."""
        count = int(np.prod(shape))
        # Draws 0 and 1 are the stream's, of outliers.
        draw = partial(standard_normals, self._seed, index, Purpose.SCENE.value)
        numbers = draw(first, count)
        for again in range(first + 1, first + 1 + MOST_DRAWS):
            beyond = np.abs(numbers) > BOUND_SDS
            if not (bounded and beyond.any()):
                break
            numbers = np.where(beyond, draw(again, count), numbers)
        return (np.clip(numbers, -BOUND_SDS, BOUND_SDS) if bounded else numbers).reshape(shape)

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


def _outliers(
    chances: NDArray[np.float64], ways: NDArray[np.float64], parameters: LinkageSceneParameters
) -> NDArray[np.float64]:
    """Return what is added to measurements (n, 2), given uniform numbers of whether (n,) and how far (n, 2)."""
    off = (chances < parameters.outlier_share)[:, None]
    return np.where(off, parameters.outlier_px * (2.0 * ways - 1.0), 0.0)


def _measurements(points: NDArray[np.float64], sd: NDArray[np.float64], seen: NDArray[np.bool_]) -> Measurements:
    """Return points (n, 2) with their deviations, but for those that are not seen (n,)."""
    return Measurements(np.where(seen[:, None], points, np.nan), np.where(seen[:, None], sd, np.inf))


def _chain(
    r: NDArray[np.float64],
    size: tuple[int, int],
    theta: NDArray[np.float64],
    omega: NDArray[np.float64] | None = None,
    t: NDArray[np.float64] | None = None,
) -> LinkageTarget:
    """Return a chain with the points of it, all of them in sight."""
    position = np.concatenate([theta, r] if omega is None or t is None else [omega, t, theta, r])
    reference = None if omega is None else attitude(REFERENCE_RAD)
    origin = np.array(size) / 2.0
    target = LinkageTarget(
        in_degrees(position), theta=theta, r=r, omega=omega, t=t, reference=reference, origin_px=origin
    )
    at = places(target)
    points = at[:, :2] + origin
    landmarks = Landmarks(points, np.ones(len(NAMES), dtype=np.bool_), at - at[0], NAMES)
    return replace(target, size=float(np.ptp(points, axis=0).max()), landmarks=landmarks)
