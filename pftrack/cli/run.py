"""`run`, `replay` and `show-recipe`: compute a run from options, a recipe or a saved file, and say how it went."""

import json as json_format
import os
from collections.abc import Mapping
from contextlib import ExitStack
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pftrack.cli.checks import compiling
from pftrack.cli.exports import ExportOut, wanted_exports, write_exports
from pftrack.cli.filters import Trust, chosen_tracker
from pftrack.cli.footage import FootageOptions, Moved, footage_of, frames_left, open_setup, path_from, takes_footage
from pftrack.cli.learn import guidance_of
from pftrack.cli.listing import Assignments, Json, PresetName, find_experiment, find_preset
from pftrack.cli.output import FAILED, CommandError, emit, note, progress, table, text_of, values_of, whole, wrong_use

if TYPE_CHECKING:
    from pftrack.core.model.parameters import Value
    from pftrack.core.model.preset import Preset
    from pftrack.core.model.recipe import Recipe
    from pftrack.core.model.setup import Setup
    from pftrack.core.model.source import FrameSequence
    from pftrack.experiments.experiment import Experiment
    from pftrack.runs.run import Run


LONGEST_SHOWN = 80  # characters of a value in a table
REPORT_EVERY = 8  # frames; a progress bar must not cost more than the filter

VideoOut = Annotated[Path | None, typer.Option("--video-out", help="Write the run as a film, FILE.mp4.")]


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.command()(run)
    app.command()(replay)
    app.command("show-recipe")(show_recipe)


@takes_footage
def run(
    experiment: Annotated[
        str,
        typer.Argument(help="An experiment's name, as `list` prints it, or a recipe, FILE.json."),
    ],
    preset: PresetName = None,
    tracker: Annotated[
        str | None, typer.Option(help="A tracker's name, as `show` prints it, or a file with a filter, FILE.py.")
    ] = None,
    *,
    said: FootageOptions,
    assignments: Assignments = None,
    learned: Annotated[
        Path | None, typer.Option(metavar="FILE", help="What `learn` has written, by which guided trackers move.")
    ] = None,
    seed: Annotated[str | None, typer.Option(metavar="SEED", help="Of all random numbers; 0 if not given.")] = None,
    frames: Annotated[
        str | None, typer.Option(metavar="N", help="How many frames to compute; at most as many as a recording has.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Save the run, FILE.pft.")] = None,
    video_out: VideoOut = None,
    export: ExportOut = None,
    mark_out: Annotated[
        Path | None, typer.Option("--mark-out", help="Write the first frame with the mark on it, FILE.png.")
    ] = None,
    trust: Trust = False,
    json: Json = False,
) -> None:
    """Run an experiment, or the recipe of a run, and say how it went."""
    from pftrack.core.model.recipe import LONGEST_RUN, Change
    from pftrack.core.numerics.random import LARGEST_SEED
    from pftrack.runs.record import save
    from pftrack.runs.run import Run

    recipe, folder = _recipe(experiment)
    found, recipe, tracker = chosen_tracker(recipe, tracker, trusted=trust)
    begin = find_preset(found, preset) if preset is not None else None
    changes: dict[str, Any] = {} if begin is None else {"tracker": begin.tracker, "seed": begin.seed}
    if tracker is not None:
        changes["tracker"] = tracker
    if seed is not None:
        changes["seed"] = whole("--seed", seed, 0, LARGEST_SEED)
    wanted = whole("--frames", frames, 1, LONGEST_RUN) if frames is not None else None
    _check_places(out, video_out)
    exports = wanted_exports(found, export or [])
    with ExitStack() as stack:
        stack.enter_context(compiling())
        setup, sequence = open_setup(stack, found, recipe, said, folder)
        if wanted is not None:
            changes["frames"] = wanted if sequence is None else min(wanted, frames_left(sequence, setup))
        values = {**values_of(setup.parameters, assignments or []), **_guidance_value(found, learned)}
        if begin is not None:
            values = {**_preset_values(setup, begin), **values}
        if values:
            changes["timeline"] = (*recipe.timeline, Change(0, values))
        made = Run.from_recipe(recipe.model_copy(update=changes), found, setup)
        if mark_out is not None:
            mark_out.write_bytes(_draw_mark(made))
        _note_unread(found, setup, values, made.tracker)
        suitability = _suitability(made, sequence)
        summary = {**compute_run(made, video_out, frames=made.frames), **suitability}
        write_exports(exports, made)
        if out is not None:
            try:
                save(made, out, footage_path=path_from(said.video, out) if said.video else None)
            except OSError as error:  # it speaks of the file beside, which nobody asked for
                raise CommandError(f"{out} cannot be written: {error.strerror}") from None
    print_summary(summary, made, json=json)


