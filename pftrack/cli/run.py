"""`run`, `replay`, `open` and `show-recipe`: compute a run from options, a recipe or a file, and report its result."""

import json as json_format
import math
import tempfile
from collections.abc import Mapping
from contextlib import ExitStack, closing
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pftrack.cli import output
from pftrack.cli.experiments import PresetName, Trust, chosen_tracker, find_experiment, find_preset
from pftrack.cli.exports import ExportOut, wanted_exports, write_exports
from pftrack.cli.footage import (
    FootageOptions,
    Large,
    Moved,
    TruthFirst,
    bit,
    footage_of,
    frames_left,
    open_footage,
    open_setup,
    path_from,
)
from pftrack.cli.sweep import guidance_of

if TYPE_CHECKING:
    from pftrack.core.model.parameters import Value
    from pftrack.core.model.preset import Preset
    from pftrack.core.model.recipe import Recipe
    from pftrack.core.model.setup import Setup
    from pftrack.core.model.source import FrameSequence
    from pftrack.experiments.experiment import Experiment
    from pftrack.runs.run import Run
    from pftrack.sources.results.table import Form


LONGEST_SHOWN = 80  # characters of a value in a table
REPORT_EVERY = 8  # frames; a progress bar must not cost more than the filter

VideoOut = Annotated[Path | None, typer.Option("--video-out", help="Write the run as a video, FILE.mp4.")]


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    for command in (run, replay, show_recipe):
        app.command()(command)
    app.command("open")(open_results)


@output.takes_options
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
    assignments: output.Assignments = None,
    learned: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Motion file from `learn`, for guided trackers.")
    ] = None,
    seed: Annotated[
        str | None, typer.Option(metavar="SEED", help="Random seed (default: the preset's or the recipe's, else 0).")
    ] = None,
    frames: Annotated[
        str | None, typer.Option(metavar="N", help="Number of frames to compute, at most those of a recording.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Save the run, FILE.pft.")] = None,
    video_out: VideoOut = None,
    export: ExportOut = None,
    mark_out: Annotated[
        Path | None, typer.Option("--mark-out", help="Write the first frame with the mark on it, FILE.png.")
    ] = None,
    trust: Trust = False,
    json: output.Json = False,
) -> None:
    """Run an experiment, or the recipe of a run, and print a summary."""
    from pftrack.core.model.recipe import LONGEST_RUN, Change
    from pftrack.runs.record import save
    from pftrack.runs.run import Run

    recipe, folder = _recipe(experiment)
    found, recipe, tracker = chosen_tracker(recipe, tracker, trusted=trust)
    begin = find_preset(found, preset)
    said_here = {"tracker": tracker, "seed": output.read_seed(seed)}
    changes: dict[str, Any] = {} if begin is None else {"tracker": begin.tracker, "seed": begin.seed}
    changes |= {name: value for name, value in said_here.items() if value is not None}
    wanted = output.whole("--frames", frames, 1, LONGEST_RUN) if frames is not None else None
    _check_places(out, video_out)
    exports = wanted_exports(found, export or [])
    with ExitStack() as stack:
        stack.enter_context(output.compiling())
        setup, sequence = open_setup(stack, found, recipe, said, folder)
        if wanted is not None:
            changes["frames"] = wanted if sequence is None else min(wanted, frames_left(sequence, setup))
        values = {
            **(_preset_values(setup, begin) if begin is not None else {}),
            **output.values_of(setup.parameters, assignments or []),
            **({guidance_of(found, "--learned").parameter: output.text_of(learned)} if learned is not None else {}),
        }
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
            with output.writing(out):  # an error would name the temporary file
                save(made, out, footage_path=path_from(said.video, out) if said.video else None)
    print_summary(summary, made, json=json)


