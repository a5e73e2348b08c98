"""The simulated ball: a red disc that swings behind an occluder, among distracters of its own colour.

Bando 2007, ch. 3 section 3, with the readings of docs/methods/switching.md: a sinusoid of one hertz, peak to peak
200 px, seen at 30 frames a second in a 320 x 240 picture ("reading A"); a larger picture and amplitude give "reading
B". On request it bounces off four walls instead: motion that is even, and then turns at once. Every parameter is live.
The phase is accumulated over the history, so that a change of speed does not make the ball jump.
"""

from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.geometry import paint_disc
from pftrack.core.model.parameters import parameter
from pftrack.core.model.source import Frame, History, Target
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.shared.recording import (
    OverlayParameters,
    distracter_radius,
    occlusion_width,
    paint,
    rgb,
    strip,
)

GROUP = "Scene"

MOST_CLUTTER = 60
CLUTTER_RADII = 0.4, 1.6
"""Of the least and of the greatest thing that lies about, as shares of the ball's."""
LEAST_LIGHT = 0.6
"""Of such a thing, as a share of the ball's."""
CLEARANCE_PX = 2
"""Between the ball and what lies above and below its swing."""

UPRIGHT_SHARE = 0.618
"""How often a bouncing ball goes up and down in the time to the other side and back: its path does not soon repeat."""


class BallSceneParameters(OverlayParameters, group=GROUP):
    """The scene: how the ball moves and what it looks like."""

    occlusion_width_px: float = occlusion_width(40)
    distracter_radius_px: float = distracter_radius(4)
    ball_radius_px: float = parameter(
        5, "Ball radius", "Radius of the ball.", unit="px", within=(1, 60, 0.5), useful=(1, 20)
    )
    ball_path: Literal["swings", "bounces"] = parameter(
        "swings",
        "Path",
        "Whether the ball swings from side to side, or flies straight on at an even speed and bounces off four walls.",
    )
    amplitude_px: float = parameter(
        100,
        "Amplitude",
        "How far the ball goes to either side of the middle; up and down no further than the picture.",
        unit="px",
        within=(0, 960, 1),
        useful=(0, 160),
    )
    period_s: float = parameter(
        1, "Period", "Time to the other side and back.", unit="s", within=(0.1, 60, 0.1), useful=(0.2, 5), role="world"
    )
    frame_rate_hz: float = parameter(
        30,
        "Frame rate",
        "Frames a second of the simulated camera; fewer make the ball move further between frames.",
        unit="Hz",
        within=(1, 240, 1),
        useful=(5, 120),
    )
    image_noise_sd: float = parameter(
        0,
        "Pixel noise",
        "Standard deviation of the noise on every pixel and channel.",
        unit="grey levels",
        within=(0, 100, 1),
        useful=(0, 60),
        role="world",
    )
    clutter_count: int = parameter(
        0,
        "Clutter",
        "How many more things in the ball's colour lie about, above and below its swing; each seed has others.",
        within=(0, MOST_CLUTTER, 1),
        role="world",
    )
    ball_colour: str = parameter("#c83232", "Ball colour", "Colour of the ball and of its look-alikes.", colour=True)
    background_colour: str = parameter("#646464", "Background colour", "Colour of everything else.", colour=True)
    image_width_px: int = parameter(
        320, "Picture width", "Width of the picture.", unit="px", within=(64, 1920, 2), useful=(64, 640), live=False
    )
    image_height_px: int = parameter(
        240, "Picture height", "Height of the picture.", unit="px", within=(48, 1080, 2), useful=(48, 480), live=False
    )


