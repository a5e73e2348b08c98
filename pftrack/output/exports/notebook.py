"""Jupyter notebooks: cells of words and of code, as the content of a file; and a run as one.

The notebook of a run has its recipe, the run computed again, a table of its numbers, and plots of them. Nothing that
was computed is carried along, so that a notebook is small and its numbers are made where it runs; a hash of the
estimates tells whether they are the same. A recording is not carried either: the notebook says which it was.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pprint import pformat
from typing import Any, Literal

from pftrack.core.model.plot import Plot, PlotKind
from pftrack.core.model.recipe import Footage, Recipe
from pftrack.core.model.series import SeriesRole
from pftrack.core.version import __version__
from pftrack.experiments.experiment import Experiment
from pftrack.runs.loss_probability import PREFIX
from pftrack.runs.run import Run


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
    experiment = run.experiment
    tracker = experiment.trackers[run.tracker].title
    words = (
        f"# {experiment.title}\n\n{experiment.question}\n\n{tracker}, seed {run.seed}, frames 0 to {run.computed}.\n\n"
        f"This notebook computes the run again. It was exported by pftrack {__version__}, and needs that "
        "(`pip install pftrack`)."
    )
    return notebook((markdown(words), *run_cells(run.recipe, experiment, run.computed, run.estimates_sha256)))


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
    return tuple(_cells(recipe, experiment, last, estimates_sha256, plots))


def _cells(
    recipe: Recipe, experiment: Experiment, last: int | None, estimates_sha256: str | None, plots: Collection[str]
) -> Iterator[Cell]:
    yield markdown("## The run\n\nIts recipe is all that makes it: change a value and run the cells below again.")
    made = pformat(recipe.with_footage(path=None).as_dict(), width=100, sort_dicts=False)
    yield code(f"from pftrack.core.model.recipe import Recipe\n\nrecipe = Recipe.read(\n{_indent(made)}\n)")
    if recipe.footage is not None:
        yield markdown(_words_of(recipe.footage))
        yield code(RECORDING.format(name=recipe.footage.name or "recording.mp4"))
    else:
        yield code("from pftrack.runs.opening import make\n\nrun = make(recipe)")
    yield code("step = run.finish()" if last is None else f"step = run.seek({last})")
    if estimates_sha256 is not None:
        yield code(SAME.format(sha256=estimates_sha256))
    yield markdown(
        "## Its numbers\n\nColumns have one row a frame. What every frame has comes under its own name, what tracker "
        "and experiment have measured beside it as `series_...`. What is not known is NaN; 1 is true."
    )
    yield code(TABLE)
    wanted = [plot for plot in experiment.plots if not plots or plot.id in plots]
    listed = pformat([(_title(plot, experiment), _names(plot, experiment)) for plot in wanted], width=100)
    yield code(PLOTS.replace("LISTED", listed))


RECORDING = """
from pathlib import Path

from pftrack.runs.opening import make
from pftrack.sources.sequence import open_sequence

recording = Path({name!r})  # where it lies here
run = make(recipe, open_sequence=lambda footage: open_sequence(recording, square=footage.square))
""".strip()

SAME = """
expected = "{sha256}"
if run.estimates_sha256 == expected:
    print("The same estimates as in the run that was exported.")
else:
    print("Other estimates than in the run that was exported: recipe, pftrack or kind of processor is another.")
""".strip()

TABLE = """
from pftrack.runs.loss_probability import columns_of

columns = columns_of(run)
shown = {name: column for name, column in columns.items() if column.shape == (run.computed + 1,)}
del shown["step_ms"]  # which is another every time
print("  ".join(f"{name:>9}" for name in shown))
for row in range(0, len(columns["frame"]), max(1, len(columns["frame"]) // 20)):
    print("  ".join(f"{column[row]:>{max(len(name), 9)}.5g}" for name, column in shown.items()))
""".strip()

PLOTS = """
import matplotlib.pyplot as plt
from pftrack.core.model.palette import COLOURS, hexadecimal

plots = LISTED

frames = columns["frame"]
plots = [(title, [name for name in names if name in columns]) for title, names in plots]
plots = [(title, names) for title, names in plots if names]
figure, panels = plt.subplots(
    len(plots), sharex=True, squeeze=False, figsize=(9, 2 * len(plots)), layout="constrained"
)
for panel, (title, names) in zip(panels[:, 0], plots):
    for name in names:
        panel.plot(frames, columns[name].reshape(len(frames), -1), label=name)
    for name in ("hidden", "lost"):
        where, colour = columns[name] == 1, hexadecimal(COLOURS[name])
        panel.fill_between(frames, 0, 1, where, transform=panel.get_xaxis_transform(), color=colour, alpha=0.2, lw=0)
    panel.set_title(title, loc="left")
panels[-1, 0].set_xlabel("frame; grey where the target is hidden, red where it is lost")
plt.show()
""".strip()


def _words_of(footage: Footage) -> str:
    name = "".join(sign if sign.isprintable() and sign not in "`<>" else "_" for sign in footage.name) or "a recording"
    content = f", whose content has the SHA-256 `{footage.sha256}`" if footage.sha256 else ""
    return (
        f"The run was made on `{name}`{content}. The recording is not part of this notebook: say below where it lies. "
        "Another one is refused. What is marked in it, and what is known to be true, is part of the recipe."
    )


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


def _indent(text: str) -> str:
    return "\n".join(f"    {line}" for line in text.splitlines())
