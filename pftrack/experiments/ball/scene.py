"""The simulated ball: a red disc that swings behind an occluder, among distracters of its own colour.

Bando 2007, ch. 3 section 3, with the readings of docs/methods/switching.md: a sinusoid of one hertz, peak to peak 200
px, seen at 30 frames a second in a 320 x 240 picture ("reading A"); a larger picture and amplitude give "reading B". On
request it bounces off four walls instead: even motion with sudden turns. Every parameter is live. The phase is
accumulated over the history, so a change of speed does not make the ball jump.
"""

from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from itertools import product
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.geometry import paint_disc
from pftrack.core.model.marks import Box
from pftrack.core.model.parameters import parameter
from pftrack.core.model.recipe import Footage
from pftrack.core.model.setup import NOT_AT_ALL, WELL, Suitability
from pftrack.core.model.source import Frame, FrameSequence, History, Target
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.ball.model import colour_model
from pftrack.experiments.shared import recording
from pftrack.experiments.shared.reports import PointState
from pftrack.experiments.shared.sketch import BETTER_BY, beside, frames_of_a_second, looked_at, remark
from pftrack.vision.likelihoods import chromaticity
from pftrack.vision.likelihoods.chromaticity import ColourModel
from pftrack.vision.likelihoods.separation import Box as Place
from pftrack.vision.likelihoods.separation import Separation, contrast, separation, surroundings

GROUP = "Scene"

MOST_CLUTTER = 60
CLUTTER_RADII = 0.4, 1.6
"""Radii of the smallest and the largest distracter, as shares of the ball's."""
LEAST_LIGHT = 0.6
"""Light of a distracter, as a share of the ball's."""
CLEARANCE_PX = 2
"""Gap between the ball and the distracters above and below its swing."""

UPRIGHT_SHARE = 0.618
"""Number of vertical bounces of a ball during one horizontal round trip, so its path does not soon repeat."""


class BallSceneParameters(recording.OverlayParameters, group=GROUP):
    """The scene: how the ball moves and what it looks like."""

    occlusion_width_px: float = recording.occlusion_width(40)
    distracter_radius_px: float = recording.distracter_radius(4)
    ball_radius_px: float = parameter(5, "Ball radius", unit="px", within=(1, 60, 0.5), useful=(1, 20))
    """Radius of the ball."""
    ball_path: Literal["swings", "bounces"] = parameter("swings", "Path")
    """Whether the ball swings from side to side, or flies straight on at an even speed and bounces off four walls."""
    amplitude_px: float = parameter(100, "Amplitude", unit="px", within=(0, 960, 1), useful=(0, 160))
    """Reach of the ball to either side of the middle; vertically at most the picture."""
    period_s: float = parameter(1, "Period", unit="s", within=(0.1, 60, 0.1), useful=(0.2, 5), role="world")
    """Time to the other side and back."""
    frame_rate_hz: float = parameter(30, "Frame rate", unit="Hz", within=(1, 240, 1), useful=(5, 120))
    """Frames a second of the simulated camera; fewer make the ball move further between frames."""
    image_noise_sd: float = parameter(
        0, "Pixel noise", unit="grey levels", within=(0, 100, 1), useful=(0, 60), role="world"
    )
    """Standard deviation of the noise on every pixel and channel."""
    clutter_count: int = parameter(0, "Clutter", within=(0, MOST_CLUTTER, 1), role="world")
    """Number of further objects in the ball's colour above and below its swing; each seed has others."""
    ball_colour: str = parameter("#c83232", "Ball colour", colour=True)
    """Colour of the ball and of its look-alikes."""
    background_colour: str = parameter("#646464", "Background colour", colour=True)
    """Colour of everything else."""
    image_width_px: int = parameter(320, "Picture width", unit="px", within=(64, 1920, 2), useful=(64, 640), live=False)
    """Width of the picture."""
    image_height_px: int = parameter(
        240, "Picture height", unit="px", within=(48, 1080, 2), useful=(48, 480), live=False
    )
    """Height of the picture."""


class BallSource:
    """Endless frames of the swinging ball.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: Frames a second.
        frame_count: None; the ball never stops.
        start: The ball at frame 0, a turning point of its path.
        noisy: Whether the scene has pixel noise or clutter, which depends on the seed.
    """

    def __init__(
        self, seed: int, parameters: BallSceneParameters, look_alikes: tuple[tuple[float, float, float], ...] = ()
    ) -> None:
        """Set the scene.

        Args:
            seed: Seed of pixel noise and clutter.
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


def centre(parameters: BallSceneParameters, turns: float) -> tuple[float, float]:
    """Return the ball's position, px, after a number of swings."""
    if parameters.ball_path == "bounces":
        height = parameters.image_height_px / 2
        reach = min(parameters.amplitude_px, max(height - parameters.ball_radius_px, 0.0))
        u = parameters.image_width_px / 2 - parameters.amplitude_px * _zigzag(turns)
        return u, height - reach * _zigzag(UPRIGHT_SHARE * turns + 0.25)
    u = parameters.image_width_px / 2 - parameters.amplitude_px * np.cos(2 * np.pi * turns)
    return float(u), parameters.image_height_px / 2


