"""A run as files: its table as CSV, Parquet, NPZ and JSON Lines, boxes in other forms, and films.

Tables are written piece by piece, so memory never holds the whole text of a long run. Boxes, believed and true, are in
the forms of `pftrack.sources.results`.
"""

import json
import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from pprint import pformat
from textwrap import indent
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.faults import without_faults
from pftrack.core.model.recipe import Recipe
from pftrack.core.model.series import Plot, PlotKind, SeriesRole
from pftrack.core.model.tracker import Diagnostics
from pftrack.core.refusal import ConflictError
from pftrack.core.version import __version__
from pftrack.experiments.experiment import Experiment
from pftrack.runs.loss_probability import PREFIX
from pftrack.runs.manifest import embed, extent_of, title_of
from pftrack.runs.run import Run
from pftrack.runs.scoring import extent_series
from pftrack.runs.table import clouds_of, columns_in, table_of
from pftrack.sources.results.table import Box, Form
from pftrack.sources.results.writing import write_results

if TYPE_CHECKING:
    from jinja2 import Template

MEMBER = "manifest"
"""Name of the manifest among the members of an NPZ file."""

METADATA = b"pftrack"
"""Key of the manifest in the metadata of a Parquet file."""

PIECE_FRAMES = 5_000

Steps = Iterator[tuple[int, int]]
"""(frames written, of all)."""


def csv_of(run: Run, path: Path) -> Steps:
    """Write a run's table as CSV, a line of names first; what is not known is empty."""
    from pyarrow import csv  # noqa: PLC0415 - see `table_of`

    table = table_of(run)
    with csv.CSVWriter(str(path), table.schema, write_options=csv.WriteOptions(quoting_style="needed")) as file:
        for batch in table.to_batches(PIECE_FRAMES):
            file.write_batch(batch)
            yield _first(batch) + batch.num_rows, table.num_rows


def parquet_of(run: Run, path: Path) -> Steps:
    """Write a run's table as Parquet, with the manifest in its metadata, and title and unit in those of each column."""
    from pyarrow import parquet  # noqa: PLC0415 - see `table_of`

    table = table_of(run)
    schema = table.schema.with_metadata({METADATA: embed(run).encode()})
    with parquet.ParquetWriter(path, schema, compression="zstd") as file:
        for batch in table.replace_schema_metadata(schema.metadata).to_batches(PIECE_FRAMES):
            file.write_batch(batch)
            yield _first(batch) + batch.num_rows, table.num_rows


def npz_of(run: Run, path: Path) -> Steps:
    """Write a run's table as NPZ, an array (L,) a column, and the manifest as the text `manifest`."""
    arrays: dict[str, Any] = {MEMBER: np.array(embed(run)), **{it.name: it.values for it in columns_in(run)}}
    with path.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)
    yield run.computed + 1, run.computed + 1


def cloud_npz_of(run: Run, path: Path) -> Steps:
    """Write the particles of all frames as NPZ, as `pftrack.runs.table.clouds_of` has them, and the manifest.

    Raises:
        ConflictError: It has no boxes.
    """
    clouds = clouds_of(run)
    if not clouds:
        raise ConflictError(f"{run.tracker} has no particles")
    with path.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **{MEMBER: np.array(embed(run))}, **clouds)
    yield run.computed + 1, run.computed + 1


def json_lines_of(run: Run, path: Path) -> Steps:
    """Write a run's table as JSON Lines, an object a frame; a number that is not known or not finite is null."""
    table = table_of(run)
    with path.open("w", encoding="ascii", newline="\n") as file:
        for batch in table.to_batches(PIECE_FRAMES):
            file.writelines(f"{json.dumps(_plain(row), allow_nan=False)}\n" for row in batch.to_pylist())
            yield _first(batch) + batch.num_rows, table.num_rows


def _first(batch: Any) -> int:  # noqa: ANN401 - pyarrow has no types
    return int(batch.column("frame")[0].as_py())


def _plain(row: dict[str, Any]) -> dict[str, Any]:
    return {name: value if value is not None and math.isfinite(value) else None for name, value in row.items()}


def believed_file(run: Run, form: Form) -> bytes:
    """Return the boxes that the tracker believes in, of all frames computed; those of a clip count as in the clip.

    Raises:
        ConflictError: It believes in none.
    """
    boxes = _of_states(run) if run.experiment.boxes is not None else _of_rows(run)
    return _file(run, form, boxes, "no frame has a believed box")


def true_file(run: Run, form: Form) -> bytes:
    """Return the true boxes of all frames computed.

    Raises:
        ConflictError: None is known.
    """
    boxes = [
        _box(_number(run, row.frame), row.truth, row.extent) for row in run.diagnostics if row.truth and row.extent
    ]
    return _file(run, form, boxes, "no frame has a true box")


def _file(run: Run, form: Form, boxes: list[Box], nothing: str) -> bytes:
    if not boxes:
        raise ConflictError(nothing)
    frames = _number(run, run.computed) + 1
    return write_results(form, boxes, frames=frames, size=run.source.size, rate_hz=run.source.frame_rate_hz)


def _of_states(run: Run) -> list[Box]:
    if run.experiment.boxes is None:
        return []
    found: list[Box] = []
    for frame in range(run.computed + 1):
        state = run.seek(frame).state
        found += (box._replace(frame=_number(run, frame)) for box in run.experiment.boxes(state))
    return found


