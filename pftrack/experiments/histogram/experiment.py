"""A window followed by the histogram of its colours (Kagami 2012, after Perez et al. 2002).

The question of the lecture: an object is hidden for a moment, or passes a look-alike; does a cloud of weighted
hypotheses, carried on by a velocity, come out on the right side? The scene is simulated, or any recording on which a
person has drawn a box around the target.
"""

from pathlib import Path
from typing import Any

from pftrack.core.model.marks import Box
from pftrack.core.model.measures import MEAN_IOU, PICTURE_MEASURES, held_at_end
from pftrack.core.model.parameters import revise
from pftrack.core.model.setup import BESIDE, Setup
from pftrack.core.model.source import FrameSequence, Truth
from pftrack.experiments.declared import read_quality, read_words
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.histogram.draw import HISTOGRAM_WORLD, draw
from pftrack.experiments.histogram.model import MODEL
from pftrack.experiments.histogram.parameters import HistogramTrackerParameters, ScoringParameters
from pftrack.experiments.histogram.recording import PICTURES, look_beside, suits
from pftrack.experiments.histogram.scene import LawnSceneParameters, LawnSource
from pftrack.experiments.histogram.trackers import TRACKERS
from pftrack.experiments.shared.recording import RecordingParameters, RecordingSource
from pftrack.experiments.shared.reports import JudgedByBox
from pftrack.experiments.shared.sketch import distance
from pftrack.experiments.video import Video
from pftrack.vision.likelihoods import chromaticity

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

    def open_source(seed: int, parameters: RecordedHistogramParameters) -> RecordingSource:
        del seed, parameters
        return RecordingSource(sequence, box, start, truth.at if truth else None)

    return Setup(
        open_source,
        parameters,
        success="inside_share",
        beside=look_beside,
    )


def _is_lost(errors: Any, sizes: Any, parameters: Any) -> Any:  # noqa: ANN401 - one or many
    return errors >= parameters.lost_radii * sizes / 2


EXPERIMENT = Experiment(
    **read_words(FOLDER),
    id="histogram",
    trackers=TRACKERS,
    quality=read_quality(FOLDER, TRACKERS),
    worlds=(HISTOGRAM_WORLD,),
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
    lost=_is_lost,
    series=(BESIDE,),
    measures=(HELD_AT_END, *PICTURE_MEASURES, MEAN_IOU),
)
