"""Comparing a run with its saved numbers, and writing the code that reproduces it.

A few lines of Python or a command reproduce a run or a comparison of runs:

    pftrack run ball --preset works --frames 77 --set occlusion_width_px=55

For a run with a mark or with later changes of parameters, the code holds its recipe as a person would write it.
"""

import json
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from pprint import pformat
from typing import Any

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.parameters import flat
from pftrack.core.model.recipe import Footage, Recipe
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import FrameSequence, Truth
from pftrack.core.numerics import machine
from pftrack.core.refusal import ParameterError, RefusedError
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.own import version_parameter
from pftrack.experiments.own.extension import experiment_of
from pftrack.runs.record import Saved, read
from pftrack.runs.run import Run
from pftrack.sources.truth import TruthKind

UNKNOWN = "an earlier version, which did not record the machine"


@dataclass(frozen=True)
class Difference:
    """The difference between a run and its saved numbers.

    Attributes:
        frame: First frame that differs; None if the file has no numbers.
        largest: Largest difference of an estimate, in the experiment's unit; None if the file has no numbers, or if
            only non-finite values differ.
        computed_on: Machine and libraries of the saved run.
    """

    frame: int | None
    largest: float | None
    computed_on: Mapping[str, str]

    @property
    def sentence(self) -> str:
        """The difference as a sentence for people."""
        begin = "the numbers differ from the saved ones"
        if self.frame is not None:
            begin += f" from frame {self.frame} on"
        if self.largest is not None:
            begin += f", by up to {self.largest:.2g}"
        here, there = machine.describe_platform(), self.computed_on
        if not there:
            return f"{begin}; they were computed by {UNKNOWN}"
        others = [name for name in here if there.get(name) != here[name]]
        changed = [f"{name} {there.get(name, 'unknown')} (here {here[name]})" for name in others]
        return f"{begin}; they were computed on {', '.join(changed) or 'a machine like this one'}"

    def as_dict(self) -> dict[str, object]:
        """Return the difference as JSON shows it."""
        return {"first_frame": self.frame, "largest": self.largest, "saved_on": dict(self.computed_on)}


def difference(run: Run, saved: Saved) -> Difference | None:
    """Return the difference between a run and its saved numbers; None if they are equal bit for bit.

    Args:
        run: The run, computed as far as the saved one.
        saved: Result of `pftrack.runs.record.read_saved`.
    """
    if run.estimates_sha256 == saved.record.estimates_sha256:
        return None
    rows = [row.estimate for row in run.diagnostics]
    return departure(rows, saved) or Difference(None, None, saved.record.computed_on)


def departure(estimates: Sequence[Sequence[float]], saved: Saved) -> Difference | None:
    """Return the difference between estimates and saved ones in their common frames; None if there is none.

    Args:
        estimates: Estimates of the first frames of a run.
        saved: Result of `pftrack.runs.record.read_saved`.
    """
    if saved.estimates is None:
        return None
    count = min(len(estimates), len(saved.estimates))
    one, other = np.array(estimates[:count], np.float64), saved.estimates[:count]
    if count == 0 or one.shape != other.shape:
        return None
    apart = _apart(one, other)
    differs = apart != 0.0
    if not differs.any():
        return None
    finite = apart[differs & np.isfinite(apart)]
    return Difference(int(np.argmax(differs)), float(finite.max()) if len(finite) else None, saved.record.computed_on)


def _apart(one: Floats, other: Floats) -> Floats:
    """Return the largest difference in each frame, (L,); NaN equals NaN."""
    same = (one == other) | (np.isnan(one) & np.isnan(other))
    with np.errstate(invalid="ignore"):
        away: Floats = np.where(same, 0.0, np.abs(one - other)).max(axis=1)
    return away


WIDTH = 100


@dataclass(frozen=True, slots=True)
class SourceCode:
    """Code of a computation in two forms.

    Attributes:
        python: Python code.
        command: Shell commands.
    """

    python: str
    command: str


@dataclass(frozen=True, slots=True)
class _Told:
    """A recipe as arguments of a call.

    Attributes:
        options: Tracker, preset, seed and frames that differ from the defaults.
        values: Parameters of frame 0.
        recipe: The complete recipe, if arguments cannot express it.
        recording: Name of the recording, if there is one.
    """

    options: dict[str, Any]
    values: dict[str, Any]
    recipe: dict[str, Any] | None
    recording: str | None


def run_code(recipe: Recipe, experiment: Experiment, frames: int | None = None) -> SourceCode:
    """Return the code that reproduces a run.

    Args:
        recipe: Recipe of the run.
        experiment: The experiment that the recipe names, with the filters that the recipe brings.
        frames: Number of computed frames; None for all.

    Raises:
        ParameterError: The recipe names a tracker or a parameter that the experiment does not have.
    """
    told = _tell(recipe, experiment, frames)
    return SourceCode(
        f"import pftrack\n\nrun = {_python(recipe, told)}\nprint(run.estimates_sha256)\n",
        _command(recipe, told, "run.json"),
    )


def comparison_code(runs: Sequence[tuple[Recipe, Experiment]], frames: int | None = None) -> SourceCode:
    """Return the code that compares runs, each with its experiment; see `run_code`."""
    told = [_tell(recipe, experiment, frames) for recipe, experiment in runs]
    names = [f"run_{number}" for number in range(1, len(runs) + 1)]
    made = [f"{name} = {_python(recipe, each)}" for name, (recipe, _), each in zip(names, runs, told, strict=True)]
    python = "\n".join(["import pftrack", "", *made, f"compared = pftrack.compare({', '.join(names)})", *SHOWN])
    saved = [f"{name}.pft" for name in names]
    commands = [
        _command(recipe, each, f"{name}.json", f"--out {name}.pft")
        for name, (recipe, _), each in zip(names, runs, told, strict=True)
    ]
    return SourceCode(f"{python}\n", "".join(commands) + f"pftrack compare {' '.join(saved)}\n")