def replay(
    file: Annotated[Path, typer.Argument(help="A run that was saved with `run --out` or from the page.")],
    video: Moved = None,
    video_out: VideoOut = None,
    export: ExportOut = None,
    trust: Trust = False,
    json: output.Json = False,
) -> None:
    """Compute a saved run again and check that it gives the same numbers."""
    from pftrack.experiments.own.code import trust_filters
    from pftrack.runs.record import read_saved
    from pftrack.runs.reproduction import difference, make

    _check_places(None, video_out)
    saved = read_saved(file)
    record = saved.record
    if trust:
        trust_filters(record.recipe)
    exports = wanted_exports(find_experiment(record.recipe.experiment), export or [])
    with ExitStack() as stack:
        stack.enter_context(output.compiling())
        again = make(record.recipe, open_sequence=footage_of(stack, file, video))
        summary = compute_run(again, video_out, frames=record.computed)
        write_exports(exports, again)
    apart = difference(again, saved)
    said = {"same_as_saved": apart is None, **({"differs": apart.as_dict()} if apart else {})}
    print_summary({**summary, **said}, again, json=json)
    if apart is not None:
        output.note(f"pftrack: {apart.sentence}")
        raise typer.Exit(output.FAILED)


def show_recipe(
    file: Annotated[Path, typer.Argument(help="A saved run, FILE.pft, or a recipe, FILE.json.")],
) -> None:
    """Print the recipe of a run as JSON, the input of `run`, without default values."""
    from pftrack.runs.record import read

    recipe = _recipe(str(file))[0] if file.suffix.lower() == ".json" else read(file).recipe
    typer.echo(json_format.dumps(recipe.as_dict(), indent=2, ensure_ascii=False))


def _recipe(said: str) -> "tuple[Recipe, Path]":
    """Return the recipe of a file, or of an experiment alone, and the folder of the file."""
    from pftrack.api import read_recipe
    from pftrack.core.model.recipe import Recipe

    path = Path(said)
    is_file = path.suffix.lower() == ".json"
    return read_recipe(path) if is_file else Recipe(experiment=find_experiment(said).id), path.parent


def _draw_mark(made: "Run") -> bytes:
    """Return a picture of the first frame with the mark on it."""
    from pftrack.core.model.drawing import Drawing, Picture
    from pftrack.vision.rendering import png, render

    footage, image = made.setup.footage, made.current.frame.image_rgb
    if footage is None or image is None:
        raise output.wrong_use("--mark-out needs --video: nothing is marked in a simulated scene")
    height, width, _ = image.shape
    mark = made.experiment.video.mark(footage.mark).draw()
    return png(render(Drawing(width, height, {"picture": Picture(image), **mark})))


def _preset_values(setup: "Setup", preset: "Preset") -> "Mapping[str, Value]":
    """Return a preset's values, if the source that it is used with has all these parameters."""
    from pftrack.core.model.parameters import declarations

    known = {declaration.name for declaration in declarations(type(setup.parameters))}
    foreign = [name for name in preset.parameters if name not in known]
    if foreign:
        raise output.wrong_use(
            f"the preset {preset.name} belongs to the simulated scene: a recording has no {', '.join(foreign)}"
        )
    return preset.parameters


def _note_unread(experiment: "Experiment", setup: "Setup", values: "Mapping[str, Value]", tracker: str) -> None:
    for declaration in experiment.declarations(type(setup.parameters)):
        if declaration.name in values and declaration.trackers and tracker not in declaration.trackers:
            output.note(
                f"pftrack: {declaration.name} is not read by {tracker}, only by {', '.join(declaration.trackers)}"
            )


def _check_places(out: Path | None, film: Path | None) -> None:
    """Refuse places that cannot be written before anything is computed."""
    if film is not None and film.suffix.lower() != ".mp4":
        raise output.wrong_use(f"--video-out must end in .mp4, got {film.name!r}")
    if out is not None and film is not None and out.absolute() == film.absolute():
        raise output.wrong_use("--out and --video-out must be different files")
    output.check_writable(*filter(None, (out, film)))


