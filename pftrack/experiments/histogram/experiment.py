"""A window followed by the histogram of its colours (Kagami 2012, after Perez et al. 2002).

The question of the lecture: an object is hidden for a moment, or passes a look-alike; does a cloud of weighted
hypotheses, carried on by a velocity, come out on the right side? The scene is simulated, or any recording on which a
person has drawn a box around the target.
"""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.marks import Box
from pftrack.core.model.measures import MEAN_IOU, PICTURE_MEASURES, held_at_end
from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.recipe import Footage
from pftrack.core.model.setup import WELL, Setup, Suitability
from pftrack.core.model.source import Frame, FrameSequence, Truth
from pftrack.core.numerics.elementary import exponential
from pftrack.experiments.declared import read_quality, read_words
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.histogram.draw import draw
from pftrack.experiments.histogram.model import MODEL, HistogramState
from pftrack.experiments.histogram.parameters import HistogramTrackerParameters, ScoringParameters
from pftrack.experiments.histogram.scene import LawnSceneParameters, LawnSource
from pftrack.experiments.histogram.trackers import TRACKERS
from pftrack.experiments.shared.recording import RecordingParameters, RecordingSource
from pftrack.experiments.shared.reports import JudgedByBox
from pftrack.experiments.shared.sketch import BETTER_BY, beside, distance, frames_of_a_second, looked_at, remark
from pftrack.experiments.video import Video
from pftrack.vision.likelihoods import chromaticity
from pftrack.vision.likelihoods.counting import SPACES, Space
from pftrack.vision.likelihoods.histogram import Window, fit, rho_map
from pftrack.vision.likelihoods.separation import Separation, separation, surroundings

# A recording for the window: whether its target can be followed by its colours, and the values to begin with.
#
# The lawn keeps the values of the lecture: it is the lecture's scene, and what it shows (a sharp likelihood that
# clings, a velocity that carries) would be hidden by what helps on real pictures. Recordings have the best values that
# we know.

SHARPNESS = 50.0
"""Lambda for which the grades were set, of a window without parts; trackers may have another."""
STEPS_A_WINDOW = 6
"""So many places are looked at along the shorter side of a window."""
COARSE_STEPS = 4
"""The same of each frame of a run."""


def suits(sequence: FrameSequence, footage: Footage, parameters: Any) -> Suitability:  # noqa: ANN401 - on either model
    """Compare the target with its surroundings over a second, as the likelihood weighs windows around both.

    Args:
        sequence: The pictures.
        footage: Start, and a box around the target there.
        parameters: Of frame 0.
    """
    view = _View(sequence, footage, parameters)
    chosen = parameters.colour_space, parameters.spatial_kernel
    likelihood, found = view.separation(*chosen)
    value = found.contrast
    return Suitability(
        value,
        f"{remark(value, found)}; {looked_at(sequence, footage.start)}",
        _advice(view, chosen, value) if value < WELL else (),
        None,
        likelihood,
    )