def replay(
    file: Annotated[Path, typer.Argument(help="A run that was saved with `run --out` or from the page.")],
    video: Moved = None,
    video_out: VideoOut = None,
    export: ExportOut = None,
    trust: Trust = False,
    json: Json = False,
) -> None:
    """Compute a saved run again and check that it gives the same numbers."""
    from pftrack.experiments.own.code import trust_filters
    from pftrack.runs.opening import make
    from pftrack.runs.record import read_saved
    from pftrack.runs.reproduction import difference

    _check_places(None, video_out)
    saved = read_saved(file)
    record = saved.record
    if trust:
        trust_filters(record.recipe)
    exports = wanted_exports(find_experiment(record.recipe.experiment), export or [])
    with ExitStack() as stack:
        stack.enter_context(compiling())
        again = make(record.recipe, open_sequence=footage_of(stack, file, video))
        summary = compute_run(again, video_out, frames=record.computed)
        write_exports(exports, again)
    apart = difference(again, saved)
    said = {"same_as_saved": apart is None, **({"differs": apart.as_dict()} if apart else {})}
    print_summary({**summary, **said}, again, json=json)
    if apart is not None:
        note(f"pftrack: {apart.sentence}")
        raise typer.Exit(FAILED)


def show_recipe(
    file: Annotated[Path, typer.Argument(help="A saved run, FILE.pft, or a recipe, FILE.json.")],
) -> None:
    """Print the recipe of a run as JSON: what `run` takes, without what has its default value."""
    from pftrack.runs.record import read

    recipe = _recipe(str(file))[0] if file.suffix.lower() == ".json" else read(file).recipe
    typer.echo(json_format.dumps(recipe.as_dict(), indent=2, ensure_ascii=False))


def _recipe(said: str) -> "tuple[Recipe, Path]":
    """Return the recipe of a file, or of an experiment alone, and the folder of the file."""
    from pftrack.core.model.recipe import Recipe

    path = Path(said)
    if path.suffix.lower() != ".json":
        return Recipe(experiment=find_experiment(said).id), path.parent
    try:
        return Recipe.read(json_format.loads(path.read_text(encoding="utf-8-sig"))), path.parent
    except FileNotFoundError:
        raise CommandError(f"there is no file {path}") from None
    except (UnicodeDecodeError, json_format.JSONDecodeError) as error:
        raise CommandError(f"{path.name} is no JSON: {error}") from None


def _draw_mark(made: "Run") -> bytes:
    """Return a picture of the first frame with the mark on it."""
    from pftrack.core.model.drawing import Drawing, Picture
    from pftrack.vision.rendering import png, render

    footage, image = made.setup.footage, made.current.frame.image_rgb
    if footage is None or image is None:
        raise wrong_use("--mark-out needs --video: nothing is marked in a simulated scene")
    height, width, _ = image.shape
    mark = made.experiment.video.mark(footage.mark).draw()
    return png(render(Drawing(width, height, {"picture": Picture(image), **mark})))