def _suitability(made: "Run", sequence: "FrameSequence | None") -> dict[str, Any]:
    """Return the suitability of the target, and warn before tracking if it is poor."""
    footage, suits = made.setup.footage, made.experiment.video.suits
    if sequence is None or footage is None or suits is None:
        return {}
    found = suits(sequence, footage, made.parameters_at(0))
    remark = " ".join(found.sentences)
    if found.grade != "well":
        output.note(f"pftrack: {remark}")
    return {"suitability": found.value, "suitability_remark": remark}


def compute_run(run: "Run", video_out: Path | None, *, frames: int) -> dict[str, Any]:
    """Compute a run, and a film of it if requested, and return its result."""
    from pftrack.core.model.faults import without_faults
    from pftrack.runs.loss_probability import measure_loss_probability
    from pftrack.runs.scoring import reductions
    from pftrack.vision.film import FilmWriter
    from pftrack.vision.rendering import render_beside

    with ExitStack() as stack:
        film = stack.enter_context(FilmWriter(video_out, run.source.frame_rate_hz)) if video_out else None
        tick = stack.enter_context(output.progress(f"{run.experiment.id}, {run.tracker}"))
        for step in islice(run, frames):
            if film is not None:
                drawing = without_faults(run.experiment.draw(step, run.diagnostics))
                film.write(render_beside(drawing, layers=run.experiment.display.shown))
            if run.position % REPORT_EVERY == 0:
                tick(run.position, frames)
    nothing = [row.frame for row in run.diagnostics if row.log_evidence == -math.inf]
    if nothing:
        many = f"{len(nothing):,} of {len(run.diagnostics):,} frames, first in frame {nothing[0]}"
        output.note(f"pftrack: all weights were zero in {many}; replaced by equal weights")
    said = run.experiment.measured.report(run.diagnostics) if run.experiment.measured.report else {}
    kept = reductions(run.experiment.all_series(), run.diagnostics[1:])
    known = {name: value for name, value in kept.items() if value is not None}
    return {**run.summary().as_dict(), **measure_loss_probability(run), **known, **said}


def print_summary(summary: Mapping[str, object], run: "Run", *, json: bool) -> None:
    """Print the result of a run; the table for people lists the parameters that differ from their defaults."""
    from pftrack.core.model.parameters import flat

    if json:
        output.emit(summary)
    else:
        short = {name: value for name, value in summary.items() if value is not None and not _is_series(value)}
        defaults = flat(run.setup.parameters)
        changed = {name: value for name, value in flat(run.parameters_at(0)).items() if value != defaults[name]}
        short["parameters"] = changed or "the defaults"
        rows = [(name.replace("_", " "), _format_value(value)) for name, value in short.items()]
        output.table("", ("", ""), rows)


def _is_series(value: object) -> bool:
    """Whether a value is empty, or has a number for every frame: nothing for a table."""
    return isinstance(value, list) and (not value or isinstance(value[0], float))


def _format_value(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{name}={_format_value(item)}" for name, item in value.items())
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_format_value, value))}]"
    if isinstance(value, str) and len(value) > LONGEST_SHOWN and "\n" in value:  # the text of a file
        return f"{' '.join(value[:LONGEST_SHOWN].split())}..."
    return output.cell(value)