def look_beside(frame: Frame, state: HistogramState, parameters: Any) -> float:  # noqa: ANN401 - on either model
    """Return how likely what is around the estimate is beside the estimate itself, by the colours as they are counted.

    Args:
        frame: The picture.
        state: Of the tracker.
        parameters: In force.
    """
    del parameters  # what counts of them is in the state
    picture, window = frame.picture, state.window
    width, height = state.box_px
    x, y = state.estimate[:2] - np.array([width, height]) / 2
    box = float(x), float(y), width, height
    rows, columns = surroundings(picture.shape, box)
    # Windows at the edge of what is looked at reach beyond it.
    top, left = max(rows.start - window.reach_down_px, 0), max(columns.start - window.reach_across_px, 0)
    seen = picture[top : rows.stop + window.reach_down_px, left : columns.stop + window.reach_across_px]
    step = max(min(window.size_px) // COARSE_STEPS, 1)
    rho = rho_map(np.ascontiguousarray(seen), window, state.space, state.model, step, state.background)
    likelihood = exponential(SHARPNESS * (rho - 1.0))
    return beside(separation(likelihood, (), ((x - left) / step, (y - top) / step, width / step, height / step)))


class _View:
    """A target in the picture in which it is marked, and its place in the second after that."""

    def __init__(self, sequence: FrameSequence, footage: Footage, parameters: Any) -> None:  # noqa: ANN401 - see above
        self._pictures = [sequence.picture(number) for number in frames_of_a_second(sequence, footage.start)]
        self._box = Box.model_validate(footage.mark).corner_and_size
        self._reach = int(parameters.window_width_px) // 2, int(parameters.window_height_px) // 2

    def separation(self, space: Space, kernel: bool) -> tuple[Floats, Separation]:
        """Return the likelihood over the first picture, and how it separates the target, for a way of counting."""
        window = Window(*self._reach, kernel)
        x, y, w, h = self._box
        first, *later = self._pictures
        model = fit(first, np.array([x + (w - 1) / 2, y + (h - 1) / 2]), window, space)
        step = max(min(window.size_px) // STEPS_A_WINDOW, 1)

        def likelihood(picture: NDArray[np.uint8]) -> Floats:
            return exponential(SHARPNESS * (rho_map(picture, window, space, model, step) - 1.0))

        begun = likelihood(first)
        scaled = x / step, y / step, w / step, h / step
        return begun, separation(begun, (likelihood(picture) for picture in later), scaled)


def _advice(view: _View, chosen: tuple[Space, bool], value: float) -> tuple[str, ...]:
    """Say which other way of counting separates better."""
    advice = []
    for space in SPACES:
        for kernel in (False, True):
            if (space, kernel) == chosen:
                continue
            other = view.separation(space, kernel)[1].contrast
            if other >= value + BETTER_BY:
                weighed = "weighing the middle" if kernel else "counting all alike"
                advice.append(f"the colour space {space!r}, {weighed}, separates better ({other:.2f})")
    if not advice:
        advice.append(
            "no other way of counting separates better; the trackers here follow colours alone, so mark something that "
            "differs in its colours from what is around it"
        )
    return tuple(advice)


PICTURES: Mapping[str, Value] = MappingProxyType(
    {
        "sharpness": 70,
        "spatial_kernel": True,
        "parts_across": 2,
        "parts_down": 3,
        "weigh_background": True,
        "surround_contrast": 0.4,
        "follow_size": True,
        "size_noise": 0.012,
        "follow_camera": True,
        "wide_share": 0.1,
    }
)
"""Parts, colours beside their background, contrast, size and camera; each helped on clips that were chosen by."""


FOLDER = Path(__file__).parent

HELD_AT_END = held_at_end()
"""What decides on success: in between the window may wait, or look for its target."""


class SimulatedHistogramParameters(ScoringParameters, HistogramTrackerParameters, LawnSceneParameters):
    """The simulated lawn and its trackers."""


class RecordedHistogramParameters(JudgedByBox, RecordingParameters, HistogramTrackerParameters):
    """A recording with an overlay, and its trackers."""


def simulate() -> Setup:
    """Wire the simulated lawn with its default values."""
    return Setup(LawnSource, SimulatedHistogramParameters(), success=HELD_AT_END.name)


def wire(sequence: FrameSequence, mark: Box, start: int, truth: Truth | None) -> Setup:
    """Wire a recording: the window is the box, and lengths are scaled to it.

    A box holds background in its corners, which differs from place to place, so the middle of the window is weighed
    more, and colours less that are around the target as well; what has an upper and a lower end is counted in parts;
    and real targets and cameras move and turn faster than simulated ones. All of these are starting values: every
    parameter but the window's is live.

    Args:
        sequence: The pictures.
        mark: A box around the target in the picture `start`.
        start: Number of the picture to start at.
        truth: True boxes by number of the picture, where they are known.
    """
    box = mark.corner_and_size
    side = min(box[2:])
    parameters = revise(
        RecordedHistogramParameters(),
        {
            "window_width_px": min(box[2], 1025.0),
            "window_height_px": min(box[3], 1025.0),
            "process_noise_px": min(max(0.06 * side, 0.5), 200.0),
            "large_process_noise_px": min(max(0.2 * side, 1.0), 200.0),
            "velocity_noise_px": min(max(0.03 * side, 0.1), 100.0),
            "initial_velocity_px": min(max(0.15 * side, 1.0), 100.0),
            "gamma_px": min(0.2 * side, 1000.0),
            "gamma_min_px": min(0.15 * side, 1000.0),
            "gamma_max_px": min(0.5 * side, 1000.0),
            **PICTURES,
            "wide_noise_px": min(max(0.35 * side, 1.0), 500.0),
            "distracter_colour": chromaticity.median_colour(sequence.picture(start), box),
        },
    )

    source = RecordingSource(sequence, box, start, truth.at if truth else None)
    return Setup(lambda _seed, _parameters: source, parameters, success="inside_share", beside=look_beside)


EXPERIMENT = Experiment(
    **read_words(FOLDER, TRACKERS),
    id="histogram",
    quality=read_quality(FOLDER, TRACKERS),
    model=MODEL,
    simulate=simulate,
    video=Video(
        wire,
        recorded=lambda _kind: RecordedHistogramParameters(),
        marks=(Box,),
        wanted="a box around the target, which is tracked by its colours",
        suits=suits,
        clip_title="Colours of a window",
        clip_about=("sample_count", "sharpness", "weigh_background", "follow_size", "process_noise_px", "find_again"),
    ),
    draw=draw,
    error=distance,
    lost=lambda errors, sizes, parameters: errors >= parameters.lost_radii * sizes / 2,
    measures=(HELD_AT_END, *PICTURE_MEASURES, MEAN_IOU),
)
