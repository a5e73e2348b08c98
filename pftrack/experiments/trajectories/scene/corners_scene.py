"""The sequence: pictures of wall, book and box, and the corners to be followed."""

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame, Target
from pftrack.core.model.parameters import parameter, revise
from pftrack.core.model.source import History
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.trajectories.scene.corners_motion import (
    BOOK,
    BOX,
    CORNERS_PX,
    FRAMES,
    STEPS,
    WALL,
    SceneMotion,
    shifts_px,
)
from pftrack.experiments.trajectories.scene.corners_textures import (
    LEVEL,
    LINE,
    SIZE_PX,
    WALL_MARGIN_PX,
    book,
    box,
    wall,
)
from pftrack.experiments.trajectories.scene.target import SelectionParameters, TrajectoriesTarget
from pftrack.vision.detection.corners import DetectorParameters, find_corners

__all__ = ["CornerSceneParameters", "CornerSource"]

FRAME_RATE_HZ = 30.0
INSIDE_PX, CLEAR_PX = 12.0, 8.0
"""A corner stays so far from the edge of the picture, and from what may hide it."""

MOST_FOUND = 400
GAIN_NOISE, FLICKER, FLICKER_FRAMES = 0.01, 0.03, 17.0

WALL_GROUP, LIGHT, MOTION = "Wall and book", "Light and noise", "Motion"


class CornerSceneParameters(DetectorParameters, SelectionParameters):
    """The scene: how much alike its corners are, and how the pictures are spoilt."""

    # fmt: off
    wall_pitch_px: int = parameter(
        11, "Lattice pitch", "From one line of the wall's lattice to the next: so far away is the nearest look-alike.",
        unit="px", ge=5, le=40, step=1, live=False, group=WALL_GROUP)
    wall_contrast: float = parameter(
        75, "Lattice contrast", "How much darker than the wall its lines are, in grey levels.",
        ge=0, le=150, step=1, group=WALL_GROUP)
    false_corners: int = parameter(
        6, "False corners", "How many points of the book's slanted line are followed, where one place is like another.",
        ge=0, le=12, step=1, live=False, group=WALL_GROUP)
    image_noise_sd: float = parameter(
        5, "Picture noise", "Standard deviation of the noise of each pixel, in grey levels.",
        ge=0, le=40, step=0.5, group=LIGHT, role="world")
    gain_jump: float = parameter(
        0.11, "Jump of the light", "By how much of itself the light is now and then stronger or weaker for a frame.",
        ge=0, le=0.5, step=0.01, group=LIGHT, role="world")
    gain_jump_share: float = parameter(
        0.12, "Share of frames with a jump", "How often the light jumps.", ge=0, le=1, step=0.01, group=LIGHT)
    scene_speed: float = parameter(
        1, "Speed", "How fast wall, book and box move, relative to the sequence of the study.",
        ge=0, le=4, step=0.1, group=MOTION, role="world")
    # fmt: on


