"""An experiment with the trackers that files make, the experiment of a recipe, examples, and an outline.

A server knows which files its owner has named, but their texts are executed in confined processes alone. What it shows
of a plan, titles, measures and parameters of the experiment, needs no text: the outline of an experiment has trackers
that are named and not executed, and does not know the parameters of their files.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from importlib.resources import files
from pathlib import Path
from typing import Any, NoReturn, TypeAlias

from pydantic import create_model

from pftrack.core.model.parameters import Parameters, Value, Within, flat, parameter
from pftrack.core.model.recipe import Recipe
from pftrack.core.model.setup import Setup
from pftrack.core.model.tracker import Tracker
from pftrack.experiments import find
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.own.code import FilterFile
from pftrack.experiments.own.sliders import Field, FilterFileError
from pftrack.experiments.own.tracker import series_of, tracker_of, version_parameter
from pftrack.experiments.video import Wire

Filters: TypeAlias = tuple[tuple[str, tuple[str, ...]], ...]
"""All versions of each file, the first first, by the name of its tracker."""


def name_of(path: Path) -> str:
    """Return the name of the tracker that a file makes.

    Raises:
        ValueError: It cannot be a name.
    """
    if path.suffix != ".py" or not path.stem.isidentifier() or not path.stem.isascii() or len(path.stem) > 40:
        raise ValueError(
            f"a filter's file has a name such as my_filter.py, of letters, digits and underscores; got {path.name}"
        )
    return path.stem


def experiment_of(recipe: Recipe) -> Experiment:
    """Return the experiment of a recipe, with the filters that the recipe brings.

    Raises:
        LookupError: There is none of that name that can be used.
        FilterFileError: A filter cannot be used here, or nobody has said that it is trusted.
    """
    return extend(recipe.experiment, recipe.filters)


def extend(experiment_id: str, filters: Mapping[str, Sequence[str]]) -> Experiment:
    """Return an experiment with the trackers that files make.

    Args:
        experiment_id: Name of the one that takes them.
        filters: All versions of each file by the name of its tracker, the first first.

    Raises:
        LookupError: There is none of that name that can be used.
        FilterFileError: The experiment takes none, or a file cannot be used with it.
    """
    if not filters:
        return find(experiment_id)
    return _extend(experiment_id, tuple((name, tuple(texts)) for name, texts in filters.items()))


@lru_cache(maxsize=64)
def _extend(experiment_id: str, filters: Filters) -> Experiment:
    experiment = find(experiment_id)
    model = experiment.model
    for name, _ in filters:
        if model is None:
            raise FilterFileError(f"{name}.py", None, f"{experiment.id} takes no filters from files")
        if name in experiment.trackers:
            raise FilterFileError(f"{name}.py", None, f"{experiment.id} has a tracker {name}; call the file otherwise")
    if model is None:
        return experiment
    joined = (tracker_of(name, texts, model) for name, texts in filters)
    video, recorded = experiment.video, experiment.video.recorded
    return replace(
        experiment.with_trackers(*joined, like=model.reads),
        filters=dict(filters),
        simulate=partial(_simulate, experiment.simulate, filters),
        video=replace(
            video,
            wire=partial(_wire, video.wire, filters),
            recorded=None if recorded is None else partial(_recorded, recorded, filters),
        ),
    )


def _simulate(simulate: Any, filters: Filters) -> Setup:  # noqa: ANN401 - as of `Experiment`
    return _widen(simulate(), filters)


def _wire(wire: Wire, filters: Filters, *arguments: Any) -> Setup:  # noqa: ANN401
    return _widen(wire(*arguments), filters)


def _recorded(recorded: Any, filters: Filters, kind: Any) -> Parameters:  # noqa: ANN401
    return _with_fields(recorded(kind), filters)


def widen(setup: Setup, filters: Mapping[str, Sequence[str]]) -> Setup:
    """Return a setup of the experiment without filters as one of that with these; see `extend`."""
    return _widen(setup, tuple((name, tuple(texts)) for name, texts in filters.items())) if filters else setup


def parameters_of(name: str, texts: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the parameters of the newest version of a file."""
    return tuple(each.name for each in FilterFile(name, texts[-1]).load().fields)


def new_defaults(name: str, texts: Sequence[str], values: Mapping[str, Value]) -> dict[str, Value]:
    """Return what the newest version of a file would have changed of a run's values.

    Its own number, and the defaults that are other ones than in the version before, where that one's are in force.

    Args:
        name: Of its tracker.
        texts: All versions.
        values: In force.
    """
    changed: dict[str, Value] = {version_parameter(name): len(texts)}
    if len(texts) > 1:
        before = {each.name: each.default for each in FilterFile(name, texts[-2]).load().fields}
        for each in FilterFile(name, texts[-1]).load().fields:
            was = before.get(each.name)
            if was is not None and each.default != was and values.get(each.name) == was:
                changed[each.name] = each.default
    return changed


def _widen(setup: Setup, filters: Filters) -> Setup:
    return replace(setup, parameters=_with_fields(setup.parameters, filters))


