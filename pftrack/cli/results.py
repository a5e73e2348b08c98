"""`open`: a recording of beliefs, or the results of any tracker with their clip and truth, looked at like a run."""

import tempfile
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pftrack.cli.exports import ExportOut, wanted_exports, write_exports
from pftrack.cli.footage import open_footage
from pftrack.cli.listing import Assignments, Json
from pftrack.cli.output import CommandError, note, values_of, whole, wrong_use
from pftrack.cli.run import compute_run, print_summary

if TYPE_CHECKING:
    from pftrack.core.model.source import FrameSequence
    from pftrack.sources.results.table import Form, ResultTable


def register(app: typer.Typer) -> None:
    """Add the command of this module."""
    app.command("open")(open_results)


def open_results(
    file: Annotated[
        Path,
        typer.Argument(
            help="A recording of beliefs, FILE.pft, or results: MOTChallenge, OTB or VOT text, CVAT's video XML, "
            "COCO's video JSON, or a table of boxes (CSV)."
        ),
    ],
    video: Annotated[Path | None, typer.Option(help="The video that the results or the recording are of.")] = None,
    truth: Annotated[Path | None, typer.Option(help="True boxes of the same frames, in any of these forms.")] = None,
    form: Annotated[
        str | None, typer.Option(help="What the results are: mot, otb, vot, cvat, coco or csv; told by itself.")
    ] = None,
    first_frame: Annotated[str | None, typer.Option(metavar="0|1", help="Number of the first frame in a text.")] = None,
    first_pixel: Annotated[str | None, typer.Option(metavar="0|1", help="Number of the first pixel in a text.")] = None,
    out: Annotated[
        Path | None, typer.Option(help="Keep results, clip and truth as one recording, FILE.pft, for the page.")
    ] = None,
    export: ExportOut = None,
    assignments: Assignments = None,
    show: Annotated[bool, typer.Option(help="Open the scene in a browser.")] = True,
    json: Json = False,
) -> None:
    """Look at what a loop of your own or any other tracker has computed: errors, overlap, identity switches."""
    from pftrack.core.model.recipe import Change
    from pftrack.experiments import find_for
    from pftrack.output.exports.formats import show as show_run
    from pftrack.runs.run import Run
    from pftrack.sources.results.table import FORMS

    if form is not None and form not in FORMS:
        raise wrong_use(f"--form must be one of {', '.join(FORMS)}, got {form[:40]!r}")
    experiment = find_for("beliefs")
    exports = wanted_exports(experiment, export or [])
    with ExitStack() as stack:
        said = form or first_frame or first_pixel
        if out is not None or said:
            place = out or Path(stack.enter_context(tempfile.TemporaryDirectory()), f"{file.stem}.pft")
            options = (_bit("--first-frame", first_frame), _bit("--first-pixel", first_pixel))
            _record(file, place, video, truth, form, *options)
            sequence = open_footage(stack, place)
        elif video is not None or truth is not None:
            sequence = _open_together(stack, file, video, truth)
        else:
            sequence = open_footage(stack, file)
        if sequence.index.kind != "beliefs" or not experiment.accepts_video:
            raise CommandError(f"{file.name} holds no results; `pftrack run` tracks a recording")
        for warning in sequence.index.warnings:
            note(f"pftrack: {warning}")
        setup = experiment.video.on_video(sequence, None)
        values = values_of(setup.parameters, assignments or [])
        run = Run(experiment, setup, timeline=(Change(0, values),))
        print_summary(compute_run(run, None, frames=run.frames), run, json=json)
        write_exports(exports, run)
        if show and not json:
            shown = show_run(run)
            note(f"pftrack: the scene is at {shown.address}; Ctrl-C ends")
            shown.wait()


def _open_together(stack: ExitStack, file: Path, video: Path | None, truth: Path | None) -> "FrameSequence":
    from pftrack.sources.limits import DEFAULT_LIMITS, SourceError
    from pftrack.sources.results.parts import Part, open_parts

    named: dict[Part, Path | None] = {"clip": video, "results": file, "truth": truth}
    try:
        together = open_parts({part: path for part, path in named.items() if path is not None}, DEFAULT_LIMITS)
    except SourceError as error:
        raise CommandError(str(error)) from None
    return stack.enter_context(closing(together))


def _record(
    file: Path,
    to: Path,
    video: Path | None,
    truth: Path | None,
    form: str | None,
    first_frame: int | None,
    first_pixel: int | None,
) -> None:
    from typing import cast

    from pftrack.sources.results.parts import record_results
    from pftrack.sources.results.reading import read_results_file

    known = None if truth is None else _read(truth, None)
    try:
        table = read_results_file(
            file, form=cast("Form | None", form), first_frame=first_frame, first_pixel=first_pixel
        )
    except ValueError as error:
        raise CommandError(str(error)) from None
    try:
        record_results(table, to, clip=video, truth=known)
    except OSError as error:
        raise CommandError(f"{to} cannot be written: {error.strerror or error}") from None


def _read(path: Path, form: "Form | None") -> "ResultTable":
    from pftrack.sources.results.reading import read_results_file

    try:
        return read_results_file(path, form=form)
    except ValueError as error:
        raise CommandError(str(error)) from None


def _bit(option: str, text: str | None) -> int | None:
    return None if text is None else whole(option, text, 0, 1)
