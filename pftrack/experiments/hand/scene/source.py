"""The simulated hand as a source: frames of a silhouette, with the truth."""

import math

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame, Target
from pftrack.core.model.source import History
from pftrack.core.numerics.compiled import read_only
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.core.numerics.trigonometry import sines_cosines
from pftrack.experiments.hand.scene.motion import FRAMES, folded_time, pose_at
from pftrack.experiments.hand.scene.painting import paint_silhouette, with_noisy_edge
from pftrack.experiments.hand.scene.parameters import HandSceneParameters
from pftrack.experiments.hand.scene.truth import HandTarget
from pftrack.experiments.hand.shape import MODEL, HandShape, silhouette
from pftrack.sources.overlay import paint, strip

__all__ = ["HandSource", "hand_of"]

WRIST = (0.0, 37.0)
"""Of a hand that is not turned, from the middle of a picture with sides of `SIDE_PX`, px, as in the reference scene."""
SIDE_PX = 200.0
ARM = (MODEL.arm[0], 4.0)
"""Half the forearm's width and its length: beyond the border, however it is turned."""
FRAME_RATE_HZ = 10.0
LOOK_ALIKE = "#e0ac8a"
"""Colour of the look-alikes: the hand's."""


class HandSource:
    """Two or three seconds of a hand.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: 10.
        frame_count: That of the motion, by its speed and passes.
        start: The hand in frame 0.
        noisy: True: the seed gives the hand's proportions and the edge's noise.
    """

    def __init__(self, seed: int, parameters: HandSceneParameters) -> None:
        """Hold the hand up; arguments as for every source."""
        self._seed = seed
        self._motion, self._speed = parameters.motion, parameters.speed
        side = parameters.picture_side_px
        self._scale = parameters.palm_axis_px * side / SIDE_PX
        self._turn = parameters.turn_deg * math.pi / 180.0
        self._model = MODEL.with_changes(side=1.0 if parameters.hand == "right" else -1.0, arm=ARM)
        self._shape = hand_of(seed, parameters.proportions, self._model)
        sines, cosines = sines_cosines(np.array([self._turn]))
        across, down = (offset * side / SIDE_PX for offset in WRIST)
        middle = side / 2.0
        self._wrist = (
            middle + cosines[0] * across + sines[0] * down,
            middle - sines[0] * across + cosines[0] * down,
        )
        self.size = (side, side)
        self.frame_rate_hz = FRAME_RATE_HZ
        steps = (FRAMES[parameters.motion] - 1) * parameters.passes / parameters.speed
        self.frame_count: int | None = math.ceil(steps) + 1
        self.noisy = True
        self.start: Target = self.target(0, parameters)

    def frame(self, index: int, history: History[HandSceneParameters]) -> Frame:
        """Return the hand at an instant; the same arguments give the same frame, to the bit."""
        parameters = history.at(index)
        target = self.target(index, parameters)
        image = self._picture(target, index, parameters)
        return Frame(index, index / FRAME_RATE_HZ, image_rgb=read_only(image), target=target)

    def target(self, index: int, parameters: HandSceneParameters) -> HandTarget:
        """Return the truth of a frame."""
        pose = pose_at(self._motion, folded_time(self._motion, self._speed * index))
        pose[:2] = self._wrist
        # The hand of the other side is the mirror image, which turns the other way.
        pose[2:4] *= self._model.side
        pose[2] += self._turn
        target = HandTarget.of(pose, self._scale, self._shape, self._model)
        left, right = strip(parameters, self.size[0])
        columns = np.append(target.tips[:, 0], pose[0])
        if left <= columns.min() and columns.max() < right:
            return HandTarget.of(pose, self._scale, self._shape, self._model, hidden=True)
        return target

    def _picture(self, target: HandTarget, index: int, parameters: HandSceneParameters) -> NDArray[np.uint8]:
        if parameters.flash_every and index % parameters.flash_every == parameters.flash_every - 1:
            return np.full((self.size[1], self.size[0], 3), 255, np.uint8)
        mask = silhouette(target.pose, target.scale, target.shape, self.size)
        mask = with_noisy_edge(mask, parameters.edge_noise_px, self._seed, index)
        image = paint_silhouette(mask, parameters.image_noise_sd, self._seed, index)
        if parameters.occlusion_width_px > 0 or parameters.distracter_radius_px > 0:
            paint(image, parameters, LOOK_ALIKE)
        return image


def hand_of(seed: int, proportions: float, model: HandShape) -> HandShape:
    """Return the hand of a seed: each finger's lengths and radii differ from the model's by shares of their own.

    Args:
        seed: Of the run.
        proportions: Largest share; they are uniform.
        model: What it differs from.
    """
    lengths, widths = 1.0 + proportions * (2.0 * Stream(seed, 0, Purpose.SCENE).random((2, 5, 1)) - 1.0)
    return model.with_changes(phalanges=lengths * model.phalanges, radii=widths * model.radii)
