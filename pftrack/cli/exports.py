"""`export`, and `--export` of `run` and `replay`: a run as files of other programs, selected by suffix."""

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

from pftrack.cli.footage import Moved, footage_of
from pftrack.cli.output import Json, compiling, note, progress, refusing, tell, writing

if TYPE_CHECKING:
    from pftrack.experiments.experiment import Experiment
    from pftrack.output.exports.formats import RunExport
    from pftrack.runs.record import Saved
    from pftrack.runs.run import Run


ExportOut: TypeAlias = Annotated[
    list[Path] | None,
    typer.Option(
        "--export",
        metavar="FILE",
        help="Write the run as a file of another format, chosen by its suffix; `show` lists them. May be repeated.",
    ),
]


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.command()(export)


def export(
    file: Annotated[
        Path, typer.Argument(help="A saved run, FILE.pft, or the result of a sweep, FILE.parquet, finished or not.")
    ],
    to: Annotated[
        list[Path],
        typer.Option("--to", metavar="FILE", help="File to write; its suffix selects the format. May be repeated."),
    ],
    plot: Annotated[
        str | None, typer.Option(metavar="ID", help="The one plot that pictures show (default: all).")
    ] = None,
    video: Moved = None,
    json: Json = False,
) -> None:
    """Export a saved run (tables, videos, plots, a notebook) or the maps of a sweep."""
    if file.suffix.lower() == ".parquet":
        _say(_sweep(file, to, plot), {}, json=json)
        return
    from pftrack.experiments import find
    from pftrack.runs.manifest import extent_of
    from pftrack.runs.record import read_saved
    from pftrack.runs.reproduction import difference

    saved = read_saved(file)
    wanted = wanted_exports(find(saved.record.recipe.experiment), to, plot)
    with ExitStack() as stack:
        stack.enter_context(compiling())
        again = _compute_again(stack, saved, file, video)
        apart = difference(again, saved)
        if apart is not None:
            note(f"pftrack: {apart.sentence}; what was computed now is exported")
        if again.computed + 1 < again.frames:
            note(f"pftrack: the run is not finished; {extent_of(again)} are exported")
        files = write_exports(wanted, again, plot)
    _say(files, {"frames": again.computed + 1, "of": again.frames}, json=json)


def _say(files: list[Path], details: dict[str, int], *, json: bool) -> None:
    rows = [(path, f"{path.stat().st_size:,}") for path in files]
    tell({"files": [str(path) for path in files], **details}, ("file", "bytes"), rows, json=json)


def _sweep(file: Path, places: list[Path], plot: str | None) -> list[Path]:
    """Write files of the result of a sweep and return them."""
    from pftrack.sweep import read_result
    from pftrack.sweep.report.files import export_result

    result = read_result(file)
    pictures = [place for place in places if place.suffix.lower() in {".png", ".svg"}] or places
    written: list[Path] = []
    for place in places:
        with refusing(), writing(place):
            written += export_result(result, place, plot=plot if place in pictures else None)
    return written


def _compute_again(stack: ExitStack, saved: "Saved", file: Path, video: Path | None) -> "Run":
    """Compute a saved run as far as it was computed, its recording opened for as long as the stack lasts."""
    from pftrack.runs.reproduction import make

    made = make(saved.record.recipe, open_sequence=footage_of(stack, file, video))
    with progress(f"{made.experiment.id}, {made.tracker}") as tick:
        for step in made.seeking(min(saved.record.computed, made.frames) - 1):
            tick(step.diagnostics.frame, saved.record.computed)
    return made


def wanted_exports(
    experiment: "Experiment", places: list[Path], plot: str | None = None
) -> "list[tuple[RunExport, Path]]":
    """Return what is to be written where, by the suffixes of the files; refused before anything is computed."""
    if not places:
        return []
    from pftrack.output.exports.formats import check_plot, export_at

    with refusing():
        wanted = [(export_at(experiment, place), place) for place in places]
        pictures = [kind for kind, _ in wanted if kind.group == "plots"]
        for kind in pictures or [wanted[0][0]]:
            check_plot(experiment, kind, plot)
    return wanted


def write_exports(exports: "list[tuple[RunExport, Path]]", run: "Run", plot: str | None = None) -> list[Path]:
    """Write files of a run and return them; one that cannot be written leaves what was there."""
    if not exports:
        return []
    from pftrack.output.exports.formats import exporting, files_of

    written: list[Path] = []
    for kind, place in exports:
        with writing(place), progress(place.name) as tick:
            for done, total in exporting(run, place, kind, plot if kind.group == "plots" else None):
                tick(done, total)
        written += files_of(kind, place)
    return written
