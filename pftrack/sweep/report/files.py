"""Files of a sweep: its report in a folder, its rows as a table, and any of its figures as a picture at print size."""

import hashlib
import json
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from jinja2 import Environment, PackageLoader

from pftrack.core.files import csv_text, part_of, settle, write_whole
from pftrack.core.model.setup import ExportError
from pftrack.core.version import __version__
from pftrack.output.figures.picture import SCREEN_DOTS_PER_INCH, PictureForm, encode
from pftrack.runs.manifest import FORMAT
from pftrack.sweep.axis import SweepError
from pftrack.sweep.cells import COMMON, Code, Quantity
from pftrack.sweep.journal import Result, csv_pieces, summary
from pftrack.sweep.report.figures import figures, file_of
from pftrack.sweep.report.study import Study, Table, format_value, label, tables


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
    form: Literal["png", "svg"] | None = "png",
) -> Report:
    """Write the report of a result into a folder; a report that is there already is replaced.

    Args:
        result: Finished, or as far as it came.
        folder: Where to; it is made if need be.
        x: Name of the axis across the maps; the first with several numbers if not given.
        y: Name of the axis down the maps; the next one if not given.
        level: Of significance.
        form: Kind of the pictures, beside the page and on it; None draws none, which takes longest.

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
    files, pictures = [], {}
    manifest = manifest_of_result(result)
    if form is not None:
        for name, draw in figures(study).items():
            drawn = encode(draw(), form, f"{manifest['title']}: {name}", manifest, SCREEN_DOTS_PER_INCH)
            files.append(folder / f"{name}.{form}")
            files[-1].write_bytes(drawn)
            pictures[name] = f"data:{MEDIA[form]};base64,{b64encode(drawn).decode()}"
    files.append(folder / "tables.csv")
    files[-1].write_text("".join(csv_text([[it.title], it.columns, *it.rows, []]) for it in made), encoding="utf-8")
    index = folder / "index.html"
    index.write_text(page(study, made, pictures), encoding="utf-8")
    return Report(made, (*files, index), index, {**figures_of_all, "complete": result.complete})


def page(study: Study, tables: Sequence[Table], pictures: Mapping[str, str]) -> str:
    """Return the page of a study as HTML that needs nothing else.

    Success and error are open, every other measure is a section of its own that a reader unfolds.

    Args:
        study: What is looked at.
        tables: All of its tables.
        pictures: Addresses of its figures by name, as data.
    """
    folder = Environment(loader=PackageLoader("pftrack.sweep", "report"), autoescape=True, trim_blocks=True)
    sections = [
        {
            "quantity": it,
            "picture": file_of(it),
            "is_open": it.name in COMMON,
            "better": _count_better(study, it),
            "tables": [table for table in tables if table.quantity == it.name],
        }
        for it in study.quantities
    ]
    return folder.get_template("page.html").render(
        title=f"{study.result.plan.wiring.title}: a sweep",
        question=study.result.plan.wiring.question,
        facts=_facts(study),
        tables=[table for table in tables if not table.quantity],
        sections=sections,
        pictures=pictures,
        judged=study.judged,
        share=f"{100 * study.level:g}",
    )


def _count_better(study: Study, quantity: Quantity) -> list[str]:
    """Return in how many cells which tracker is better, for a reader who decides whether to unfold the section."""
    said = []
    for pair in study.comparisons[quantity.name] if study.pairs and study.x else ():
        codes = pair.significance(study.level).codes
        first, second = (int((codes == code).sum()) for code in (Code.FIRST_BETTER, Code.SECOND_BETTER))
        tested = int((codes != Code.NOT_APPLICABLE).sum())
        said.append(f"{pair.first} {first}, {pair.second} {second} of {tested} tested")
    return said


def _facts(study: Study) -> dict[str, str]:
    """Return what was computed, in words."""
    plan = study.result.plan
    fixed = ", ".join(f"{name} = {format_value(value)}" for name, value in plan.values.items())
    return {
        "Experiment": f"{plan.experiment} ({'; '.join(citation.short for citation in plan.wiring.references)})",
        "Runs": f"{sum(int(total.runs[0, 0]) for total in study.totals.values()):,} of {plan.runs:,}",
        "Trackers": ", ".join(plan.trackers),
        **{
            label(study, axis): f"{', '.join(format_value(value) for value in axis.values)} ({axis.name})"
            for axis in plan.axes
        },
        "Trials": f"{plan.trials} a tracker and condition, {plan.frames} frames each",
        "Fixed": fixed or "all as by default",
        "Seed": str(plan.seed),
    }


SUFFIXES = ("csv", "manifest.json", "png", "svg")
MEDIA = {"png": "image/png", "svg": "image/svg+xml"}


def export_result(result: Result, path: Path, *, plot: str | None = None) -> tuple[Path, ...]:
    """Write a result as a file of the kind that its name asks for, and return what was written.

    Args:
        result: Finished, or as far as it came.
        path: Where to; an existing file is replaced. Beside a table lies its manifest.
        plot: Name of the map or of the curves that a picture shows.

    Raises:
        ExportError: There is no such kind of file, no such folder or no such map; it names those that there are.
        OSError: The file cannot be written; what was there before is still there.
    """
    name, folder = path.name.lower(), path.absolute().parent
    form = next((suffix for suffix in SUFFIXES if name.endswith(f".{suffix}")), None)
    if form is None:
        known = ", ".join(f".{suffix}" for suffix in SUFFIXES)
        raise ExportError(f"a sweep can be exported as {known}; got {path.name!r}")
    if not folder.is_dir():
        raise ExportError(f"{path} cannot be written: there is no folder {folder}")
    if form in {"png", "svg"}:
        write_whole(path, _picture(result, "png" if form == "png" else "svg", plot))
        return (path,)
    if plot is not None:
        raise ExportError(f"a plot can be written as a picture, .png or .svg; got {path.name!r}")
    manifest = f"{json.dumps(manifest_of_result(result), indent=1, ensure_ascii=False)}\n".encode()
    if form == "manifest.json":
        write_whole(path, manifest)
        return (path,)
    beside = path.with_name(f"{path.name}.manifest.json")
    _write_table(result, path)
    write_whole(beside, manifest)
    return path, beside


def _picture(result: Result, form: PictureForm, name: str | None) -> bytes:
    known = figures(Study.of(result))
    if name not in known:
        wanted = "say which one is wanted" if name is None else f"there is none called {name!r}"
        raise ExportError(f"the plots of this sweep are {', '.join(known) or 'none'}; {wanted}")
    manifest = manifest_of_result(result)
    return encode(known[name](), form, f"{manifest['title']}: {name}", manifest)


def manifest_of_result(result: Result) -> dict[str, Any]:
    """Return what a result is and all that is needed to compute it again, as JSON values."""
    plan, experiment = result.plan.as_dict(), result.plan.wiring
    trackers = ", ".join(result.plan.trackers)
    title = f"Sweep of {experiment.title}, {trackers}"
    computed = summary(result)["runs"]
    return {
        "format": FORMAT,
        "version": 1,
        "pftrack": __version__,
        "title": title,
        "runs": {"computed": computed, "of": result.plan.runs},
        "plan": plan,
        "sha256": {"plan": hashlib.sha256(json.dumps(plan, sort_keys=True).encode()).hexdigest()},
        "quantities": [{"name": it.column, "title": it.title, "unit": it.unit} for it in Study.of(result).quantities],
        "citation": f"Computed with pftrack {__version__}: {title}; {computed:,} of {result.plan.runs:,} runs.",
        "references": [one.as_dict() for one in experiment.references],
    }


def _write_table(result: Result, path: Path) -> None:
    part = part_of(path)
    try:
        with part.open("wb") as file:
            file.writelines(csv_pieces(result))
        settle(part, path)
    finally:
        part.unlink(missing_ok=True)
