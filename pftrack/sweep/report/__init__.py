"""Reports: the result of a sweep for people. Tables, figures as PNG or SVG, and one page that needs nothing else.

`study` says what is looked at. `curves` and `maps` draw figures as pictures; `plots` draws maps for the `page`, in a
`frame` that also has the colours and labels of all; `page` has the tables; `exports` makes the files.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pftrack.core.files import csv_text
from pftrack.output.figures.picture import SCREEN_DOTS_PER_INCH, PictureForm, encode
from pftrack.sweep.axis import SweepError
from pftrack.sweep.report.exports import export_result, figures, manifest_of_result
from pftrack.sweep.report.page import Table, page, tables
from pftrack.sweep.report.study import Study
from pftrack.sweep.result import Result, summary

__all__ = ["Report", "export_result", "write_report"]


@dataclass(frozen=True)
class Report:
    """A report that was written.

    Attributes:
        tables: Its tables.
        files: Its files.
        page: The page among them.
        figures: What came of the sweep, in numbers.
    """

    tables: tuple[Table, ...]
    files: tuple[Path, ...]
    page: Path
    figures: dict[str, Any]

    def as_dict(self) -> dict[str, Any]:
        """Return the report as JSON values."""
        shown = [{"title": it.title, "columns": it.columns, "rows": it.rows} for it in self.tables]
        return {**self.figures, "tables": shown, "files": [str(path) for path in self.files], "page": str(self.page)}


def write_report(
    result: Result,
    folder: Path,
    *,
    x: str | None = None,
    y: str | None = None,
    level: float = 0.01,
    form: PictureForm | None = "png",
) -> Report:
    """Write the report of a result into a folder; a report that is there already is replaced.

    Args:
        result: Finished, or as far as it came.
        folder: Where to; it is made if need be.
        x: Name of the axis across the maps; the first with several numbers if not given.
        y: Name of the axis down the maps; the next one if not given.
        level: Of significance.
        form: Kind of the pictures; without one none are drawn, which takes longest: the page has its own.

    Raises:
        SweepError: The result is empty or damaged, or has no such axis.
        OSError: The folder cannot be written.
    """
    figures_of_all = summary(result)
    if not figures_of_all["runs"]:
        raise SweepError("the sweep has no rows yet, so there is nothing to report")
    study = Study.of(result, x=x, y=y, level=level)
    made = tables(study)
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    manifest = manifest_of_result(result)
    if form is not None:
        for name, draw in figures(study).items():
            files.append(folder / f"{name}.{form}")
            files[-1].write_bytes(encode(draw(), form, f"{manifest['title']}: {name}", manifest, SCREEN_DOTS_PER_INCH))
    files.append(folder / "tables.csv")
    files[-1].write_text("".join(csv_text([[it.title], it.columns, *it.rows, []]) for it in made), encoding="utf-8")
    index = folder / "index.html"
    index.write_text(page(study, made))
    return Report(made, (*files, index), index, {**figures_of_all, "complete": result.complete})
