"""What is compared with the truth: boxes by their overlap, numbers by whether they stay with their target."""

from collections.abc import Mapping

import numpy as np

from pftrack.core.model.frame import Frame
from pftrack.core.model.plot import ERROR, SAMPLE_SIZE, SIGMA, Plot, Reading
from pftrack.core.model.series import Reduction, Series, SeriesValue
from pftrack.experiments.shared.beliefs import BeliefState
from pftrack.sources.beliefs.identities import overlap
from pftrack.sources.results.table import Box

__all__ = ["PLOTS", "READINGS", "SERIES", "boxes_of", "measure"]

OVERLAP = Series("overlap", "overlap with the true box")
TRUE_ACROSS, TRUE_DOWN = Series("true_across", "true first component"), Series("true_down", "true second component")
SWITCHED = Series(
    "identity_switches",
    "identity switches",
    role="event",
    colours=("lost",),
    reductions=(Reduction("frames_with_switches", "frames in which a target's number changes", "count"),),
)
SERIES = (OVERLAP, SWITCHED, TRUE_ACROSS, TRUE_DOWN)


def measure(frame: Frame, state: BeliefState) -> Mapping[str, SeriesValue]:
    """Measure the overlap with the true box, the true components, and where numbers change."""
    found: dict[str, SeriesValue] = {}
    target, box = frame.target, state.beliefs.selected.box
    if state.beliefs.truths:
        found[SWITCHED.name] = float(state.beliefs.switches)
    if target is None:
        return found
    found[TRUE_ACROSS.name] = float(target.position[0])
    if len(target.position) > 1:
        found[TRUE_DOWN.name] = float(target.position[1])
    if target.extent is not None and box is not None:
        width, height = target.extent
        corner = target.position[:2] - ((width - 1.0) / 2.0, (height - 1.0) / 2.0)
        found[OVERLAP.name] = overlap(box, np.array([*corner.tolist(), width, height]))
    return found


def boxes_of(state: BeliefState) -> list[Box]:
    """Return the boxes of all targets of a frame."""
    beliefs = state.beliefs
    here = [beliefs.selected, *beliefs.others] if beliefs.present else beliefs.others
    boxes: list[Box] = []
    for one in sorted(here, key=lambda one: one.target):
        if one.box is not None:
            x, y, w, h = one.box.tolist()
            boxes.append(Box(0, one.target, x, y, w, h, one.score))
    return boxes


PLOTS = (
    ERROR,
    Plot(
        "overlap",
        "overlap (IoU)",
        "value",
        "Intersection over union of the believed box and the true one; 1 is the same box, 0 is another place.",
        series=("overlap",),
        needs_truth=True,
    ),
    Plot(
        "across",
        "first component",
        "band",
        "The first chosen component of the estimate within two standard deviations, and its truth.",
        series=("across",),
        sd="across_sd",
        truth="true_across",
    ),
    Plot(
        "down",
        "second component",
        "band",
        "The second chosen component of the estimate within two standard deviations, and its truth.",
        series=("down",),
        sd="down_sd",
        truth="true_down",
    ),
    SAMPLE_SIZE,
    Plot(
        "parents",
        "different parents",
        "value",
        "How many different parents the particles have; where there are few, few pasts are left.",
        series=("unique_ancestors",),
    ),
    SIGMA,
    Plot("targets", "targets", "value", "How many targets something is said of.", series=("targets",)),
)

READINGS = (
    Reading("estimate", "estimate"),
    Reading("error", "error"),
    Reading("sigma", "sigma"),
    Reading("overlap", "value", series="overlap"),
    Reading("particles", "particles"),
    Reading("targets", "value", series="targets"),
)
