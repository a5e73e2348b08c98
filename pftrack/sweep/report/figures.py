"""The figures of a report as pictures: one of each quantity, and two that show them together.

Figures are made directly, without pyplot, so that nothing is kept in global state.
"""

from collections.abc import Callable
from functools import partial

from matplotlib.figure import Figure

from pftrack.core.model.parameters import with_role
from pftrack.sweep.axis import Axis
from pftrack.sweep.quantities import COMMON, Quantity
from pftrack.sweep.report.curves import along, boxes, curves
from pftrack.sweep.report.maps import sheet
from pftrack.sweep.report.study import Study

__all__ = ["figures"]

MOST_BOXES = 16


def figures(study: Study) -> dict[str, Callable[[], Figure]]:
    """Return how to draw each figure that a study has, by the name of its file; no measure can take another's."""
    wanted: dict[str, Callable[[], Figure]] = {}
    several = [axis for axis in study.result.plan.axes if len(axis.values) > 1]
    if several:
        wanted["curves"] = partial(curves, study, several)
    boxed = _boxed_axis(study)
    for quantity in study.quantities:
        if study.y is not None:
            wanted[_file(quantity)] = partial(sheet, study, quantity)
            if quantity.name == "error" and boxed is not None:
                wanted["boxes"] = partial(boxes, study, boxed, quantity)
        elif study.x is not None:
            wanted[_file(quantity)] = partial(along, study, study.x, quantity)
    return wanted


def _file(quantity: Quantity) -> str:
    return quantity.name if quantity.name in COMMON else f"measure-{quantity.name}"


def _boxed_axis(study: Study) -> Axis | None:
    """Return the axis that boxes are drawn over: the number of particles, or the only one with several numbers."""
    several = [axis for axis in study.result.plan.axes if axis.numerical and 1 < len(axis.values) <= MOST_BOXES]
    model = type(study.result.plan.parameters)
    particles = {declaration.name for declaration in with_role(model, "particles")}
    counts = [axis for axis in several if axis.name in particles]
    return counts[0] if counts else several[0] if len(several) == 1 else None
