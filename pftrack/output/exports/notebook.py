"""Jupyter notebooks: cells of words and of code, as the content of a file; and a run as one.

The notebook of a run has its recipe, the run computed again, a table of its numbers, and plots of them. Nothing that
was computed is carried along, so that a notebook is small and its numbers are made where it runs; a hash of the
estimates tells whether they are the same. A recording is not carried either: the notebook says which it was.
"""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pprint import pformat
from textwrap import indent
from typing import TYPE_CHECKING, Any, Literal

from pftrack.core.model.recipe import Recipe
from pftrack.core.model.series import Plot, PlotKind, SeriesRole
from pftrack.core.version import __version__
from pftrack.experiments.experiment import Experiment
from pftrack.runs.loss_probability import PREFIX
from pftrack.runs.run import Run

if TYPE_CHECKING:
    from jinja2 import Template


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell of a notebook.

    Attributes:
        kind: Whether it holds words or Python.
        source: What it holds.
    """

    kind: Literal["markdown", "code"]
    source: str


def markdown(text: str) -> Cell:
    """Return a cell of words, Markdown with formulas between dollar signs."""
    return Cell("markdown", text)


def code(source: str) -> Cell:
    """Return a cell of Python."""
    return Cell("code", source)


def notebook(cells: Sequence[Cell]) -> bytes:
    """Return a notebook that has not been run, the same bytes for the same cells."""
    # The schema of notebooks is loaded with it, for which only who exports one has to wait.
    import nbformat  # noqa: PLC0415
    from nbformat import v4  # noqa: PLC0415

    make: dict[str, Any] = {"markdown": v4.new_markdown_cell, "code": v4.new_code_cell}
    made = v4.new_notebook(
        cells=[make[cell.kind](cell.source, id=f"cell-{place}") for place, cell in enumerate(cells)],
        metadata={
            "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
            "language_info": {"name": "python"},
        },
    )
    nbformat.validate(made)
    return f"{nbformat.writes(made)}\n".encode()


def run_notebook(run: Run) -> bytes:
    """Return a run, as far as it has been computed, as the content of a Jupyter notebook."""
    tracker = run.experiment.trackers[run.tracker].title
    return notebook(_cells(run.recipe, run.experiment, run.computed, run.estimates_sha256, (), tracker))


def run_cells(
    recipe: Recipe,
    experiment: Experiment,
    last: int | None = None,
    estimates_sha256: str | None = None,
    plots: Collection[str] = (),
) -> tuple[Cell, ...]:
    """Return the cells that compute a run and show its numbers.

    Args:
        recipe: What makes it.
        experiment: The one that it names.
        last: The frame up to which it is computed; the run's own last one if not given.
        estimates_sha256: What the hash of its estimates is to be, where that is known.
        plots: Ids of the plots that are drawn; all if none.
    """
    return _cells(recipe, experiment, last, estimates_sha256, plots)


def _cells(
    recipe: Recipe,
    experiment: Experiment,
    last: int | None,
    estimates_sha256: str | None,
    plots: Collection[str],
    tracker: str = "",
) -> tuple[Cell, ...]:
    """Return the cells of notebook.jinja; with the title of a tracker, they begin with what the run is."""
    name = recipe.footage.name if recipe.footage else ""
    wanted = [plot for plot in experiment.plots if not plots or plot.id in plots]
    told = _template("notebook.jinja").render(
        experiment=experiment,
        recipe=recipe,
        tracker=tracker,
        version=__version__,
        last=last,
        estimates_sha256=estimates_sha256,
        made=indent(pformat(recipe.with_footage(path=None).as_dict(), width=100, sort_dicts=False), "    "),
        footage_name="".join(sign if sign.isprintable() and sign not in "`<>" else "_" for sign in name)
        or "a recording",
        path=repr(name or "recording.mp4"),
        plots=pformat([(_title(plot, experiment), _names(plot, experiment)) for plot in wanted], width=100),
    )
    kinds, sources = CELL.findall(told), CELL.split(told)[2::2]
    return tuple(Cell(kind, source.strip()) for kind, source in zip(kinds, sources, strict=True))


@cache
def _template(name: str) -> "Template":
    from jinja2 import Environment, PackageLoader, StrictUndefined  # noqa: PLC0415 - only who exports has to wait

    folder = PackageLoader("pftrack.output", "exports")
    told = Environment(loader=folder, trim_blocks=True, undefined=StrictUndefined)  # noqa: S701 - it is not HTML
    return told.get_template(name)


CELL = re.compile("^%% (markdown|code)$\n", re.MULTILINE)
"""A line of the template that begins a cell."""


def _title(plot: Plot, experiment: Experiment) -> str:
    unit = plot.unit or (experiment.unit if plot.kind in {"error", "sigma"} else "")
    return f"{plot.title}, {unit}" if unit else plot.title


ROLES: Mapping[PlotKind, tuple[SeriesRole, ...]] = {
    "sample size": ("ess", "particles"),
    "samplers": ("share",),
    "innovation": ("nis", "nis_limit"),
}
"""What kinds of plot read by role."""


def _names(plot: Plot, experiment: Experiment) -> list[str]:
    """Return the names of the columns that a plot is of."""
    roles = ROLES.get(plot.kind, ())
    declared = [series.name for series in experiment.all_series() if series.role and series.role in roles]
    own = [plot.kind] if plot.kind in {"error", "sigma"} else []
    return own + [f"{PREFIX}{name}" for name in (*declared, *plot.series, *((plot.truth,) if plot.truth else ()))]
