"""`run` and `replay`: compute a run from a simulated scene, a clip or a saved file, and say how it went."""

import math
import os
from collections.abc import Mapping
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from difflib import get_close_matches
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pftrack.cli.listing import Json, experiment_named
from pftrack.cli.output import FAILED, CommandError, emit, note, progress, table, whole, wrong_use
from pftrack.parameters import Value, declarations, parse
from pftrack.random import MAXIMUM_SEED

if TYPE_CHECKING:
    from pftrack.experiment import Experiment, Setup
    from pftrack.runs.run import Run
    from pftrack.sources.sequence import FrameSequence

__all__ = ["register"]

REPORT_EVERY = 8  # frames; a progress bar must not cost more than the filter

VideoOut = Annotated[Path | None, typer.Option("--video-out", help="Write the run as a film, FILE.mp4.")]


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.command()(run)
    app.command()(replay)


def run(
    experiment: Annotated[str, typer.Argument(help="An experiment's name, as `list` prints it.")],
    tracker: Annotated[str | None, typer.Option(help="A tracker's name, as `show` prints it.")] = None,
    video: Annotated[Path | None, typer.Option(help="A video, an animated GIF or a folder of pictures.")] = None,
    box: Annotated[
        str | None,
        typer.Option(metavar="X,Y,W,H", help="The target's box on the first frame, px; a face is found without."),
    ] = None,
    points: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="The face's features on the first frame, JSON or CSV with name,x,y, px."),
    ] = None,
    start: Annotated[
        str | None,
        typer.Option(
            metavar="FRAME", help="Frame on which the box is drawn; the first with truth, or 0, if not given."
        ),
    ] = None,
    truth: Annotated[
        Path | None,
        typer.Option(help="CSV with the columns frame,x,y,w,h; of a head frame,yaw_deg,pitch_deg,roll_deg."),
    ] = None,
    assignments: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="A parameter's value; may be repeated.")
    ] = None,
    seed: Annotated[str, typer.Option(metavar="SEED", help="Of all random numbers.")] = "0",
    frames: Annotated[str | None, typer.Option(metavar="N", help="How many frames to compute.")] = None,
    out: Annotated[Path | None, typer.Option(help="Save the run, FILE.pft.")] = None,
    video_out: VideoOut = None,
    json: Json = False,
) -> None:
    """Run an experiment and say how it went."""
    from pftrack.runs.record import save
    from pftrack.runs.run import LONGEST_RUN, Change, Run

    found = experiment_named(experiment)
    if tracker is not None and tracker not in found.trackers:
        raise wrong_use(f"the tracker of {found.id} must be one of {', '.join(found.trackers)}, got {tracker!r}")
    first_seed = whole("--seed", seed, 0, MAXIMUM_SEED)
    length = None if frames is None else whole("--frames", frames, 1, LONGEST_RUN)
    _check_places(out, video_out)
    with ExitStack() as stack:
        setup = _setup(stack, found, Footage(video, box, points, start, truth))
        if out is not None and video is not None:
            setup = replace(setup, reference={**setup.reference, "path": _relative(video, out)})
        values = _values(setup, assignments or [])
        timeline = (Change(0, values),) if values else ()
        made = Run(found, setup, tracker=tracker, seed=first_seed, frames=length, timeline=timeline)
        _note_unread(setup, values, made.tracker)
        summary = _compute(made, video_out, frames=made.frames)
        if out is not None:
            try:
                save(made, out)
            except OSError as error:  # it speaks of the file beside, which nobody asked for
                raise CommandError(f"{out} cannot be written: {error.strerror}") from None
    _print(summary, json=json)


def replay(
    file: Annotated[Path, typer.Argument(help="A run that was saved with `run --out` or from the page.")],
    video: Annotated[Path | None, typer.Option(help="Where the run's video is now, if it was moved.")] = None,
    video_out: VideoOut = None,
    json: Json = False,
) -> None:
    """Compute a saved run again and check that it gives the same numbers."""
    from pftrack.runs.record import read, rebuild

    _check_places(None, video_out)
    record = read(file)
    with ExitStack() as stack:

        def find(reference: Mapping[str, Any]) -> "FrameSequence":
            place = video or file.parent / str(reference.get("path", reference.get("name", "")))
            if not place.exists():
                raise CommandError(f"the run was made on {place}, which is not there; say with --video where it is")
            return stack.enter_context(closing(_open(place)))

        again = rebuild(record, open_sequence=find)
        summary = _compute(again, video_out, frames=record.computed)
    same = again.estimates_sha256 == record.estimates_sha256
    _print({**summary, "same_as_saved": same}, json=json)
    if not same:
        note("pftrack: the numbers differ from the saved ones: another version or another processor made them")
        raise typer.Exit(FAILED)


@dataclass(frozen=True)
class Footage:
    """What was said of a recording, as it was said."""

    video: Path | None
    box: str | None
    points: Path | None
    start: str | None
    truth: Path | None


def _setup(stack: ExitStack, experiment: "Experiment", said: Footage) -> "Setup":
    from pftrack.sources.points import read_points

    _check_said(experiment, said)
    if said.video is None or experiment.on_video is None:
        return experiment.simulate()
    outline = None if said.box is None else _box(said.box)
    if not said.video.exists():
        raise CommandError(f"there is no file or folder {said.video}")
    marks = None if said.points is None else read_points(said.points)
    known = experiment.truth.read(said.truth) if said.truth else None
    for warning in known.warnings if known else ():
        note(f"pftrack: {warning}")
    sequence = stack.enter_context(closing(_open(said.video)))
    for warning in sequence.index.warnings:
        note(f"pftrack: {warning}")
    labelled = min(known.rows, default=0) if known else 0
    first = whole("--start", said.start or str(labelled), 0, sequence.frame_count - 1)
    if outline is not None:
        _check_inside(outline, sequence.size)
    return experiment.on_video(sequence, outline, start=first, truth=known, points=marks)


