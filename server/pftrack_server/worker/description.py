"""The description of a session: what is fixed of it while it lives, read from its run."""

from collections.abc import Iterator

from pftrack.analysis.fitting.found import fittable
from pftrack.core.model.parameters import Declaration, flat
from pftrack.core.model.preset import Preset
from pftrack.experiments.own.extension import parameters_of
from pftrack.experiments.shared.loss_probability import LOSS_PROBABILITY
from pftrack.output.exports.formats import exports_of
from pftrack.runs.run import Run
from pftrack_server.schemas.description import ExportPublic, MeasurePublic, SessionDescription, TrackerPublic, TruthMark


def describe(run: Run) -> SessionDescription:
    """Return what is fixed of a session whose active branch is this run."""
    experiment, setup, source, footage = run.experiment, run.setup, run.source, run.recipe.footage
    told = (LOSS_PROBABILITY,) if experiment.quality.loss_probability.models_on(footage) else ()
    width, height = source.size
    preset = _preset_of(run)
    # Whoever writes a filter wants its sliders at hand.
    own = [name for tracker, texts in experiment.filters.items() for name in parameters_of(tracker, texts)]
    truth = experiment.video.truth if footage else None
    return SessionDescription(
        title=experiment.title_on(footage),
        subject=footage.title if footage else preset.title if preset else "",
        unit=experiment.unit,
        target=experiment.target,
        series=[*experiment.all_series(), *told],
        plots=list(experiment.plots),
        readings=list(experiment.readings),
        measures=[MeasurePublic(**measure.as_dict()) for measure in experiment.measures_on(setup.footage)],
        success_measure=setup.success,
        exports=[ExportPublic.model_validate(one) for one in exports_of(experiment)],
        about=[*own, *experiment.subjects(preset, footage)],
        watch=preset.watch if preset else "",
        truth_columns=list(truth.form.columns) if truth else [],
        truth_mark=TruthMark(editor=truth.mark.editor(), parts=list(truth.parts)) if truth and truth.mark else None,
        declarations=list(experiment.declarations(type(setup.parameters))),
        trackers=[
            TrackerPublic(id=name, title=tracker.title, replays=tracker.replays)
            for name, tracker in experiment.trackers.items()
        ],
        fittable={name: [it.name for it in numbers] for name, numbers in _fittable(run) if numbers},
        layers=list(experiment.layers),
        worlds=list(experiment.worlds),
        width=width,
        height=height,
        frame_rate_hz=source.frame_rate_hz,
        frames=run.frames,
    )


def _fittable(run: Run) -> Iterator[tuple[str, tuple[Declaration, ...]]]:
    for name in run.experiment.trackers:
        yield name, fittable(run.experiment, name, type(run.setup.parameters))


def _preset_of(run: Run) -> Preset | None:
    """Return the preset that a run begins as; a recording is none."""
    if run.recipe.footage is not None:
        return None
    values, defaults = flat(run.parameters_at(0)), flat(run.setup.parameters)
    return run.experiment.preset_of(run.tracker_at(0), run.recipe.seed, values, defaults)
