"""Opening: the run that a file or a recipe describes, at its frame 0, ready to be computed again."""

from collections.abc import Callable, Mapping
from pathlib import Path

from pftrack.core.model.parameters import ParameterError
from pftrack.core.model.recipe import Footage, Recipe
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import FrameSequence, Truth
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.own.code import FilterFileError
from pftrack.experiments.own.extension import experiment_of
from pftrack.runs.record import RecordError, read
from pftrack.runs.run import Run
from pftrack.sources.truth import TruthKind

OpenSequence = Callable[[Footage], FrameSequence]
"""Find the pictures that a recipe's footage speaks of."""


def load(path: Path, *, open_sequence: OpenSequence | None = None) -> Run:
    """Return the run of a file, at its frame 0; computing it gives the saved numbers again.

    Args:
        path: A .pft file.
        open_sequence: How to find the pictures of a run on a recording.

    Raises:
        RecordError: It is no saved run, its source is not to be had, or its parameters are not known here.
    """
    return make(read(path).recipe, open_sequence=open_sequence)


def make(recipe: Recipe, *, open_sequence: OpenSequence | None = None) -> Run:
    """Return the run of a recipe, at its frame 0; see `load`."""
    try:
        experiment = experiment_of(recipe)
        return Run.from_recipe(recipe, experiment, wire(experiment, recipe.footage, open_sequence))
    except FilterFileError:
        raise
    except (LookupError, ParameterError) as error:
        raise RecordError(f"the run does not fit this version of pftrack: {error}") from None


def wire(experiment: Experiment, footage: Footage | None, open_sequence: OpenSequence | None) -> Setup:
    """Return the setup of a recipe's footage, or of the experiment's own scene if there is none.

    Raises:
        RecordError: The pictures are not to be had, or are others.
        ParameterError: The experiment does not take such a mark or such a truth.
    """
    if footage is None:
        return experiment.simulate()
    name = footage.name or footage.path or "a recording"
    if not experiment.accepts_video:
        raise RecordError(f"the run is to be made on {name}, but {experiment.id} takes no recording")
    if open_sequence is None:
        raise RecordError(f"the run was made on {name}, which has to be given along with it")
    sequence = open_sequence(footage)
    experiment.check_footage(sequence.index.kind)
    if footage.sha256 not in {None, sequence.sha256}:
        raise RecordError(f"the run was made on {name}; {sequence.name} has other content")
    mark = None if footage.mark is None else experiment.video.mark(footage.mark)
    truth = _truth(experiment.video.truth, footage.truth or {})
    try:
        return experiment.video.on_video(sequence, mark, start=footage.start, truth=truth)
    except ParameterError:
        raise
    except ValueError as error:
        raise RecordError(f"{name} does not show where the run is to begin: {error}") from None


def _truth(kind: TruthKind | None, rows: Mapping[int, tuple[float, ...]]) -> Truth | None:
    """Return the truth of a recipe, held to what a file of its kind may say."""
    if kind is None:
        if rows:
            raise ParameterError("footage.truth", f"{len(rows)} frames", "left out: the experiment takes none")
        return None
    form = kind.form
    for frame, values in rows.items():
        if not form.allows(values):
            raise ParameterError(f"footage.truth.{frame}", values, f"a {form.one} of {form.unit}")
    return kind.table(rows) if rows else None
