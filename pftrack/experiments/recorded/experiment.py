"""What others have computed: a loop of one's own, or the results of any tracker, as a run like any.

A recording of beliefs (`pftrack.record`) holds particles, means and covariances or boxes by frame, and perhaps a clip
and a truth. Its tracker takes over what is written. So all that is done with runs is done with it: it is watched frame
by frame, plotted, measured where a truth is given, compared with others in step, and exported.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.calibration import Calibration
from pftrack.core.model.glossary import Term
from pftrack.core.model.marks import Mark
from pftrack.core.model.measures import MEAN_IOU, PICTURE_MEASURES
from pftrack.core.model.parameters import ParameterError, Parameters, parameter, revise
from pftrack.core.model.recipe import Footage
from pftrack.core.model.references import BERNARDIN, Citation
from pftrack.core.model.sequence import FrameSequence
from pftrack.core.model.truth import Truth
from pftrack.experiments.experiment import Experiment, Preset, Setup
from pftrack.experiments.recorded.measures import PLOTS, READINGS, SERIES, boxes_of, measure
from pftrack.experiments.recorded.sketch import LAYERS, draw
from pftrack.experiments.shared.beliefs import TRACKERS
from pftrack.experiments.shared.parameters import loss_share
from pftrack.sources.beliefs.recorded import RecordedBeliefs
from pftrack.sources.beliefs.scene import FRAMES, UNITS, ExampleParameters, ExampleSource
from pftrack.sources.beliefs.selection import SelectionParameters
from pftrack.sources.beliefs.sequence import BeliefSequence

__all__ = ["EXPERIMENT", "ExampleBeliefParameters", "RecordedBeliefParameters"]

SCORING = "Scoring"
MOST_DISTANCE = 100_000


class ScoringParameters(Parameters):
    """When a target counts as lost."""

    # fmt: off
    lost_distance: float = parameter(
        0, "Lost from", "Distance from the truth from which on the target counts as lost, in the unit of the states; 0 "
        "for half the longer side of its true box. Where truths have no box, it begins with how far the true places "
        "lie from the middle of their path, root mean square: one who stays there is wrong by so much.",
        ge=0, le=MOST_DISTANCE, step=1, group=SCORING)
    lost_share: float = loss_share(0.25, group=SCORING)
    # fmt: on


class RecordedBeliefParameters(SelectionParameters, ScoringParameters):
    """What is looked at in a recording."""


class ExampleBeliefParameters(ExampleParameters, ScoringParameters):
    """The example that is made up, and what is looked at in it."""


def simulate() -> Setup:
    """Wire the example that is made up."""
    return Setup(ExampleSource, ExampleBeliefParameters(), units=lambda begun: _units(lambda each: UNITS[each], begun))


def on_video(sequence: FrameSequence, mark: Mark | None, *, start: int = 0, truth: Truth | None = None) -> Setup:
    """Wire a recording of beliefs; nothing needs to be marked.

    Raises:
        ParameterError: It is a recording of something else, there is a mark, or the start is not within it.
    """
    if mark is not None:
        raise ParameterError("mark", mark.kind, "left out: the recording says where its targets are")
    if not isinstance(sequence, BeliefSequence):
        raise ParameterError("footage", sequence.index.kind, "a recording of beliefs")
    known = truth.at if truth else None

    def open_source(_seed: int, parameters: RecordedBeliefParameters) -> RecordedBeliefs:
        return RecordedBeliefs(sequence, parameters, start, known)

    def units(begun: RecordedBeliefParameters) -> dict[str, str]:
        units = _units(sequence.unit_of, begun)
        # States of one component have an estimate of one.
        return units | {"estimate": units["across"]} if sequence.content.dimension == 1 else units

    parameters = RecordedBeliefParameters()
    spread = open_source(0, parameters).true_spread()
    if spread < MOST_DISTANCE:
        parameters = revise(parameters, {"lost_distance": float(f"{spread:.3g}")})
    footage = Footage.of(sequence, None, start, truth).model_copy(update={"labelled": sequence.content.has_truth})
    return Setup(open_source, parameters, footage, units=units)


def _units(unit_of: Callable[[int], str], begun: SelectionParameters) -> dict[str, str]:
    """Return the units of the chosen components, and of the estimate where both have the same."""
    across, down = unit_of(begun.component_across), unit_of(begun.component_down)
    return {"across": across, "down": down, "estimate": across if across == down else ""}


def _distance(estimates: NDArray[np.float64], truths: NDArray[np.float64]) -> Any:  # noqa: ANN401 - one or many
    return np.sqrt(np.square(estimates - truths).sum(axis=-1))


def _is_lost(errors: Any, sizes: Any, parameters: Any) -> Any:  # noqa: ANN401 - one or many, on either model
    beyond = np.where(np.asarray(sizes) > 0, np.asarray(sizes) / 2.0, np.inf)
    limit = parameters.lost_distance or beyond
    return np.asarray(errors) >= limit


EXPERIMENT = Experiment(
    id="recorded",
    title="Recorded results",
    family="Results of others",
    question="Where is a filter of your own, or any other tracker, wrong, and what did it believe there?",
    references=(Citation(BERNARDIN),),
    description=(
        "What a loop or a tracker outside has computed is looked at like any run: particles, Gaussians or boxes, frame "
        "by frame, in the picture or in the plane of two components. Where a truth is given, errors, overlap and "
        "identity switches are measured. The example is made up: two discs that pass each other."
    ),
    unit="",
    trackers=TRACKERS,
    default_tracker="recorded",
    frames=FRAMES,
    presets=(
        Preset(
            "works",
            "works",
            "recorded",
            about=("selected_target", "example_error_px"),
            watch="Watch each target keep its number while the two pass each other at frame 60.",
        ),
        Preset(
            "confused",
            "breaks: numbers change",
            "recorded",
            {"confuse_numbers": True},
            about=("selected_target",),
            watch="Watch the error from frame 60 on: the two have each other's number, and the scrubber marks where.",
        ),
    ),
    layers=LAYERS,
    simulate=simulate,
    on_video=on_video,
    recorded=lambda _kind: RecordedBeliefParameters(),
    footage=("beliefs",),
    advice="Nothing needs to be marked: the recording says where its targets are.",
    boxes=boxes_of,
    draw=draw,
    # Nothing is promised of bands that somebody else has computed.
    calibration=Calibration(bands=()),
    error=_distance,
    lost=_is_lost,
    series=SERIES,
    measure=measure,
    measures=(*PICTURE_MEASURES, MEAN_IOU),
    plots=PLOTS,
    readings=READINGS,
    terms=(
        Term("targets", "how many targets something is said of in the frame"),
        Term("identity switch", "a frame in which a true target has another number of the tracker than before"),
    ),
    clip_about=("selected_target", "component_across", "component_down", "lost_distance"),
)
