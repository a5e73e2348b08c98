"""What computes a run, or a comparison of runs, again: a few lines of Python, and a command.

    run = pftrack.run("ball", preset="works", frames=77, occlusion_width_px=55)
    pftrack run ball --preset works --frames 77 --set occlusion_width_px=55

A run whose parameters change on the way, or that has a mark, has its recipe in the lines, as a person would write it.
"""

import json
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pprint import pformat
from typing import Any

from pftrack.core.model.parameters import flat
from pftrack.core.model.recipe import Recipe
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.own import version_parameter

__all__ = ["SourceCode", "comparison_code", "run_code"]

WIDTH = 100


@dataclass(frozen=True, slots=True)
class SourceCode:
    """The same computation in two forms.

    Attributes:
        python: Lines of Python.
        command: Lines for a shell.
    """

    python: str
    command: str


@dataclass(frozen=True, slots=True)
class _Told:
    """A recipe in the words of a call.

    Attributes:
        options: Tracker, preset, seed and frames, as far as they are not the usual ones.
        values: Parameters of frame 0.
        recipe: All of it, where no call can say it.
        recording: Name of the recording, if it is on one.
    """

    options: dict[str, Any]
    values: dict[str, Any]
    recipe: dict[str, Any] | None
    recording: str | None


def run_code(recipe: Recipe, experiment: Experiment, frames: int | None = None) -> SourceCode:
    """Return what computes a run.

    Args:
        recipe: What makes it.
        experiment: The one that it names, with the filters that the recipe brings.
        frames: How many frames it has been computed for; all if None.

    Raises:
        ParameterError: The recipe names a tracker or a parameter that the experiment does not have.
    """
    told = _tell(recipe, experiment, frames)
    return SourceCode(
        f"import pftrack\n\nrun = {_python(recipe, told)}\nprint(run.estimates_sha256)\n",
        _command(recipe, told, "run.json"),
    )


def comparison_code(runs: Sequence[tuple[Recipe, Experiment]], frames: int | None = None) -> SourceCode:
    """Return what compares runs, each with its experiment; see `run_code`."""
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
    """Return the command; a recipe that no options can say goes into a file first."""
    if told.recipe is not None:
        # A text in quotes, in which a line that says EOF is no end: JSON has no such line.
        text = json.dumps(told.recipe, indent=2, ensure_ascii=False)
        video = [] if told.recording is None else ["--video", shlex.quote(told.recording)]
        return f"cat > {file} <<'EOF'\n{text}\nEOF\n{' '.join(['pftrack run', file, *video, *more])}\n"
    words = ["pftrack", "run", recipe.experiment]
    for name, value in told.options.items():
        words += [f"--{name}", str(value)]
    for name, value in told.values.items():
        words += ["--set", f"{name}={value}"]
    return " ".join([*map(shlex.quote, words), *more]) + "\n"
