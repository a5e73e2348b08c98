"""Files of a sweep: its rows as a table, and any of its maps and curves as a picture at print size.

A figure has one quantity; two show all of them together. Figures are made directly, without pyplot, so that nothing is
kept in global state.
"""

import hashlib
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from pftrack.core.files import part_of, settle, write_whole
from pftrack.core.model.parameters import with_role
from pftrack.core.model.setup import ExportError
from pftrack.core.version import __version__
from pftrack.output.figures.picture import PictureForm, encode
from pftrack.runs.manifest import FORMAT
from pftrack.sweep.axis import Axis
from pftrack.sweep.cells import COMMON, Quantity
from pftrack.sweep.report.curves import along, boxes, curves
from pftrack.sweep.report.maps import sheet
from pftrack.sweep.report.study import Study
from pftrack.sweep.result import Result, csv_pieces, summary

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


SUFFIXES = ("csv", "manifest.json", "png", "svg")


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
