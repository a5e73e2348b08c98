"""The task of a fit: compute a run from its recipe, and fit numbers of its tracker to what it has seen."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from pftrack.analysis.fitting.found import fit
from pftrack.core.model.recipe import Recipe
from pftrack.experiments.own.code import trust
from pftrack.process import report
from pftrack.runs.opening import make
from pftrack.sources.limits import Limits
from pftrack_server.tasks.functions import Steps, reopen_footage

STEPS = 1000
COMPUTED = 100
"""Of the steps, those that are done when the run is computed."""


@dataclass(frozen=True, slots=True)
class FitOrder:
    """What is to be fitted.

    Attributes:
        recipe: Of the run, as JSON values.
        computed: The last frame that belongs to it.
        position: The frame whose tracker and values are the beginning.
        names: Of the numbers.
        filters: Texts of filters that the run may execute.
    """

    recipe: Mapping[str, Any]
    computed: int
    position: int
    names: tuple[str, ...]
    filters: tuple[str, ...] = ()


def fit_run(order: FitOrder, video: tuple[str, str] | None, limits: Limits) -> Steps:
    """Fit numbers of a run, and return what came of it.

    Args:
        order: What to fit.
        video: Path and index of the upload that the run was made on, if that is here.
        limits: How large its frames may be.
    """
    trust(*order.filters)
    run = make(Recipe.model_validate(order.recipe), open_sequence=partial(reopen_footage, video, limits))
    last = min(order.computed, run.frames - 1)
    for step in run.seeking(last):
        yield COMPUTED * step.diagnostics.frame // max(last, 1), STEPS
    run.seek(min(order.position, last))
    return fit(run, order.names, on_step=_report).as_dict()


def _report(done: int, most: int) -> None:
    report((COMPUTED + (STEPS - COMPUTED) * done // most, STEPS))
