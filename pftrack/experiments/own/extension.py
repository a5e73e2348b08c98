"""An experiment with trackers from files, the experiment of a recipe, examples, and an outline.

A server has the list of its owner's files, but executes their texts only in confined processes. Its display of a plan
(titles, measures and parameters of the experiment) needs no text: the outline of an experiment names trackers without
executing them, and lacks the parameters of their files.
"""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial
from importlib.resources import files
from pathlib import Path
from typing import Any, NoReturn, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import create_model
from typing_extensions import override

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.likelihood import Cloud, Component, Part
from pftrack.core.model.model import FilterModel, Model, State, Values
from pftrack.core.model.parameters import Parameters, Value, Within, flat, parameter
from pftrack.core.model.recipe import Recipe
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Tracker, TrackState
from pftrack.core.numerics.random import Purpose, Stream, numpy_generator
from pftrack.experiments import find
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.own.code import Field, FilterCode, FilterFile, FilterFileError
from pftrack.experiments.shared.filtered import Update, resample_below
from pftrack.filters.alone import LARGEST_EXCESS, Answers
from pftrack.filters.particles import ParticleSet, normalise
from pftrack.filters.resampling import systematic

# The tracker of a file: a particle filter of the file's functions, with the model's for missing ones.

NOT_REPEATABLE = Series("not_repeatable", "not repeatable", role="flag")
"""For a filter in a file: whether repeating a step gave other numbers, in this frame or before."""


def version_parameter(tracker: str) -> str:
    """Return the name of the parameter for a file's version in force, from 1."""
    return f"{tracker}_version"


def series_of(model: FilterModel) -> tuple[Series, ...]:
    """Return what every filter from a file reports."""
    return (*model.series, NOT_REPEATABLE)


def tracker_of(name: str, texts: tuple[str, ...], model: FilterModel) -> Tracker:
    """Return the tracker of a file, given all its versions.

    Args:
        name: Name of the tracker.
        texts: All versions, the first first.
        model: Model with the defaults of missing functions.

    Raises:
        FilterFileError: The newest cannot be executed.
    """
    files = tuple(FilterFile(name, text) for text in texts)
    code = files[-1].load()
    return Tracker(
        name,
        partial(_start, files, model),
        partial(_step, files, model),
        code.file,
        f"{code.title}: it defines {', '.join(code.functions)}.",
        series=series_of(model),
        measure=partial(_measure, model),
        model=FileModel(files, model),
    )


class FileModel(Model):
    """The belief of a file's filter: by its own functions, and by the model for missing ones."""

    weighs = False

    def __init__(self, files: tuple[FilterFile, ...], base: FilterModel) -> None:
        """Join the versions of a file with a model."""
        functions = files[-1].load().functions
        self.files, self.base = files, base
        self.axes, self.most_places = base.axes, base.most_places
        self._weighs_itself = "log_likelihood" in functions
        if "step" not in functions:  # its own step may use any weights
            self.title = "the file's likelihood" if self._weighs_itself else base.title

    @override
    def components(self, parameters: Values) -> tuple[Component, ...]:
        return self.base.components(parameters)

    @override
    def prepare(self, state: State, frame: Frame, parameters: Values) -> State:
        return self.base.prepare(state, frame, parameters)

    @override
    def log_likelihood(self, states: Floats, frame: Frame, parameters: Values, known: State) -> Floats:
        code = _in_force(self.files, parameters)
        if "log_likelihood" not in code.functions:
            return self.base.log_likelihood(states, frame, parameters, known)
        nobody = ParticleSet.uniform(states[:1])
        call = _Call(code, self.base, known, nobody, frame, parameters, (0, frame.index, int(Purpose.TRACK)))
        with code.limited():
            return call.weigh(_locked(states))

    @override
    def centre(self, state: State) -> Floats:
        return self.base.centre(state)

    @property
    @override
    def has_place(self) -> bool:
        return bool(self.title) and self.base.has_place

    @override
    def place(self, states: Floats, known: State) -> Floats:
        return self.base.place(states, known)

    @override
    def put(self, one: Floats, places: Floats, known: State) -> Floats:
        return self.base.put(one, places, known)

    @override
    def parts(self, one: Floats, frame: Frame, parameters: Values, known: State) -> tuple[Part, ...]:
        """Return those of the model, whose likelihood stands in; of one's own nothing is known."""
        return () if self._weighs_itself else self.base.parts(one, frame, parameters, known)

    @override
    def cloud(self, state: State) -> Cloud | None:
        particles = getattr(state, "particles", None)
        if not isinstance(particles, ParticleSet):
            return None
        return Cloud(particles.states, particles.log_weights, particles.ancestors)


