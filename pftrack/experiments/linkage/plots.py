"""What is plotted and written of the frames of a chain, and what is measured of a whole run."""

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.glossary import Term
from pftrack.core.model.measures import EvaluatedRun, Measure, held_at_end
from pftrack.core.model.plot import ERROR, INNOVATION, PARTICLES, SAMPLE_SIZE, STEP_TIME, Plot, Reading

LINKS = 3
LAST_FRAMES = 6
"""Over which Shimada's success of a crossing is judged."""


def _errors(course: EvaluatedRun) -> Floats:
    return course.errors


def _last_errors(course: EvaluatedRun) -> Floats:
    known = np.flatnonzero(~np.isnan(course.errors))
    errors = np.full(len(course.errors), np.nan)
    errors[known[-LAST_FRAMES:]] = course.errors[known[-LAST_FRAMES:]]
    return errors


HELD_AT_END = held_at_end(LAST_FRAMES)
"""Whether a chain came through: in between a wrong hypothesis may be ahead."""

MEASURES = (
    HELD_AT_END,
    Measure(
        "median_direction_error_deg",
        "Median error of the directions",
        "Median over the labelled frames of the greatest error of a link's direction.",
        "median",
        _errors,
        unit="°",
        better="lower",
    ),
    Measure(
        "final_direction_error_deg",
        f"Median error of the last {LAST_FRAMES} frames",
        f"Median over the last {LAST_FRAMES} labelled frames of the greatest error of a link's direction.",
        "median",
        _last_errors,
        unit="°",
        better="lower",
    ),
)


def _length(link: int) -> Plot:
    return Plot(
        f"length-{link}",
        f"length of link {link}",
        "interval",
        "What is believed: two standard deviations, 95 % of particles or all that is not excluded; and the truth.",
        "px",
        (f"length_{link}",),
        truth=f"true_length_{link}",
    )


def _direction(link: int) -> Plot:
    return Plot(
        f"direction-{link}",
        f"direction of link {link}",
        "band",
        "The angle to the image, within two standard deviations; at 0 and 180 the link lies parallel to the image.",
        "°",
        (f"direction_{link}",),
        f"direction_{link}_sd",
        f"true_direction_{link}",
    )


PLOTS = (
    ERROR,
    _length(3),
    Plot(
        "tree",
        "tree of hypotheses",
        "tree",
        "Where hypotheses split and end, and the way back from the most probable one.",
        series=("hypotheses",),
        shown="shown_hypothesis",
    ),
    Plot(
        "contained",
        "truth contained",
        "frequency",
        "Share of the frames so far in which the truth is among what is held possible: 1 of regions as long as motion, "
        "errors and bounds are as said, and no other kind of tracker came before.",
        series=("contained",),
        levels=(1.0,),
        needs_truth=True,
    ),
    _direction(3),
    _length(2),
    _direction(2),
    _length(1),
    _direction(1),
    Plot(
        "count",
        "hypotheses",
        "value",
        "How many hypotheses there are: more after a split, fewer once some are refuted.",
        series=("hypothesis_count",),
    ),
    INNOVATION,
    SAMPLE_SIZE,
)

READINGS = (
    Reading("error", "error"),
    *(Reading(f"length {link}", "interval", "px", f"length_{link}") for link in range(1, LINKS + 1)),
    *(
        Reading(f"direction {link}", "value", "°", f"direction_{link}", f"direction_{link}_sd")
        for link in range(1, LINKS + 1)
    ),
    Reading("bounds cut", "value", series="cut"),
    PARTICLES,
    STEP_TIME,
)

TERMS = (
    Term(
        "length", "of a link of the chain, in the picture's unit; with one camera it shows only in the course of time"
    ),
    Term("direction", "where a link points, as an angle from the axis of the picture"),
    Term("bounds cut", "how much the known bounds have cut off from what is believed"),
    Term("mirror", "two poses of a link that one camera sees alike: towards it and away from it"),
)
