"""`run` and `replay`: compute a run from a simulated scene, a clip or a saved file, and say how it went."""

import math
import os
from collections.abc import Mapping
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pftrack.cli_list import Json, experiment_named
from pftrack.cli_output import CommandError, emit, note, progress, table, wrong_use
from pftrack.parameters import Value, declarations, parse
from pftrack.random import MAXIMUM_SEED

if TYPE_CHECKING:
    from pftrack.experiments.experiment import Experiment, Setup
    from pftrack.run import Run

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
    box: Annotated[str | None, typer.Option(metavar="X,Y,W,H", help="The target's box on the first frame, px.")] = None,
    start: Annotated[int | None, typer.Option(min=0, help="Frame of the video to start with.")] = None,
    truth: Annotated[Path | None, typer.Option(help="CSV with the columns frame,x,y,w,h.")] = None,
    assignments: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="A parameter's value; may be repeated.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=MAXIMUM_SEED, help="Seed of all random numbers.")] = 0,
    frames: Annotated[int | None, typer.Option(min=1, help="How many frames to compute.")] = None,
    out: Annotated[Path | None, typer.Option(help="Save the run, FILE.pft.")] = None,
    video_out: VideoOut = None,
    json: Json = False,
) -> None:
    """Run an experiment and say how it went."""
    found = experiment_named(experiment)
    if tracker is not None and tracker not in found.trackers:
        raise wrong_use(f"the tracker of {found.id} must be one of {', '.join(found.trackers)}, got {tracker!r}")
    _check_places(out, video_out)
    with ExitStack() as stack:
        setup = _setup(stack, found, video=video, box=box, start=start, truth=truth)
        values = _values(setup, assignments or [], tracker or found.default_tracker)
        _compute(_new(found, setup, tracker, seed, frames, values), out, video_out, json=json)


def replay(
    file: Annotated[Path, typer.Argument(help="A run that was saved with `run --out` or from the page.")],
    video: Annotated[Path | None, typer.Option(help="Where the run's video is now, if it was moved.")] = None,
    video_out: VideoOut = None,
    json: Json = False,
) -> None:
    """Compute a saved run again; it gives the same numbers."""
    from pftrack.record import load
    from pftrack.sources.sequence import open_sequence

    _check_places(None, video_out)
    if not file.exists():
        raise CommandError(f"there is no file {file}")
    again = load(file) if video is None else load(file, open_sequence=lambda _reference: open_sequence(video))
    _compute(again, None, video_out, json=json)


def _setup(
    stack: ExitStack,
    experiment: "Experiment",
    *,
    video: Path | None,
    box: str | None,
    start: int | None,
    truth: Path | None,
) -> "Setup":
    from pftrack.sources.sequence import open_sequence
    from pftrack.sources.truth import read_truth

    if video is None:
        for name, given in {"--box": box, "--start": start, "--truth": truth}.items():
            if given is not None:
                raise wrong_use(f"{name} needs --video: a simulated scene knows its own start and truth")
        return experiment.simulate()
    if experiment.on_video is None:
        raise wrong_use(f"{experiment.id} is simulated and takes no --video")
    if box is None:
        raise wrong_use("--video needs --box x,y,w,h: where the target is on the first frame, px")
    outline = _box(box)
    if not video.exists():
        raise CommandError(f"there is no file or folder {video}")
    table_of_boxes = read_truth(truth) if truth else None
    for warning in table_of_boxes.warnings if table_of_boxes else ():
        note(f"pftrack: {warning}")
    sequence = stack.enter_context(closing(open_sequence(video)))
    for warning in sequence.index.warnings:
        note(f"pftrack: {warning}")
    if start is not None and start >= sequence.frame_count:
        raise wrong_use(f"--start must be below the {sequence.frame_count} frames of {video.name}, got {start}")
    _check_inside(outline, sequence.size)
    return experiment.on_video(sequence, outline, start=start or 0, truth=table_of_boxes)


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


def _values(setup: "Setup", assignments: list[str], tracker: str) -> dict[str, Value]:
    model = type(setup.parameters)
    values: dict[str, Value] = {}
    for assignment in assignments:
        name, separator, text = assignment.partition("=")
        if not (separator and name):
            raise wrong_use(f"--set expected name=value, got {assignment!r}")
        values[name] = parse(model, name, text)
    for declaration in declarations(model):
        if declaration.name in values and declaration.trackers and tracker not in declaration.trackers:
            note(f"pftrack: {declaration.name} is not read by {tracker}, only by {', '.join(declaration.trackers)}")
    return values


def _new(
    experiment: "Experiment",
    setup: "Setup",
    tracker: str | None,
    seed: int,
    frames: int | None,
    values: Mapping[str, Value],
) -> "Run":
    from pftrack.run import Change, Run

    timeline = (Change(0, dict(values)),) if values else ()
    return Run(experiment, setup, tracker=tracker, seed=seed, frames=frames, timeline=timeline)


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


def _compute(run: "Run", out: Path | None, video_out: Path | None, *, json: bool) -> None:
    from pftrack.film import FilmWriter
    from pftrack.record import save
    from pftrack.rendering import render

    with ExitStack() as stack:
        film = stack.enter_context(FilmWriter(video_out, run.source.frame_rate_hz)) if video_out else None
        tick = stack.enter_context(progress(f"{run.experiment.id}, {run.tracker}", run.frames))
        for frame in range(run.frames):
            step = run.seek(0) if frame == 0 else run.advance()
            if film is not None:
                drawing = run.experiment.draw(step, run.diagnostics[: frame + 1])
                film.write(render(drawing, layers=run.experiment.layers))
            if frame % REPORT_EVERY == 0:
                tick(frame)
    if out is not None:
        save(run, out)
    summary = run.summary()
    if json:
        emit(summary)
    else:
        table("", ("", ""), [(name.replace("_", " "), _shown(value)) for name, value in summary.items()])


def _shown(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{name}={item}" for name, item in value.items())
    if value is None:
        return "not known"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