class CornerSource:
    """Endless frames of wall, book and box.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: 30.
        frame_count: None; what has drifted for 60 frames drifts back.
        start: The truth of frame 0, with the corners to be followed.
        noisy: The frames depend on the seed.
        points_px: (K, 2) the same corners, in frame 0.
    """

    size = SIZE_PX
    frame_rate_hz = FRAME_RATE_HZ
    frame_count: int | None = None
    noisy = True

    def __init__(self, seed: int, parameters: CornerSceneParameters) -> None:
        """Paint the scene, and find its corners in frame 0.

        Raises:
            ValueError: There is none that is seen in all of the first 60 frames.
        """
        self._seed = seed
        history = History(((0, parameters),))
        self.points_px = self._corners(self._grey(0, history), parameters)
        if not len(self.points_px):
            raise ValueError(
                f"no corner of frame 0 stays in sight for {FRAMES} frames; expected at least one, "
                f"which a lower least strength may find, got {parameters.corner_quality:g}"
            )
        self._since = np.zeros(len(self.points_px), np.int64)
        self.start: Target = self._target(0, history)

    def frame(self, index: int, history: History[CornerSceneParameters]) -> Frame:
        """Return a frame; the same arguments give the same frame, to the bit."""
        image = np.repeat(self._grey(index, history)[:, :, None], 3, axis=2)
        image.flags.writeable = False
        return Frame(index, index / FRAME_RATE_HZ, image_rgb=image, target=self._target(index, history))

    def motion(self, index: int, history: History[CornerSceneParameters]) -> SceneMotion:
        """Return how all points of the scene have moved up to a frame."""
        return SceneMotion(shifts_px(_phases(index, history)))

    def _target(self, index: int, history: History[CornerSceneParameters]) -> TrajectoriesTarget:
        motion = self.motion(index, history)
        now = motion.path(self.points_px, index, self._since)
        selected = history.at(index).selected_track % len(now)
        hidden = bool(motion.hidden(self.points_px, index, 0.0)[selected])
        return TrajectoriesTarget(now[selected], hidden=hidden, motion=motion, start_px=self.points_px)

    def _grey(self, index: int, history: History[CornerSceneParameters]) -> NDArray[np.uint8]:
        parameters = history.at(index)
        shifts = shifts_px(_phases(index, history)[-1:])[0]
        lattice = wall(self._seed, parameters.wall_pitch_px, parameters.wall_contrast)
        grey, _ = _move(lattice, shifts[0] - WALL_MARGIN_PX)
        for surface, texture in ((BOX, box(self._seed)), (BOOK, book(self._seed))):
            light, share = _move(texture, CORNERS_PX[surface] + shifts[surface])
            grey = grey * (1.0 - share) + light
        stream = Stream(self._seed, index, Purpose.SCENE)
        unsteady, (often, sign) = stream.standard_normal(), stream.random(2)
        gain = 1.0 + FLICKER * float(np.sin(2.0 * np.pi * index / FLICKER_FRAMES)) + GAIN_NOISE * unsteady
        if often < parameters.gain_jump_share:
            gain += parameters.gain_jump if sign < 0.5 else -parameters.gain_jump
        noise = stream.standard_normal(grey.shape)
        noisy = np.rint(gain * grey + parameters.image_noise_sd * noise)
        return np.asarray(np.clip(noisy, 0, 255), np.uint8)

    def _corners(self, grey: NDArray[np.uint8], parameters: CornerSceneParameters) -> NDArray[np.float64]:
        """Return the corners to be followed: those that stay in sight, and points of the slanted line."""
        (x0, y0), (x1, y1) = LINE
        shares = (np.arange(parameters.false_corners) + 0.5) / max(parameters.false_corners, 1)
        line = CORNERS_PX[BOOK] + np.column_stack([x0 + shares * (x1 - x0), y0 + shares * (y1 - y0)])
        found = find_corners(grey, revise(parameters, {"corner_count": MOST_FOUND}))
        motion = SceneMotion(shifts_px(np.arange(float(FRAMES))))
        points = np.concatenate([np.rint(line), found])
        kept = np.ones(len(points), np.bool_)
        for index in range(FRAMES):
            now = motion.path(points, index, np.zeros(len(points), np.int64))
            kept &= ((now >= INSIDE_PX) & (now <= np.array(SIZE_PX) - 1.0 - INSIDE_PX)).all(axis=1)
            kept &= ~motion.hidden(points, index, CLEAR_PX)
        chosen = np.flatnonzero(kept)[_of_all_surfaces(points[kept], motion, parameters.corner_count)]
        # Points of the line before others of the book where not all can be followed, but behind all others.
        return points[chosen[np.argsort(chosen < len(line), kind="stable")]]


def _of_all_surfaces(points: NDArray[np.float64], motion: SceneMotion, most: int) -> NDArray[np.int64]:
    """Return the numbers of at most so many points, a third of them on each surface if there are, the first ones."""
    surfaces = motion.surfaces(points, np.zeros(len(points), np.int64))
    order = [np.flatnonzero(surfaces == surface) for surface in (WALL, BOX, BOOK)]
    share = -(-most // len(order))
    rest = np.sort(np.concatenate([numbers[share:] for numbers in order]))
    left = max(most - sum(min(len(numbers), share) for numbers in order), 0)
    return np.concatenate([*(numbers[:share] for numbers in order), rest[:left]])[:most]


def _phases(index: int, history: History[CornerSceneParameters]) -> NDArray[np.float64]:
    """Return the phases of frames 0..index."""
    steps = [np.full(count, parameters.scene_speed) for count, parameters in history.spans(index)]
    return np.cumsum(np.concatenate([[0.0], *steps]))


def _move(
    texture: NDArray[np.int32], corner_px: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what a texture shows in each pixel of the picture, and its share, if its corner is between pixels."""
    width, height = SIZE_PX
    corner = np.rint(STEPS * corner_px).astype(np.int64)
    (left, top), (right_part, lower_part) = corner // STEPS, corner % STEPS
    rows, columns = texture.shape
    light, share = np.zeros((height, width), np.int64), np.zeros((height, width), np.int64)
    for down, tall in ((0, STEPS - lower_part), (1, lower_part)):
        for across, wide in ((0, STEPS - right_part), (1, right_part)):
            y, x = top + down, left + across
            first, last = max(y, 0), min(y + rows, height)
            near, far = max(x, 0), min(x + columns, width)
            if first < last and near < far:
                part = texture[first - y : last - y, near - x : far - x]
                light[first:last, near:far] += tall * wide * part
                share[first:last, near:far] += tall * wide
    whole = float(STEPS * STEPS)
    return light / (whole * LEVEL), share / whole
