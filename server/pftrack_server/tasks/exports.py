"""The task of an export: compute a run from its recipe and write it as a file of another kind."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from pftrack.analysis.counterfactuals.report import read_record
from pftrack.analysis.diagnosis.diagnosis import diagnose
from pftrack.analysis.explanation import Explanation
from pftrack.core.model.recipe import Recipe
from pftrack.core.model.setup import find_export
from pftrack.experiments.own.code import trust
from pftrack.output.exports.formats import exporting, exports_of
from pftrack.runs.opening import make
from pftrack.sources.limits import Limits
from pftrack_server.tasks.functions import Steps, reopen_footage


@dataclass(frozen=True, slots=True)
class Order:
    """What is to be written of which run.

    Attributes:
        recipe: Of the run, as JSON values.
        computed: The last frame that belongs to it.
        position: The frame at which it stands.
        export: Name of the export.
        plot: Id of the one plot that a picture shall show; None for all.
        path: Where to.
        filters: Texts of filters that the run may execute.
        what_if: The record of what would have saved it, where that is known.
    """

    recipe: Mapping[str, Any]
    computed: int
    position: int
    export: str
    plot: str | None
    path: str
    filters: tuple[str, ...] = ()
    what_if: Mapping[str, Any] | None = None


def write_export(order: Order, video: tuple[str, str] | None, limits: Limits) -> Steps:
    """Write an export; the first half of the steps computes the run, the second writes it.

    Args:
        order: What to write.
        video: Path and index of the upload that the run was made on, if that is here.
        limits: How large its frames may be.
    """
    trust(*order.filters)
    recipe = Recipe.model_validate(order.recipe)
    run = make(recipe, open_sequence=partial(reopen_footage, video, limits))
    last = min(order.computed, run.frames - 1)
    frames = last + 1
    for step in run.seeking(last):
        yield step.diagnostics.frame + 1, 2 * frames
    run.seek(min(order.position, last))
    if order.what_if is not None:
        report = read_record(order.what_if)
        run.explained = Explanation(diagnose(run, report.loss), report)
    kind = find_export(exports_of(run.experiment), order.export)
    for done, of in exporting(run, Path(order.path), kind, order.plot):
        yield frames + frames * done // of, 2 * frames
    return {}