@dataclass(frozen=True)
class _Call:
    """One step of a file: its arguments, and the defaults of missing functions."""

    code: FilterCode
    model: FilterModel
    state: Any
    particles: ParticleSet
    frame: Frame
    values: Any
    place: tuple[int, int, int]

    @cached_property
    def parameters(self) -> Any:  # noqa: ANN401 - of the file's own class
        """The parameters as the functions of the file see them."""
        return self.code.parameters(flat(self.values))

    @cached_property
    def answers(self) -> Answers:
        """The checks of what its functions return."""
        return Answers(self.code.refuse, self.model.components(self.values))

    @cached_property
    def seen(self) -> Frame:
        """The frame without its truth, which no filter may look at."""
        return replace(self.model.see(self.frame, self.state), target=None)

    def take(self) -> Update:
        """Take the step."""
        # Seeded by run, frame and purpose, so the path to a frame does not matter.
        rng = numpy_generator(*self.place)
        states, log_weights = _locked(self.particles.states), _locked(self.particles.log_weights)
        if "step" in self.code.functions:
            return self._whole(states, log_weights, rng)
        resampled = self._must_resample(log_weights)
        if resampled:
            parents = self._parents(log_weights, rng)
            states, log_weights = _locked(states[parents]), np.full(len(parents), -math.log(len(parents)))
        else:
            parents = np.arange(len(log_weights))
        moved, correction = self._move(states, rng)
        weighed = self.weigh(_locked(moved))
        normalised, log_sum = self._normalise(log_weights + correction + weighed)
        return Update(ParticleSet(moved, normalised, parents), log_sum, resampled)

    def _whole(self, states: Floats, log_weights: Floats, rng: np.random.Generator) -> Update:
        found = self._call("step", rng, states=states, log_weights=log_weights, count=self._count)
        if not isinstance(found, tuple) or len(found) not in {2, 3}:
            raise self.code.refuse("step", "must return states and log_weights, and may return ancestors as well")
        moved = self.answers.states("step", found[0], None)
        unnormalised = self.answers.logs("step", found[1], len(moved), "log_weights")
        parents = self.answers.places("step", found[2], len(states)) if len(found) == 3 else None
        if parents is None or len(parents) != len(moved):
            if parents is not None:
                raise self.code.refuse("step", f"returned {len(parents)} ancestors of {len(moved)} states")
            parents = np.arange(len(moved)) % len(states)
        normalised, log_sum = normalise(unnormalised)
        resampled = len(found) == 3 and not np.array_equal(parents, np.arange(len(states)))
        return Update(ParticleSet(moved, normalised, parents), log_sum, resampled)

    @property
    def _count(self) -> int:
        return self.model.count(self.values)

    def _must_resample(self, log_weights: Floats) -> bool:
        if "should_resample" in self.code.functions:
            return bool(self._call("should_resample", None, log_weights=log_weights))
        threshold = resample_below(self.values)
        if threshold >= 1.0 or self._count != len(log_weights):
            return True
        return self.particles.effective_sample_size < threshold * self._count

    def _parents(self, log_weights: Floats, rng: np.random.Generator) -> Ints:
        if "resample" not in self.code.functions:
            return systematic(rng, log_weights, self._count)
        found = self._call("resample", rng, log_weights=log_weights, count=self._count)
        return self.answers.places("resample", found, len(log_weights))

    def _move(self, states: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
        nothing = np.zeros(len(states))
        if "propose" in self.code.functions:
            found = self._call("propose", rng, states=states)
            if not isinstance(found, tuple) or len(found) != 2:
                raise self.code.refuse("propose", "must return states and log_correction")
            return self.answers.states("propose", found[0], len(states)), self.answers.logs(
                "propose", found[1], len(states), "log_correction"
            )
        if "propagate" in self.code.functions:
            return self.answers.states("propagate", self._call("propagate", rng, states=states), len(states)), nothing
        return self.model.propagate(states, self.frame, self.values, rng, self.state), nothing

    def weigh(self, states: Floats) -> Floats:
        """Return the log likelihoods (N,) of states (N, d)."""
        if "log_likelihood" in self.code.functions:
            found = self._call("log_likelihood", None, states=states)
            return self.answers.logs("log_likelihood", found, len(states), "", states)
        return self.model.log_likelihood(states, self.frame, self.values, self.state)

    def _normalise(self, log_weights: Floats) -> tuple[Floats, float]:
        if "normalise" not in self.code.functions:
            return normalise(log_weights)
        found = self._call("normalise", None, log_weights=_locked(log_weights))
        if not isinstance(found, tuple) or len(found) != 2 or np.ndim(found[1]) != 0:
            raise self.code.refuse("normalise", "must return log_weights and the logarithm of their sum")
        logs = self.answers.logs("normalise", found[0], len(log_weights), "log_weights")
        total = float(np.exp(logs).sum())
        if abs(total - 1.0) > LARGEST_EXCESS:
            raise self.code.refuse("normalise", f"returned weights that sum to {total:.6g}; expected 1")
        return logs, float(found[1])

    def _call(self, function: str, rng: np.random.Generator | None, **given: Any) -> Any:  # noqa: ANN401
        given["project"] = partial(self.model.project, known=self.state) if self.model.project else None
        return self.code.call(function, frame=self.seen, parameters=self.parameters, rng=rng, **given)


def _start(
    files: tuple[FilterFile, ...],
    model: FilterModel,
    target: Target,
    frame: Frame,
    parameters: Parameters,
    rng: Stream,
) -> TrackState:
    code = _in_force(files, parameters)
    state: TrackState = model.start(target, frame, parameters, rng)
    if "start" not in code.functions:
        return state
    particles = model.particles(state, parameters, rng)
    place = rng.seed, rng.frame, int(Purpose.START)
    call = _Call(code, model, state, particles, frame, parameters, place)
    with code.limited():
        found = code.call(
            "start",
            position=_locked(target.position),
            frame=call.seen,
            parameters=call.parameters,
            rng=numpy_generator(*place),
        )
    states = call.answers.states("start", found, None)
    begun: TrackState = model.believe(state, Update(ParticleSet.uniform(states), 0.0, False), frame, parameters)
    return begun


def _step(
    files: tuple[FilterFile, ...],
    model: FilterModel,
    state: TrackState,
    frame: Frame,
    parameters: Parameters,
    rng: Stream,
) -> TrackState:
    code = _in_force(files, parameters)
    state = model.prepare(state, frame, parameters)
    particles = model.particles(state, parameters, rng)
    call = _Call(code, model, state, particles, frame, parameters, (rng.seed, rng.frame, int(Purpose.TRACK)))
    with code.limited():
        update = call.take()
        repeatable = bool(getattr(state, "repeatable", True))
        # Increasingly rare, so the cost in a long run is negligible.
        if repeatable and rng.frame & (rng.frame - 1) == 0:
            repeatable = _same(update, call.take())
    believed: TrackState = model.believe(state, replace(update, repeatable=repeatable), frame, parameters)
    return believed


def _measure(model: FilterModel, state: TrackState) -> Mapping[str, SeriesValue]:
    return {**model.measure(state), NOT_REPEATABLE.name: float(not getattr(state, "repeatable", True))}


def _in_force(files: tuple[FilterFile, ...], parameters: Parameters) -> FilterCode:
    version = int(getattr(parameters, version_parameter(files[0].name)))
    return files[version - 1].load()


def _same(one: Update, other: Update) -> bool:
    pairs = (
        (one.particles.states, other.particles.states),
        (one.particles.log_weights, other.particles.log_weights),
        (one.particles.ancestors, other.particles.ancestors),
    )
    return all(np.array_equal(first, second) for first, second in pairs)


def _locked(array: NDArray[Any]) -> NDArray[Any]:
    """Return a view that cannot be written to: the past is the past."""
    view = array.view()
    view.flags.writeable = False
    return view


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
        RefusedError: The experiment is unknown or cannot be used.
        FilterFileError: A filter cannot be used here, or is not trusted.
    """
    return extend(recipe.experiment, recipe.filters)


def extend(experiment_id: str, filters: Mapping[str, Sequence[str]]) -> Experiment:
    """Return an experiment with the trackers that files make.

    Args:
        experiment_id: Name of the one that takes them.
        filters: All versions of each file by the name of its tracker, the first first.

    Raises:
        RefusedError: The experiment is unknown or cannot be used.
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
        simulate=lambda: _widen(experiment.simulate(), filters),
        video=replace(
            video,
            wire=lambda *given: _widen(video.wire(*given), filters),
            recorded=None if recorded is None else lambda kind: _with_fields(recorded(kind), filters),
        ),
    )


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
        name: Name of its tracker.
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

    A run starts with the default of the first version that has the parameter.
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
    """Refuse a parameter that shares the name of one of the experiment but has another type."""
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


def package_of(name: str) -> dict[str, str]:
    """Return the files of a package with a first version of an experiment, by their paths.

    Args:
        name: Name of the experiment.

    Raises:
        ValueError: It cannot be a name.
    """
    if not re.fullmatch(r"[a-z][a-z0-9-]{0,39}", name):
        raise ValueError(
            f"an experiment is named by at most 40 lower-case letters, digits and hyphens, a letter first; got {name!r}"
        )
    package = "pftrack_" + name.replace("-", "_")
    project, text = (
        (files(__package__) / each).read_text(encoding="utf-8")
        for each in ("first_project.toml", "first_experiment.py")
    )
    return {
        "pyproject.toml": project.format(package=package, name=name),
        f"{package}/__init__.py": text.replace("NAME", name),
    }


def outline(experiment_id: str, names: Iterable[str]) -> Experiment:
    """Return an experiment with trackers of these names that cannot take a step.

    Raises:
        RefusedError: The experiment is unknown or cannot be used.
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
        return Tracker(name, refuse, refuse, title, f"{title}.", series=series_of(model))

    return experiment.with_trackers(*map(named, names), like=model.reads)
