"""`--export`: files of the last frame and those before it, of the kinds that the experiment offers."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

from pftrack.cli.output import CommandError, wrong_use

if TYPE_CHECKING:
    from pftrack.experiment import Experiment
    from pftrack.runs.exports import RunExport
    from pftrack.runs.run import Run

__all__ = ["ExportOut", "wanted_exports", "write_exports"]

ExportOut: TypeAlias = Annotated[
    list[Path] | None,
    typer.Option(
        "--export",
        metavar="FILE",
        help="Write a file of what was tracked; `show` lists the kinds, told apart by suffix. May be repeated.",
    ),
]


def wanted_exports(experiment: "Experiment", places: list[Path]) -> "list[tuple[RunExport, Path]]":
    """Return what is to be written where, by the suffixes of the files."""
    from pftrack.runs.exports import exports_of

    offered = exports_of(experiment) if places else ()
    found = []
    for place in places:
        if not place.absolute().parent.is_dir():
            raise CommandError(f"{place} cannot be written: there is no folder {place.absolute().parent}")
        fitting = [one for one in offered if place.name.lower().endswith(f".{one.suffix}")]
        if not fitting:
            known = ", ".join(f".{one.suffix}" for one in offered)
            raise wrong_use(f"--export of {experiment.id} writes {known}, got {place.name!r}")
        found.append((max(fitting, key=lambda one: len(one.suffix)), place))
    return found


def write_exports(exports: "list[tuple[RunExport, Path]]", run: "Run") -> None:
    """Write files of the frame at which a run stands; one that cannot be written leaves what was there."""
    from pftrack.files import write_whole

    for export, place in exports:
        try:
            write_whole(place, export.make(run))
        except OSError as error:
            raise CommandError(f"{place} cannot be written: {error.strerror}") from None