def open_results(
    file: Annotated[
        Path,
        typer.Argument(
            help="A recording of beliefs, FILE.pft, or results: MOTChallenge, OTB or VOT text, CVAT's video XML, "
            "COCO's video JSON, or a table of boxes (CSV)."
        ),
    ],
    video: Annotated[Path | None, typer.Option(help="The video of the results or the recording.")] = None,
    truth: Annotated[Path | None, typer.Option(help="True boxes of the same frames, in any of these forms.")] = None,
    form: Annotated[
        str | None, typer.Option(help="Form of the results: mot, otb, vot, cvat, coco or csv (default: detected).")
    ] = None,
    first_frame: Annotated[str | None, typer.Option(metavar="0|1", help="Number of a text file's first frame.")] = None,
    first_pixel: Annotated[str | None, typer.Option(metavar="0|1", help="Number of a text file's first pixel.")] = None,
    truth_first: TruthFirst = None,
    large: Large = False,
    out: Annotated[
        Path | None, typer.Option(help="Keep results, clip and truth as one recording, FILE.pft, for the page.")
    ] = None,
    export: ExportOut = None,
    assignments: output.Assignments = None,
    show: Annotated[bool, typer.Option(help="Open the scene in a browser.")] = True,
    json: output.Json = False,
) -> None:
    """Show results of your own loop or of any other tracker: errors, overlap, identity switches."""
    from pftrack.core.model.recipe import Change
    from pftrack.experiments import find_for
    from pftrack.output.exports.formats import show as show_run
    from pftrack.runs.run import Run
    from pftrack.sources.beliefs.sequence import BeliefSequence
    from pftrack.sources.limits import DEFAULT_LIMITS, LARGE_LIMITS
    from pftrack.sources.results.parts import Part, open_parts
    from pftrack.sources.results.table import FORMS

    if form is not None and form not in FORMS:
        raise output.wrong_use(f"--form must be one of {', '.join(FORMS)}, got {form[:40]!r}")
    experiment = find_for("beliefs")
    exports = wanted_exports(experiment, export or [])
    with ExitStack() as stack:
        said = form or first_frame or first_pixel or truth_first
        if out is not None or said:
            place = out or Path(stack.enter_context(tempfile.TemporaryDirectory()), f"{file.stem}.pft")
            options = (bit("--first-frame", first_frame), bit("--first-pixel", first_pixel))
            _record(file, place, video, truth, form, *options, bit("--truth-first-frame", truth_first))
            sequence = open_footage(stack, place, large=large)
        elif video is not None or truth is not None:
            parts: dict[Part, Path | None] = {"clip": video, "results": file, "truth": truth}
            limits = LARGE_LIMITS if large else DEFAULT_LIMITS
            together = open_parts({part: path for part, path in parts.items() if path is not None}, limits)
            sequence = stack.enter_context(closing(together))
        else:
            sequence = open_footage(stack, file, large=large)
        if not isinstance(sequence, BeliefSequence) or not experiment.accepts_video:
            raise output.CommandError(f"{file.name} holds no results; `pftrack run` tracks a recording")
        for warning in sequence.index.warnings:
            output.note(f"pftrack: {warning}")
        setup = experiment.video.on_video(sequence, None)
        values = output.values_of(setup.parameters, assignments or [])
        run = Run(experiment, setup, timeline=(Change(0, values),))
        targets = {
            "targets": len(sequence.content.targets),
            "measured_target": run.current.state.beliefs.selected.target,
        }
        if targets["targets"] > 1:
            said = f"it has {targets['targets']} targets, and target {targets['measured_target']} is measured"
            output.note(f"pftrack: {said}; --set selected_target=NUMBER chooses another")
        summary = compute_run(run, None, frames=run.frames)
        if sequence.content.has_truth and not summary["labelled_frames"]:
            output.note("pftrack: the selected target never overlaps a true box by half, so no error is measured")
        print_summary({**summary, **targets}, run, json=json)
        write_exports(exports, run)
        if show and not json:
            shown = show_run(run)
            output.note(f"pftrack: the scene is at {shown.address}; Ctrl-C ends")
            shown.wait()


def _record(
    file: Path,
    to: Path,
    video: Path | None,
    truth: Path | None,
    form: "Form | None",
    first_frame: int | None,
    first_pixel: int | None,
    truth_first: int | None,
) -> None:
    from pftrack.sources.results.parts import record_results
    from pftrack.sources.results.writing import read_results_file

    try:
        known = None if truth is None else read_results_file(truth, first_frame=truth_first)
        results = read_results_file(file, form=form, first_frame=first_frame, first_pixel=first_pixel)
    except ValueError as error:
        raise output.CommandError(str(error)) from None
    with output.writing(to):
        record_results(results, to, clip=video, truth=known)
