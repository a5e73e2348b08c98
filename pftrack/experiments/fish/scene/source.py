"""The simulated tank as a source: frames of one or two goldfish from above, with the truth."""

from pftrack.core.model.frame import Frame, Target
from pftrack.core.model.parameters import ParameterError
from pftrack.core.model.source import History
from pftrack.experiments.fish.scene.painting import develop, floor, paint_fish
from pftrack.experiments.fish.scene.parameters import FishSceneParameters
from pftrack.experiments.fish.scene.swimming import FRAME_RATE_HZ, FRAMES, HEIGHT, WIDTH, clip
from pftrack.experiments.fish.scene.truth import FishTarget
from pftrack.experiments.fish.shape import GOLDFISH, model_points
from pftrack.sources.overlay import paint, strip

__all__ = ["FishSource"]

LOOK_ALIKE = "#eb6928"
"""Colour of the look-alikes: the fish's."""


class FishSource:
    """Ten seconds of a tank.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: 15.
        frame_count: 150.
        start: The followed fish in frame 0.
        noisy: False: all that is random depends on the clip, and not on the seed of a run.
    """

    def __init__(self, seed: int, parameters: FishSceneParameters) -> None:
        """Fill the tank.

        Args:
            seed: Of the run, on which the scene does not depend.
            parameters: In force at frame 0.

        Raises:
            ParameterError: The fish that is to be followed is not there.
        """
        del seed
        if parameters.followed_fish > parameters.fish_count:
            raise ParameterError("followed_fish", parameters.followed_fish, f"at most {parameters.fish_count}")
        self._number = parameters.tank_number
        self._followed = parameters.followed_fish - 1
        self._poses = clip(parameters.tank_number, parameters.fish_count, parameters.lively, parameters.tank)
        self.size = (WIDTH, HEIGHT)
        self.frame_rate_hz = FRAME_RATE_HZ
        self.frame_count: int | None = FRAMES
        self.noisy = False
        self.start: Target = self.target(0, parameters)

    def frame(self, index: int, history: History[FishSceneParameters]) -> Frame:
        """Return the tank at an instant; the same arguments give the same frame, to the bit."""
        parameters = history.at(index)
        picture = floor(self._number, WIDTH, HEIGHT).copy()
        paint_fish(picture, self._poses[index], GOLDFISH)
        image = develop(picture, parameters.image_noise, self._number, index)
        if parameters.occlusion_width_px > 0 or parameters.distracter_radius_px > 0:
            image = image.copy()
            paint(image, parameters, LOOK_ALIKE)
            image.flags.writeable = False
        return Frame(index, index / FRAME_RATE_HZ, image_rgb=image, target=self.target(index, parameters))

    def target(self, index: int, parameters: FishSceneParameters) -> FishTarget:
        """Return the truth of a frame."""
        poses = self._poses[:, self._followed]
        pose, speed = poses[index], poses[max(index, 1), :2] - poses[max(index, 1) - 1, :2]
        left, right = strip(parameters, WIDTH)
        outline = model_points(pose, GOLDFISH)[:, 0]
        hidden = bool(left <= outline.min() and outline.max() < right)
        return FishTarget.of(pose, GOLDFISH, speed, hidden=hidden)