SHOWN = ("for name, outcome in zip(compared.names, compared.outcomes):", "    print(name, outcome.as_dict())")


def _tell(recipe: Recipe, experiment: Experiment, frames: int | None) -> _Told:
    experiment.check_names(recipe)  # names of parameters become names of arguments
    length = frames if frames is not None else recipe.frames
    first = recipe.timeline[0] if recipe.timeline and recipe.timeline[0].frame == 0 else None
    values = dict(first.values) if first else {}
    tracker = str(values.pop("tracker", recipe.tracker or experiment.default_tracker))
    footage = recipe.footage
    options: dict[str, Any] = {}
    single = all(len(texts) == 1 for texts in recipe.filters.values())
    if len(recipe.timeline) > (first is not None) or footage is not None or recipe.defaults or not single:
        whole = recipe.with_footage(path=None).model_copy(update={"frames": length})
        return _Told(options, {}, whole.as_dict(), footage.name or "recording.mp4" if footage else None)
    values = {name: value for name, value in values.items() if name not in map(version_parameter, recipe.filters)}
    usual = flat(experiment.simulate().parameters)
    preset = experiment.preset_of(tracker, recipe.seed, {**usual, **values}, usual)
    if preset is not None:
        options["preset"], values = preset.name, {}
    else:
        if tracker != experiment.default_tracker:
            options["tracker"] = f"{tracker}.py" if tracker in recipe.filters else tracker
        if recipe.seed:
            options["seed"] = recipe.seed
    if length is not None and length != experiment.frames:
        options["frames"] = length
    return _Told(options, values, None, None)


def _python(recipe: Recipe, told: _Told) -> str:
    if told.recipe is None:
        named = [f"{name}={value!r}" for name, value in {**told.options, **told.values}.items()]
        one = f"pftrack.run({', '.join([repr(recipe.experiment), *named])})"
        if len(one) <= WIDTH - 6:
            return one
        inside = "".join(f"    {each},\n" for each in [repr(recipe.experiment), *named])
        return f"pftrack.run(\n{inside})"
    made = pformat(told.recipe, width=WIDTH - 4, sort_dicts=False).replace("\n", "\n    ")
    where = "" if told.recording is None else f"    recording={told.recording!r},  # where it lies here\n"
    return f"pftrack.run(\n    {made},\n{where})"


def _command(recipe: Recipe, told: _Told, file: str, *more: str) -> str:
    """Return the command; a recipe that options cannot express goes into a file first."""
    if told.recipe is not None:
        # A quoted here-document; JSON cannot contain the line EOF that ends it.
        text = json.dumps(told.recipe, indent=2, ensure_ascii=False)
        video = [] if told.recording is None else ["--video", shlex.quote(told.recording)]
        return f"cat > {file} <<'EOF'\n{text}\nEOF\n{' '.join(['pftrack run', file, *video, *more])}\n"
    words = ["pftrack", "run", recipe.experiment]
    for name, value in told.options.items():
        words += [f"--{name}", str(value)]
    for name, value in told.values.items():
        words += ["--set", f"{name}={value}"]
    return " ".join([*map(shlex.quote, words), *more]) + "\n"


# Opening: the run that a file or a recipe describes, at its frame 0, ready to be computed again.

OpenSequence = Callable[[Footage], FrameSequence]
"""Find the pictures that a recipe's footage speaks of."""


def load(path: Path, *, open_sequence: OpenSequence | None = None) -> Run:
    """Return the run of a file, at its frame 0; computing it gives the saved numbers again.

    Args:
        path: A .pft file.
        open_sequence: How to find the pictures of a run on a recording.

    Raises:
        RefusedError: It is not a saved run, its source is missing, or its parameters are unknown here.
    """
    return make(read(path).recipe, open_sequence=open_sequence)


def make(recipe: Recipe, *, open_sequence: OpenSequence | None = None) -> Run:
    """Return the run of a recipe, at its frame 0; see `load`."""
    try:
        experiment = experiment_of(recipe)
        return Run.from_recipe(recipe, experiment, wire(experiment, recipe.footage, open_sequence))
    except ParameterError as error:
        raise RefusedError(f"the run does not fit this version of pftrack: {error}") from None


def wire(experiment: Experiment, footage: Footage | None, open_sequence: OpenSequence | None) -> Setup:
    """Return the setup of a recipe's footage, or of the experiment's own scene if there is none.

    Raises:
        RefusedError: The pictures are missing, or are others.
        ParameterError: The experiment does not take such a mark or such a truth.
    """
    if footage is None:
        return experiment.simulate()
    name = footage.name or footage.path or "a recording"
    if not experiment.accepts_video:
        raise RefusedError(f"the run is to be made on {name}, but {experiment.id} takes no recording")
    if open_sequence is None:
        raise RefusedError(f"the run was made on {name}, which has to be given along with it")
    sequence = open_sequence(footage)
    experiment.check_footage(sequence.index.kind)
    if footage.sha256 not in {None, sequence.sha256}:
        raise RefusedError(f"the run was made on {name}; {sequence.name} has other content")
    mark = None if footage.mark is None else experiment.video.mark(footage.mark)
    truth = _truth(experiment.video.truth, footage.truth or {})
    try:
        return experiment.video.on_video(sequence, mark, start=footage.start, truth=truth)
    except ParameterError:
        raise
    except ValueError as error:
        raise RefusedError(f"{name} does not show where the run is to begin: {error}") from None


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