def _of_rows(run: Run) -> list[Box]:
    name = extent_series(run.experiment.all_series())
    return [
        _box(_number(run, row.frame), row.estimate, extent) for row in run.diagnostics if (extent := _extent(row, name))
    ]


def _extent(row: Diagnostics, name: str | None) -> tuple[float, ...] | None:
    extent = row.vector(name) if name else None
    return extent if extent and np.isfinite([*extent, *row.estimate]).all() else None


def _box(frame: int, centre: tuple[float, ...], extent: tuple[float, ...]) -> Box:
    """Return the box around a position; it covers whole pixels, and positions count from the centre of the first."""
    (x, y), (w, h) = centre[:2], extent
    return Box(frame, 1, x - (w - 1.0) / 2.0, y - (h - 1.0) / 2.0, w, h)


def _number(run: Run, frame: int) -> int:
    """Return the number in the recording of a frame of the run."""
    return frame + (run.setup.footage.start if run.setup.footage else 0)


# Films have every frame at the source's own rate. A GIF is for a slide or a page: at most so wide, so fast and so long
# that it can be loaded; of a longer run it shows every second frame, every third and so on, at the same speed.

GIF_RATE_HZ, GIF_PICTURES, GIF_WIDE_PX = 15.0, 300, 640
SAMPLED = 6
"""Number of a run's pictures that set the colours of its GIF."""


def mp4_of(run: Run, path: Path) -> Steps:
    """Write a film of a run, whose manifest is the file's comment."""
    from pftrack.vision.film import FilmWriter  # noqa: PLC0415 - it loads codecs

    total = run.computed + 1
    words = {"title": f"{title_of(run)}; {extent_of(run)}", "comment": embed(run)}
    with FilmWriter(path, run.source.frame_rate_hz, words) as film:
        for frame in range(total):
            film.write(_picture(run, frame))
            yield frame + 1, total


def gif_of(run: Run, path: Path) -> Steps:
    """Write a GIF of a run that plays for ever, whose manifest is the file's comment."""
    from pftrack.vision.film import common_colours, write_gif  # noqa: PLC0415 - it loads codecs

    total, rate_hz = run.computed + 1, run.source.frame_rate_hz
    stride = max(math.ceil(rate_hz / GIF_RATE_HZ), math.ceil(total / GIF_PICTURES), 1)
    scale = min(1.0, GIF_WIDE_PX / _picture(run, 0).shape[1])
    samples = sorted({round(place) for place in np.linspace(0, total - 1, SAMPLED)})
    colours = common_colours([_picture(run, frame, scale) for frame in samples])
    pictures = []
    for frame in range(0, total, stride):
        pictures.append(colours.of(_picture(run, frame, scale)))
        yield min(frame + stride, total), total
    write_gif(path, pictures, stride / rate_hz, comment=embed(run))


def _picture(run: Run, frame: int, scale: float = 1.0) -> NDArray[np.uint8]:
    """Return what a frame looks like, (height, width, 3) RGB; the run stands there afterwards."""
    from pftrack.vision.rendering import render_beside  # noqa: PLC0415 - only who wants a picture has to wait for it

    drawing = without_faults(run.experiment.draw(run.seek(frame), run.diagnostics))
    return render_beside(drawing, layers=run.experiment.display.shown, scale=scale)


# Jupyter notebooks: cells of words and of code, as the content of a file; and a run as one.
#
# The notebook of a run has its recipe, the run computed again, a table of its numbers, and plots of them. A notebook
# does not contain results, so it is small and computes its numbers where it runs; a hash of the estimates shows whether
# they are the same. It does not contain the recording either, but names it.


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell of a notebook.

    Attributes:
        kind: Whether it holds words or Python.
        source: Its content.
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
    return notebook(run_cells(run.recipe, run.experiment, run.computed, run.estimates_sha256, (), tracker))


def run_cells(
    recipe: Recipe,
    experiment: Experiment,
    last: int | None = None,
    estimates_sha256: str | None = None,
    plots: Collection[str] = (),
    tracker: str = "",
) -> tuple[Cell, ...]:
    """Return the cells that compute a run and show its numbers.

    Args:
        recipe: Its recipe.
        experiment: The one that it names.
        last: The frame up to which it is computed; the run's own last one if not given.
        estimates_sha256: Expected hash of its estimates, where known.
        plots: Ids of the plots that are drawn; all if none.
        tracker: Title of its tracker; with it they begin with what the run is.
    """
    name = recipe.footage.name if recipe.footage else ""
    wanted = [plot for plot in experiment.display.plots if not plots or plot.id in plots]
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
    unit = plot.unit_beside(experiment.judge.unit)
    return f"{plot.title}, {unit}" if unit else plot.title


ROLES: Mapping[PlotKind, tuple[SeriesRole, ...]] = {
    "sample size": ("ess", "particles"),
    "samplers": ("share",),
    "innovation": ("nis", "nis_limit"),
}
"""Roles that kinds of plot read."""


def _names(plot: Plot, experiment: Experiment) -> list[str]:
    """Return the names of a plot's columns."""
    roles = ROLES.get(plot.kind, ())
    declared = [series.name for series in experiment.all_series() if series.role and series.role in roles]
    own = [plot.kind] if plot.kind in {"error", "sigma"} else []
    return own + [f"{PREFIX}{name}" for name in (*declared, *plot.series, *((plot.truth,) if plot.truth else ()))]