def _clutter(parameters: BallSceneParameters, chances: Floats) -> list[tuple[float, float, float, float]]:
    """Return u, v and radius, px, and light of the distracters, given numbers uniform in [0, 1), (count, 4)."""
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
    u, v = centre(parameters, turns)
    left, right = recording.strip(parameters, parameters.image_width_px)
    radius = parameters.ball_radius_px
    hidden = left <= u - radius and u + radius < right
    return Target(np.array([u, v]), 2 * radius, hidden=hidden, extent=(2 * radius, 2 * radius))


@lru_cache(maxsize=64)
def _picture(
    parameters: BallSceneParameters, turns: float, look_alikes: tuple[tuple[float, ...], ...]
) -> NDArray[np.uint8]:
    """Draw the scene without noise; two periods of Bando's scene stay in the cache for the next run."""
    image = _ground(parameters.image_width_px, parameters.image_height_px, parameters.background_colour).copy()
    colour = np.array(recording.rgb(parameters.ball_colour))
    for u, v, radius, *light in (*look_alikes, (*centre(parameters, turns), parameters.ball_radius_px)):
        shade = np.rint(colour * (light[0] if light else 1.0)).astype(int).tolist()
        paint_disc(image, u, v, float(radius), tuple(shade))
    recording.paint(image, parameters, parameters.ball_colour)
    image.flags.writeable = False
    return image


@lru_cache(maxsize=4)
def _ground(width: int, height: int, colour: str) -> NDArray[np.uint8]:
    return np.full((height, width, 3), recording.rgb(colour), dtype=np.uint8)


# Whether a target can be followed by its colour: how far its surroundings share it, and what would help.

USUAL_LEVEL = 0.02
"""First background level of a recording."""

PARTS, PART = 5, 0.5
"""Smaller boxes to try: number of places along each side, and their share of a side."""

EITHER = "with which targets were both held and lost"
"""Reason for "no verdict" between the grades."""

FINE_PX, WIDE_PX = 48, 960
"""Largest number of pixels examined along the shorter side of a target, and along the longer side of a picture."""


def suits(sequence: FrameSequence, footage: Footage, parameters: Any) -> Suitability:  # noqa: ANN401 - on either model
    """Compare the target with its surroundings over a second, as the likelihood weighs them.

    Args:
        sequence: The pictures.
        footage: Start, and a box around the target there.
        parameters: Parameters of frame 0.
    """
    box = Box.model_validate(footage.mark).corner_and_size
    view = _View(sequence, footage.start, box)
    model, level = colour_model(parameters), parameters.background_level
    picture = sequence.picture(footage.start)
    every = _every(max(picture.shape), WIDE_PX)
    likelihood = chromaticity.likelihood_map(picture[::every, ::every], model, level)
    alike = separation(likelihood, (), _scale(box, every)).alike
    found = replace(view.separation(model, level), alike=alike)
    value = found.contrast
    advice, better = _advice(view, parameters, value) if value < WELL else ((), None)
    judged = Suitability(value, "", advice, better, likelihood, tells=not NOT_AT_ALL <= value < WELL)
    return replace(judged, remark=f"{remark(judged.grade, found, EITHER)}; {looked_at(sequence, footage.start)}")


def look_beside(frame: Frame, state: PointState, parameters: Any, size_px: tuple[float, float]) -> float:  # noqa: ANN401 - see above
    """Return the likelihood of the estimate's surroundings relative to the estimate, in a picture.

    Args:
        frame: The picture.
        state: State of the tracker.
        parameters: In force.
        size_px: Width and height of the marked target.
    """
    picture, (width, height) = frame.picture, size_px
    x, y = state.estimate[:2] - np.array(size_px) / 2
    box = float(x), float(y), width, height
    rows, columns = surroundings(picture.shape, box)
    every = _every(round(min(size_px)), FINE_PX)
    patch = picture[rows, columns][::every, ::every]
    if patch.size == 0:
        return float("nan")  # the estimate has left the picture
    seen = chromaticity.likelihood_map(patch, colour_model(parameters), parameters.background_level)
    return beside(separation(seen, (), _scale((box[0] - columns.start, box[1] - rows.start, width, height), every)))