def _guidance_value(experiment: "Experiment", learned: Path | None) -> "dict[str, Value]":
    """Return the value of the parameter that takes a learned file."""
    return {} if learned is None else {guidance_of(experiment, "--learned").parameter: text_of(learned)}


def _preset_values(setup: "Setup", preset: "Preset") -> "Mapping[str, Value]":
    """Return a preset's values, if the source that it is used with has all these parameters."""
    from pftrack.core.model.parameters import declarations

    known = {declaration.name for declaration in declarations(type(setup.parameters))}
    foreign = [name for name in preset.parameters if name not in known]
    if foreign:
        raise wrong_use(f"the preset {preset.name} is of the simulated scene: a recording has no {', '.join(foreign)}")
    return preset.parameters


def _note_unread(experiment: "Experiment", setup: "Setup", values: "Mapping[str, Value]", tracker: str) -> None:
    for declaration in experiment.declarations(type(setup.parameters)):
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


def _suitability(made: "Run", sequence: "FrameSequence | None") -> dict[str, Any]:
    """Return how far the target can be followed, and say so before it is tracked if that is not well."""
    footage, suits = made.setup.footage, made.experiment.video.suits
    if sequence is None or footage is None or suits is None:
        return {}
    found = suits(sequence, footage, made.parameters_at(0))
    remark = " ".join(found.sentences)
    if found.grade != "well":
        note(f"pftrack: {remark}")
    return {"suitability": found.value, "suitability_remark": remark}


def compute_run(run: "Run", video_out: Path | None, *, frames: int) -> dict[str, Any]:
    """Compute a run, and a film of it if one is wanted, and return how it went."""
    from pftrack.core.model.faults import without_faults
    from pftrack.runs.loss_probability import measure_loss_probability
    from pftrack.runs.scoring import reductions
    from pftrack.vision.rendering import render_beside
    from pftrack.vision.rendering.film import FilmWriter

    with ExitStack() as stack:
        film = stack.enter_context(FilmWriter(video_out, run.source.frame_rate_hz)) if video_out else None
        tick = stack.enter_context(progress(f"{run.experiment.id}, {run.tracker}"))
        for step in islice(run, frames):
            if film is not None:
                drawing = without_faults(run.experiment.draw(step, run.diagnostics))
                film.write(render_beside(drawing, layers=run.experiment.shown_layers))
            if run.position % REPORT_EVERY == 0:
                tick(run.position, frames)
    said = run.experiment.report(run.diagnostics) if run.experiment.report else {}
    kept = reductions(run.experiment.all_series(), run.diagnostics[1:])
    known = {name: value for name, value in kept.items() if value is not None}
    return {**run.summary().as_dict(), **measure_loss_probability(run), **known, **said}


def print_summary(summary: Mapping[str, object], run: "Run", *, json: bool) -> None:
    """Print how a run went; people are told of its parameters which ones differ from their defaults."""
    from pftrack.core.model.parameters import flat

    if json:
        emit(summary)
    else:
        short = {name: value for name, value in summary.items() if value is not None and not _is_series(value)}
        defaults = flat(run.setup.parameters)
        changed = {name: value for name, value in flat(run.parameters_at(0)).items() if value != defaults[name]}
        short["parameters"] = changed or "the defaults"
        rows = [(name.replace("_", " "), _format_value(value)) for name, value in short.items()]
        table("", ("", ""), rows)


def _is_series(value: object) -> bool:
    """Whether a value is empty, or has a number for every frame: nothing for a table."""
    return isinstance(value, list) and (not value or isinstance(value[0], float))


def _format_value(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{name}={_format_value(item)}" for name, item in value.items())
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_format_value, value))}]"
    if isinstance(value, str) and len(value) > LONGEST_SHOWN:  # the text of a file
        return f"{' '.join(value[:LONGEST_SHOWN].split())}..."
    return f"{value:.4g}" if isinstance(value, float) else str(value)