def _with_fields(parameters: Parameters, filters: Filters) -> Parameters:
    model = _model(type(parameters), filters)
    return model(**flat(parameters))


@lru_cache(maxsize=64)
def _model(base: type[Parameters], filters: Filters) -> type[Parameters]:
    """Return a model with the parameters of files, of all their versions."""
    made: dict[str, Any] = {}
    for name, texts in filters:
        codes = [FilterFile(name, text).load() for text in texts]
        group = codes[-1].file
        made[version_parameter(name)] = (
            int,
            parameter(
                1,
                "Version",
                f"Which of the versions of {group} that were saved is in force.",
                within=(1, len(texts), 1),
                group=group,
                trackers=(name,),
            ),
        )
        for each in _joined([code.fields for code in codes], group):
            _check_kind(base, each, group)
            if each.name in base.model_fields:
                continue  # it is the experiment's own
            if each.name in made:
                raise FilterFileError(group, None, f"another file has a parameter {each.name} already")
            made[each.name] = each.declare(name, group)
    return create_model(base.__name__, __base__=base, __module__=base.__module__, **made)


def _joined(versions: Sequence[tuple[Field, ...]], file: str) -> list[Field]:
    """Return the parameters of all versions: as the newest declares them, with room for the values of the others.

    What a run starts with is the default of the first version that has the parameter.
    """
    joined: dict[str, Field] = {}
    for each in (field for version in versions for field in version):
        before = joined.get(each.name)
        if before is None:
            joined[each.name] = each
            continue
        kinds = {before.kind, each.kind}
        if before.kind != each.kind and kinds != {int, float}:
            raise FilterFileError(
                file, None, f"{each.name} was another kind of parameter when the run began; give it another name"
            )
        joined[each.name] = replace(
            each,
            kind=float if kinds == {int, float} else each.kind,
            default=before.default,
            within=_joined_range(before.within, each.within),
        )
    return list(joined.values())


def _joined_range(one: Within | None, other: Within | None) -> Within | None:
    return (min(one[0], other[0]), max(one[1], other[1]), other[2]) if one and other else other


def _check_kind(base: type[Parameters], each: Field, file: str) -> None:
    """Refuse a parameter that has the name of one of the experiment and is of another kind."""
    there = base.model_fields.get(each.name)
    if there is not None and there.annotation is not each.kind and {there.annotation, each.kind} != {int, float}:
        raise FilterFileError(file, None, f"{each.name} is a parameter of the experiment of another kind")


def example_of(experiment: Experiment) -> str:
    """Return the text of a filter for an experiment.

    Raises:
        ValueError: It takes none.
    """
    if experiment.model is None:
        raise ValueError(f"{experiment.id} takes no filters from files")
    package, _, module = experiment.model.example.rpartition(".")
    return (files(package) / f"{module}.py").read_text(encoding="utf-8")


PROJECT = """[build-system]
requires = ["hatchling"]
build-backend = "hatchling.build"

[project]
name = "{package}"
version = "0.1.0"
dependencies = ["pftrack"]

[project.entry-points."pftrack.experiments"]
{name} = "{package}:EXPERIMENT"
"""
"""Of a package with an experiment: the entry point is how pftrack finds it."""


def package_of(name: str) -> dict[str, str]:
    """Return the files of a package with a first version of an experiment, by their paths.

    Args:
        name: Of the experiment.

    Raises:
        ValueError: It cannot be a name.
    """
    if not re.fullmatch(r"[a-z][a-z0-9-]{0,39}", name):
        raise ValueError(
            f"an experiment is named by at most 40 small letters, digits and hyphens, a letter first; got {name!r}"
        )
    package = "pftrack_" + name.replace("-", "_")
    text = (files(__package__) / "first_experiment.py").read_text(encoding="utf-8")
    return {
        "pyproject.toml": PROJECT.format(package=package, name=name),
        f"{package}/__init__.py": text.replace("NAME", name),
    }


def outline(experiment_id: str, names: Iterable[str]) -> Experiment:
    """Return an experiment with trackers of these names, none of which can take a step.

    Raises:
        LookupError: There is none of that name that can be used.
        FilterFileError: The experiment takes no filters from files.
    """
    return _outline(experiment_id, tuple(names))


@lru_cache(maxsize=64)
def _outline(experiment_id: str, names: tuple[str, ...]) -> Experiment:
    experiment = find(experiment_id)
    if not names:
        return experiment
    model = experiment.model
    if model is None:
        raise FilterFileError(f"{names[0]}.py", None, f"{experiment.id} takes no filters from files")

    def named(name: str) -> Tracker:
        def refuse(*_: Any) -> NoReturn:  # noqa: ANN401 - as of `Tracker`
            raise FilterFileError(f"{name}.py", None, "it is named here and not executed")

        title = f"{name}.py"
        return Tracker(name, title, f"{title}.", refuse, refuse, series=series_of(model))

    return experiment.with_trackers(*map(named, names), like=model.reads)