class _View:
    """A target and its surroundings, in the marked picture and in the second picture after it.

    On a large target only every n-th pixel is examined, without averaging: a mean of several would have less noise than
    the tracker sees.
    """

    def __init__(self, sequence: FrameSequence, start: int, box: Place) -> None:
        self._sequence, self._start = sequence, start
        self.box = box
        self._every = _every(round(min(box[2:])), FINE_PX)
        rows, columns = surroundings(sequence.size[::-1], box)
        self._corner = columns.start, rows.start
        numbers = frames_of_a_second(sequence, start)
        pictures = (sequence.picture(number)[rows, columns] for number in numbers)
        # Copied, so the whole pictures need not be kept.
        self._first, *self._later = [picture[:: self._every, :: self._every].copy() for picture in pictures]

    def of(self, box: Place) -> "_View":
        """Return the same of another target."""
        return _View(self._sequence, self._start, box)

    def fit(self, part: Place) -> ColourModel:
        """Return the colour of a part of the target.

        Raises:
            ValueError: The part is black.
        """
        return chromaticity.fit(self._first, self._here(part))

    def separation(self, model: ColourModel, level: float, *, quick: bool = False) -> Separation:
        """Return how a model of colour separates the target; if need be quickly, by the first picture alone."""
        first = chromaticity.likelihood_map(self._first, model, level)
        later = [] if quick else [chromaticity.likelihood_map(picture, model, level) for picture in self._later]
        return separation(first, later, self._here(self.box))

    def contrast_of_part(self, part: Place, level: float, *, quick: bool = False) -> float:
        """Return the contrast of a smaller box within the target's, against the surroundings of the whole.

        Args:
            part: The smaller box, px of the picture.
            level: Background level.
            quick: Whether to examine the first picture only.

        Raises:
            ValueError: The part is black.
        """
        model = self.fit(part)
        first = chromaticity.likelihood_map(self._first, model, level)
        on = separation(first, (), self._here(part)).on
        return contrast(on, self.separation(model, level, quick=quick).around)

    def _here(self, box: Place) -> Place:
        """Return a box of the picture in the coordinates of the kept part."""
        x, y, w, h = box
        return _scale((x - self._corner[0], y - self._corner[1], w, h), self._every)


def _every(size: int, most: int) -> int:
    """Return the step that reduces a number of pixels to at most `most`."""
    return max(1, -(-size // most))


def _scale(box: Place, every: int) -> Place:
    x, y, w, h = box
    return x / every, y / every, w / every, h / every


def _advice(view: _View, parameters: Any, value: float) -> tuple[tuple[str, ...], Box | None]:  # noqa: ANN401 - on either model
    """Return advice: another colour model or background level, or a smaller box; and that box."""
    advice = []
    level = parameters.background_level
    for name in {"redness", "chromaticity"} - {parameters.colour_model}:
        model = colour_model(parameters.model_copy(update={"colour_model": name}))
        other = view.separation(model, level).contrast
        if other >= value + BETTER_BY:
            advice.append(f"the colour model {name!r} separates better ({other:.2f})")
    if level > USUAL_LEVEL:
        other = view.separation(colour_model(parameters), USUAL_LEVEL).contrast
        if other >= value + BETTER_BY:
            advice.append(f"a background level of {USUAL_LEVEL:g} separates better ({other:.2f})")
    part, other = _best_part(view, level)
    if other >= value + BETTER_BY:
        # A smaller box has its own surroundings: the rest of the target.
        own = view.of(part)
        other = min(other, own.separation(own.fit(part), level).contrast)
    better = Box.of(*part) if other >= max(value + BETTER_BY, NOT_AT_ALL) else None
    if better is not None:
        advice.append(f"a smaller box separates better ({other:.2f}), {better.width:g} x {better.height:g} px")
    if not advice:
        advice.append(
            "no smaller box separates better; the trackers here follow colour alone, so mark something that differs in "
            "colour from what is around it, or use a method that follows something else"
        )
    return tuple(advice), better


def _best_part(view: _View, level: float) -> tuple[Place, float]:
    """Return the smaller box within the target's that separates best, and its contrast."""
    x, y, w, h = view.box
    width, height = max(round(PART * w), 1), max(round(PART * h), 1)
    across, down = (np.linspace(0.0, side - part, PARTS).round() for side, part in ((w, width), (h, height)))
    best, most = view.box, 0.0
    for left, top in product(across, down):
        part = (x + float(left), y + float(top), float(width), float(height))
        with suppress(ValueError):
            found = view.contrast_of_part(part, level, quick=True)
            best, most = (part, found) if found > most else (best, most)
    return best, view.contrast_of_part(best, level) if most > 0.0 else 0.0