class BallSource:
    """Endless frames of the swinging ball.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: Frames a second.
        frame_count: None; the ball never stops.
        start: The ball at frame 0, a turning point of its path.
        noisy: Whether there is pixel noise or clutter, which depends on the seed.
    """

    def __init__(
        self, seed: int, parameters: BallSceneParameters, look_alikes: tuple[tuple[float, float, float], ...] = ()
    ) -> None:
        """Set the scene.

        Args:
            seed: Of pixel noise and clutter.
            parameters: In force at frame 0.
            look_alikes: Further discs in the ball's colour, away from the six slots: u, v and radius, px.
        """
        self._seed = seed
        self._look_alikes = look_alikes
        self.size = (parameters.image_width_px, parameters.image_height_px)
        self.frame_rate_hz = parameters.frame_rate_hz
        self.frame_count: int | None = None
        self.start = _target(parameters, 0.0)
        self.noisy = parameters.image_noise_sd > 0 or parameters.clutter_count > 0
        self._chances = Stream(seed, 0, Purpose.SCENE).random((MOST_CLUTTER, 4))

    def frame(self, index: int, history: History[BallSceneParameters]) -> Frame:
        """Return the scene at an instant; the same arguments give the same frame, to the bit."""
        parameters = history.at(index)
        spans = history.spans(index, "frame_rate_hz", "period_s")
        turns = sum(steps / (past.frame_rate_hz * past.period_s) for steps, past in spans)
        time_s = sum(steps / past.frame_rate_hz for steps, past in spans)
        image = _picture(parameters, turns, (*self._look_alikes, *_clutter(parameters, self._chances)))
        if parameters.image_noise_sd > 0:
            noise = Stream(self._seed, index, Purpose.SCENE).standard_normal(image.shape)
            noisy = np.rint(image + parameters.image_noise_sd * noise)
            image = np.clip(noisy, 0, 255).astype(np.uint8)
            image.flags.writeable = False
        return Frame(index, time_s, image_rgb=image, target=_target(parameters, turns))


def _centre(parameters: BallSceneParameters, turns: float) -> tuple[float, float]:
    if parameters.ball_path == "bounces":
        height = parameters.image_height_px / 2
        reach = min(parameters.amplitude_px, max(height - parameters.ball_radius_px, 0.0))
        u = parameters.image_width_px / 2 - parameters.amplitude_px * _zigzag(turns)
        return u, height - reach * _zigzag(UPRIGHT_SHARE * turns + 0.25)
    u = parameters.image_width_px / 2 - parameters.amplitude_px * np.cos(2 * np.pi * turns)
    return float(u), parameters.image_height_px / 2


def _clutter(parameters: BallSceneParameters, chances: Floats) -> list[tuple[float, float, float, float]]:
    """Return u, v and radius, px, and light of what lies about, given numbers uniform in [0, 1), (count, 4)."""
    ball, (least, greatest) = parameters.ball_radius_px, CLUTTER_RADII
    found = []
    for across, along, size, shade in chances[: parameters.clutter_count].tolist():
        radius = ball * (least + (greatest - least) * size)
        gap = ball + radius + CLEARANCE_PX if parameters.ball_path == "swings" else 0.0
        away = (2 * along - 1) * max(parameters.image_height_px / 2 - gap, 0.0)
        v = parameters.image_height_px / 2 + away + (gap if away >= 0 else -gap)
        found.append((parameters.image_width_px * across, v, radius, LEAST_LIGHT + (1 - LEAST_LIGHT) * shade))
    return found


def _zigzag(turns: float) -> float:
    """Return what goes evenly from 1 to -1 and back within a turn."""
    return 4 * abs(turns % 1.0 - 0.5) - 1


def _target(parameters: BallSceneParameters, turns: float) -> Target:
    u, v = _centre(parameters, turns)
    left, right = strip(parameters, parameters.image_width_px)
    radius = parameters.ball_radius_px
    hidden = left <= u - radius and u + radius < right
    return Target(np.array([u, v]), 2 * radius, hidden=hidden, extent=(2 * radius, 2 * radius))


@lru_cache(maxsize=64)
def _picture(
    parameters: BallSceneParameters, turns: float, look_alikes: tuple[tuple[float, ...], ...]
) -> NDArray[np.uint8]:
    """Draw the scene without noise; two periods of Bando's scene stay in the cache for the next run."""
    image = _ground(parameters.image_width_px, parameters.image_height_px, parameters.background_colour).copy()
    colour = np.array(rgb(parameters.ball_colour))
    for u, v, radius, *light in (*look_alikes, (*_centre(parameters, turns), parameters.ball_radius_px)):
        shade = np.rint(colour * (light[0] if light else 1.0)).astype(int).tolist()
        paint_disc(image, u, v, float(radius), tuple(shade))
    paint(image, parameters, parameters.ball_colour)
    image.flags.writeable = False
    return image


@lru_cache(maxsize=4)
def _ground(width: int, height: int, colour: str) -> NDArray[np.uint8]:
    return np.full((height, width, 3), rgb(colour), dtype=np.uint8)
