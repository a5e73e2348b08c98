"""Functions that run in confined processes: read and compute records, export, fit, compare and explore runs.

Runs of sessions, records and recipes are made in the same way as those of sessions, under the same limits. A function
that may take minutes is a generator: it yields the steps done and the total, and returns its result.
"""

import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

from pftrack.analysis.counterfactuals import read_record as read_report
from pftrack.analysis.counterfactuals import record, what_if
from pftrack.analysis.diagnosis import diagnose
from pftrack.analysis.explanation import Explanation
from pftrack.analysis.fitting import fit
from pftrack.analysis.other_seeds import RUNS, Scene, ensembling, other_seeds
from pftrack.core.files import write_whole
from pftrack.core.model.parameters import Parameters, flat, limit_particles
from pftrack.core.model.recipe import Footage, check_timeline
from pftrack.core.model.series import as_json
from pftrack.core.model.setup import find_export
from pftrack.core.model.source import FrameSequence
from pftrack.core.numerics.random import LARGEST_SEED
from pftrack.core.refusal import ParameterError, RefusedError
from pftrack.experiments.own.code import trust
from pftrack.output.exports.comparisons import COMPARISON_FORMATS
from pftrack.output.exports.formats import exporting, exports_of
from pftrack.process import report
from pftrack.runs.comparison import Comparison
from pftrack.runs.record import Saved, read_saved
from pftrack.runs.reproduction import departure, difference, make
from pftrack.runs.run import Run
from pftrack.sources.sequence import Recording
from pftrack.vision.rendering import png, render
from pftrack_server.jobs.functions import Steps
from pftrack_server.sessions.worker.protocol import WorkerConfig
from pftrack_server.sessions.worker.run_tree import RunTree

FIT_STEPS = 1000
FIT_COMPUTED = 100
"""Steps of a fit's progress that stand for computing the run."""
TELL_S = 0.25
"""Interval of reports, s: writing one takes some milliseconds, and the page polls at this rate."""

Growing: TypeAlias = Generator[dict[str, Any], None, dict[str, Any]]


def read_record(path: str) -> dict[str, Any]:
    """Return a record's metadata of its run."""
    return _read_record(path).record.model_dump(mode="json")


def weigh_record(path: str, upload: Recording | None, most_frames: int, filters: tuple[str, ...] = ()) -> Steps:
    """Compute a record's run up to its last computed frame, and return its outcome; a step is a frame.

    Args:
        path: The record.
        upload: The upload of its recording, if it exists here.
        most_frames: Most frames of a run on this server.
        filters: Texts of filters that the run may execute.
    """
    trust(*filters)
    saved = _read_record(path)
    found = saved.record
    recipe = found.recipe
    if recipe.frames is not None and recipe.frames > most_frames:
        raise ParameterError("frames", recipe.frames, f"at most {most_frames} on this server")
    if recipe.seed > LARGEST_SEED:
        raise ParameterError("seed", recipe.seed, f"at most {LARGEST_SEED}, since browsers round beyond it")
    run = make(recipe, open_sequence=partial(_reopen_footage, upload))
    check_timeline(run.timeline.changes, run.frames)
    last = min(found.computed, run.frames) - 1
    for step in run.seeking(last):
        yield step.diagnostics.frame + 1, last + 1
    drawing = run.experiment.draw(run.current, run.diagnostics)
    apart = difference(run, saved)
    return {
        "title": run.experiment.title,
        "summary": {
            **run.summary().as_dict(),
            "reproduced": apart is None,
            **({"differs": {**apart.as_dict(), "sentence": apart.sentence}} if apart else {}),
        },
        "thumbnail": png(render(drawing, layers=run.experiment.display.shown)),
    }


def _reopen_footage(upload: Recording | None, footage: Footage) -> FrameSequence:
    """Open the upload that a run was made on.

    Raises:
        RefusedError: The upload is missing.
    """
    if upload is None:
        name = footage.name or "a recording"
        raise RefusedError(f"The run was made on {name}, which is not on this server; upload it first")
    return upload.open(square=footage.square)


def compare_record(path: str, estimates: list[list[float]]) -> str | None:
    """Return where estimates differ from those of a record, over the common frames; None if they do not."""
    apart = departure(estimates, _read_record(path))
    return None if apart is None else f"{apart.sentence[:1].upper()}{apart.sentence[1:]}."


def _read_record(path: str) -> Saved:
    try:
        return read_saved(Path(path))
    except RefusedError as error:
        # Do not reveal the server's name of the file.
        raise RefusedError(str(error).replace(Path(path).name, "The file")) from None


