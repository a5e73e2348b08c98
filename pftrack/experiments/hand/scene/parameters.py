"""What can be turned in the scene of the simulated hand."""

from typing import Literal

from pftrack.core.model.parameters import parameter
from pftrack.experiments.hand.scene.motion import MotionName
from pftrack.sources.overlay import OverlayParameters

__all__ = ["HandSceneParameters"]

HAND, CAMERA = "Hand", "Camera and light"


class HandSceneParameters(OverlayParameters):
    """The scene: how the hand moves, how it differs from the model, and how well it is seen."""

    # fmt: off
    motion: MotionName = parameter(
        "occlusion", "Motion",
        "What the hand does: it turns at the wrist, bends all fingers, or folds two of them within two frames.",
        live=False, group=HAND)
    speed: float = parameter(
        1.0, "Speed", "How fast it does that; at 1 a motion takes 24 to 30 frames.",
        ge=0.25, le=4, step=0.25, live=False, group=HAND, role="world")
    passes: int = parameter(
        1, "Passes", "How often the motion is gone through, forwards and backwards in turn.",
        ge=1, le=40, step=1, live=False, group=HAND)
    hand: Literal["right", "left"] = parameter(
        "right", "Which hand", "Whose palm is seen: a right hand with the thumb on the right, or a left one.",
        live=False, group=HAND)
    turn_deg: float = parameter(
        0, "Turn", "By how much hand and arm are turned on the screen, counter-clockwise.",
        unit="°", ge=-180, le=180, step=5, live=False, group=HAND)
    palm_axis_px: float = parameter(
        52, "Palm axis", "From the wrist to the middle of the knuckles, in a picture with sides of 200 px.",
        unit="px", ge=20, le=70, step=1, live=False, group=HAND)
    proportions: float = parameter(
        0.04, "Other proportions",
        "By which share lengths and widths of a finger differ at most from those that the trackers expect.",
        ge=0, le=0.2, step=0.01, live=False, group=HAND)
    edge_noise_px: float = parameter(
        0.6, "Edge noise", "Standard deviation of where the edge of the silhouette is seen.",
        unit="px", ge=0, le=4, step=0.1, group=CAMERA, role="world")
    image_noise_sd: float = parameter(
        0, "Pixel noise", "Standard deviation of the noise on every pixel.",
        unit="grey levels", ge=0, le=60, step=1, group=CAMERA, role="world")
    flash_every: int = parameter(
        0, "Flashes", "Every how many frames one is all white, as by a flash of light; 0 for none.",
        unit="frames", ge=0, le=100, step=1, group=CAMERA)
    picture_side_px: int = parameter(
        200, "Picture size", "Width and height of the picture; the hand grows with it.",
        unit="px", ge=120, le=1000, step=20, live=False, group=CAMERA)
    # fmt: on
