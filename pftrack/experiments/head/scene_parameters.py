"""What can be turned in the simulated scene of a driver's head."""

from typing import Literal

from pftrack.core.model.parameters import Parameters, parameter

MOTION, LOOK, COVER = "Head", "Light and camera", "In front of the face"


class _Motion(Parameters, group=MOTION):
    """Who is driving, and how the head moves."""

    person: int = parameter(
        99,
        "Person",
        "Which person drives: the seed with which the face is drawn from the statistics of adult faces.",
        within=(0, 9999, 1),
        useful=(0, 199),
        live=False,
    )
    face: Literal["person", "mean"] = parameter(
        "person",
        "Face",
        "Whether the driver has the face of that person or the mean face, which fits the mean model exactly.",
        live=False,
    )
    speed: float = parameter(
        1.0, "Speed", "How fast the script of motions runs; at 1 it takes 900 frames.", within=(0, 4, 0.1), role="world"
    )
    amplitude: float = parameter(
        1.0,
        "Amplitude",
        "Factor on all angles; at 1 the head turns by 35 degrees and nods and rolls by 25.",
        within=(0, 1.5, 0.05),
    )


class _Look(_Motion, group=LOOK):
    """The light and the camera."""

    sun_strength: float = parameter(
        0.3,
        "Sunlight",
        "Strength of the sun that comes and goes from the side, where the lamp at the camera has 0.72.",
        within=(0, 1, 0.05),
        role="world",
    )
    lamp_strength: float = parameter(
        0.72, "Lamp", "Strength of the near-infrared lamp at the camera.", within=(0, 1.2, 0.02), role="world"
    )
    image_noise_sd: float = parameter(
        3,
        "Pixel noise",
        "Standard deviation of the noise on every pixel.",
        unit="grey levels",
        within=(0, 40, 0.5),
        role="world",
    )
    blur_px: float = parameter(
        0,
        "Blur",
        "How far the lens is out of focus: standard deviation of a Gaussian, in px of a picture 640 px wide.",
        unit="px",
        within=(0, 8, 0.25),
        role="world",
    )
    image_width_px: int = parameter(
        640,
        "Picture width",
        "Width of the picture; its height is three quarters of that, and the view stays the same. What the trackers "
        "assume in px, such as the noise of the features, does not follow it.",
        unit="px",
        within=(160, 1280, 16),
        live=False,
    )


class HeadSceneParameters(_Look, group=COVER):
    """The scene: who is driving, how the head moves, the light, and what passes in front."""

    pillar_width_px: float = parameter(
        0,
        "Pillar width",
        "Width of the vertical pillar in front of everything, in px of a picture 640 px wide.",
        unit="px",
        within=(0, 640, 1),
        useful=(0, 320),
        role="world",
    )
    pillar_offset_px: float = parameter(
        0,
        "Pillar place",
        "Where the middle of the pillar is, to the right of the middle, in px of a picture 640 px wide.",
        unit="px",
        within=(-320, 320, 1),
    )
    hand_cover: float = parameter(
        0,
        "Hand",
        "How far a hand has come up in front of the face, from 0, out of sight, to 1, before the eyes.",
        within=(0, 1, 0.01),
        role="world",
    )
    sunglasses: bool = parameter(
        False, "Sunglasses", "Whether the driver wears glasses that are dark in near-infrared light too."
    )