def _check_said(experiment: "Experiment", said: Footage) -> None:
    """Refuse what does not go together, before anything is opened."""
    if said.video is None:
        options = {"--box": said.box, "--points": said.points, "--start": said.start, "--truth": said.truth}
        for name, given in options.items():
            if given is not None:
                raise wrong_use(f"{name} needs --video: a simulated scene knows its own start and truth")
        return
    if experiment.on_video is None:
        raise wrong_use(f"{experiment.id} is simulated and takes no --video")
    if said.points is not None and not experiment.finds_target:
        raise wrong_use(f"{experiment.id} has no features and takes no --points")
    if said.box is None and not experiment.finds_target:
        raise wrong_use("--video needs --box x,y,w,h: where the target is on the first frame, px")


def _open(path: Path) -> "FrameSequence":
    from pftrack.sources.sequence import SourceError, open_sequence

    try:
        return open_sequence(path)
    except SourceError as error:
        raise CommandError(f"{path.name}: {error}") from None


def _box(text: str) -> tuple[float, float, float, float]:
    parts = text.split(",")
    if len(parts) != 4:
        raise wrong_use(f"--box expected 4 numbers (x,y,w,h), got {len(parts)}: {text!r}")
    try:
        x, y, w, h = (float(part) for part in parts)
    except ValueError:
        raise wrong_use(f"--box expected 4 numbers (x,y,w,h), got {text!r}") from None
    if not all(math.isfinite(value) for value in (x, y, w, h)):
        raise wrong_use(f"--box expected 4 finite numbers (x,y,w,h), got {text!r}")
    if w <= 0 or h <= 0:
        raise wrong_use(f"--box must have a width and a height above 0, got {w:g} and {h:g}")
    return x, y, w, h


def _check_inside(box: tuple[float, float, float, float], size: tuple[int, int]) -> None:
    x, y, w, h = box
    if x < 0 or y < 0 or x + w > size[0] or y + h > size[1]:
        raise wrong_use(
            f"--box must lie inside the picture of {size[0]} x {size[1]} px, "
            f"got {x:g} to {x + w:g} across and {y:g} to {y + h:g} down"
        )


def _values(setup: "Setup", assignments: list[str]) -> dict[str, Value]:
    model = type(setup.parameters)
    known = [declaration.name for declaration in declarations(model)]
    values: dict[str, Value] = {}
    for assignment in assignments:
        name, separator, text = assignment.partition("=")
        if not (separator and name):
            raise wrong_use(f"--set expected name=value, got {assignment!r}")
        if name not in known:
            near = get_close_matches(name, known, n=3)
            hint = f"did you mean {' or '.join(near)}?" if near else "`pftrack show` lists them"
            raise wrong_use(f"there is no parameter {name!r} here; {hint}")
        values[name] = parse(model, name, text)
    return values


def _note_unread(setup: "Setup", values: Mapping[str, Value], tracker: str) -> None:
    for declaration in declarations(type(setup.parameters)):
        if declaration.name in values and declaration.trackers and tracker not in declaration.trackers:
            note(f"pftrack: {declaration.name} is not read by {tracker}, only by {', '.join(declaration.trackers)}")


def _check_places(out: Path | None, film: Path | None) -> None:
    """Refuse places that cannot be written before anything is computed."""
    if film is not None and film.suffix.lower() != ".mp4":
        raise wrong_use(f"--video-out must end in .mp4, got {film.name!r}")
    if out is not None and film is not None and out.absolute() == film.absolute():
        raise wrong_use("--out and --video-out must be different files")
    for place in filter(None, (out, film)):
        if place.is_dir():
            raise CommandError(f"{place} is a folder, not a file to write")
        if not place.absolute().parent.is_dir():
            raise CommandError(f"{place} cannot be written: there is no folder {place.absolute().parent}")
        if not os.access(place.absolute().parent, os.W_OK):
            raise CommandError(f"{place} cannot be written: its folder is read-only")


def _relative(video: Path, out: Path) -> str:
    """Where the video is, seen from the saved run: the two can be moved together."""
    return os.path.relpath(video.absolute(), out.absolute().parent)


def _compute(run: "Run", video_out: Path | None, *, frames: int) -> dict[str, Any]:
    from pftrack.film import FilmWriter
    from pftrack.rendering import render

    with ExitStack() as stack:
        film = stack.enter_context(FilmWriter(video_out, run.source.frame_rate_hz)) if video_out else None
        tick = stack.enter_context(progress(f"{run.experiment.id}, {run.tracker}"))
        for step in islice(run, frames):
            if film is not None:
                film.write(render(run.experiment.draw(step, run.diagnostics), layers=run.experiment.shown_layers))
            if run.position % REPORT_EVERY == 0:
                tick(run.position, frames)
    said = run.experiment.report(run.diagnostics) if run.experiment.report else {}
    return {**run.summary(), **said}


def _print(summary: Mapping[str, object], *, json: bool) -> None:
    if json:
        emit(summary)
    else:
        short = {name: value for name, value in summary.items() if value is not None and not _is_series(value)}
        rows = [(name.replace("_", " "), _shown(value)) for name, value in short.items()]
        table("", ("", ""), rows)


def _is_series(value: object) -> bool:
    """Whether a value is empty, or has a number for every frame: nothing for a table."""
    return isinstance(value, list) and (not value or isinstance(value[0], float))


def _shown(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{name}={_shown(item)}" for name, item in value.items())
    return f"{value:.4g}" if isinstance(value, float) else str(value)