def write_export(
    config: WorkerConfig, export: str, plot: str | None, known: Mapping[str, Any] | None, path: str
) -> Steps:
    """Write a run as a file; the first half of the steps computes the run, the second writes it.

    Args:
        config: Configuration of the run, with its goal.
        export: Name of the export.
        plot: Id of the one plot to show; None for all.
        known: The what-if record of the run, if there is one.
        path: The file to write.
    """
    run = _run(config)
    last = min(config.run.computed, run.frames - 1)
    frames = last + 1
    for step in run.seeking(last):
        yield step.diagnostics.frame + 1, 2 * frames
    run.seek(min(config.run.position, last))
    if known is not None:
        found = read_report(known)
        run.explained = Explanation(diagnose(run, found.loss), found, before=found.begin)
    kind = find_export(exports_of(run.experiment), export)
    for done, of in exporting(run, Path(path), kind, plot):
        yield frames + frames * done // of, 2 * frames
    return {}


def fit_run(config: WorkerConfig, names: tuple[str, ...]) -> Steps:
    """Fit parameters of a run's tracker to the run's data, starting from their current values, and return the fit."""
    run = _run(config)
    last = min(config.run.computed, run.frames - 1)
    for step in run.seeking(last):
        yield FIT_COMPUTED * step.diagnostics.frame // max(last, 1), FIT_STEPS
    run.seek(min(config.run.position, last))

    def tell(done: int, most: int) -> None:
        report((FIT_COMPUTED + (FIT_STEPS - FIT_COMPUTED) * done // most, FIT_STEPS))

    return fit(run, names, on_step=tell).as_dict()


def outline_comparison(configs: Sequence[WorkerConfig]) -> dict[str, Any]:
    """Return the outline of a comparison, before anything is computed.

    Raises:
        RefusedError: The runs cannot be compared.
    """
    return as_json(_compare(configs).outline)


def compare_runs(configs: Sequence[WorkerConfig]) -> Steps:
    """Compute the common frames of runs, and return the comparison; a step is a frame of a run."""
    compared = _compare(configs)
    yield from compared.computing()
    return as_json(compared.result)


def write_comparison(configs: Sequence[WorkerConfig], export: str, path: str) -> Steps:
    """Compute the common frames of runs, and write the comparison as a file.

    Args:
        configs: Configurations of the runs.
        export: Name of the export.
        path: The file to write.
    """
    compared = _compare(configs)
    yield from compared.computing()
    write_whole(Path(path), find_export(COMPARISON_FORMATS, export).make(compared))
    return {}


def explore_changes(config: WorkerConfig, frame: int | None, share: tuple[int, int], seconds: float) -> Growing:
    """Try changes that would have saved a run, and yield the growing report as a record.

    Args:
        config: Configuration of the run, with its goal.
        frame: A frame of the loss; None for the first lasting one.
        share: (k, n): only the k-th of n parts of the changes is tried.
        seconds: Time limit, s.

    Raises:
        RefusedError: The run has not lost its target.
    """
    run = _run(config)
    run.seek(min(max(config.run.computed, run.computed), run.frames - 1))

    def allow(tracker: str, parameters: Parameters) -> bool:
        declared = run.experiment.declarations(type(parameters))
        try:
            limit_particles(declared, flat(parameters), tracker, config.max_particles)
        except ParameterError:
            return False
        return True

    growing = what_if(run, frame, allow=allow, share=share)
    return (yield from _tell(growing, record, seconds))


def explore_seeds(config: WorkerConfig, frames: int, scene: Scene, seconds: float) -> Growing:
    """Compute runs of the same settings with other seeds, and yield their growing bands.

    Args:
        config: Configuration of the run.
        frames: Number of frames.
        scene: Whether each run sees the same scene or that of its own seed.
        seconds: Time limit, s.
    """
    run = _run(config)
    growing = ensembling(run, other_seeds(run.seed, RUNS), min(frames, run.frames), scene=scene)
    return (yield from _tell(growing, lambda found: as_json(found.bands), seconds))


def _run(config: WorkerConfig) -> Run:
    trust(*config.filters)
    return RunTree(config).run


def _compare(configs: Sequence[WorkerConfig]) -> Comparison:
    return Comparison.of(*map(_run, configs))


def _tell(growing: Iterator[Any], words: Callable[[Any], dict[str, Any]], seconds: float) -> Growing:
    """Continue while there is time, yield the findings at intervals, and return the last ones."""
    last = next(growing)
    begun = told = time.monotonic()  # imports and compiled code are loaded by now
    for last in growing:
        now = time.monotonic()
        if now - begun > seconds:
            break
        if now - told > TELL_S:
            yield words(last)
            told = now
    return words(last)
