"""The tracker that a file makes: a particle filter of the file's functions, and the model's where it has none."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from typing_extensions import override

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.likelihood import Cloud, Component, Part
from pftrack.core.model.model import Model, State, Values
from pftrack.core.model.parameters import Parameters, flat
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Tracker, TrackState
from pftrack.core.numerics.random import Purpose, Stream, numpy_generator
from pftrack.experiments.own.code import FilterCode, FilterFile
from pftrack.experiments.shared.filtered import Update, resample_below
from pftrack.filters.answers import LARGEST_EXCESS, Answers
from pftrack.filters.particles import ParticleSet, normalise
from pftrack.filters.resampling import systematic

NOT_REPEATABLE = Series("not_repeatable", "not repeatable", role="flag")
"""Of a filter in a file: whether a step came to other numbers when it was computed again, in this frame or before."""


def version_parameter(tracker: str) -> str:
    """Return the name of the parameter that says which version of a file is in force, from 1."""
    return f"{tracker}_version"


def series_of(model: Model) -> tuple[Series, ...]:
    """Return what every filter from a file reports."""
    return (*model.series, NOT_REPEATABLE)


def tracker_of(name: str, texts: tuple[str, ...], model: Model) -> Tracker:
    """Return the tracker of a file, given all its versions.

    Args:
        name: Of the tracker.
        texts: All versions, the first first.
        model: That stands in for what the file leaves out.

    Raises:
        FilterFileError: The newest cannot be executed.
    """
    files = tuple(FilterFile(name, text) for text in texts)
    code = files[-1].load()
    return Tracker(
        name,
        code.file,
        f"{code.title}: it defines {', '.join(code.functions)}.",
        partial(_start, files, model),
        partial(_step, files, model),
        series=series_of(model),
        measure=partial(_measure, model),
        model=FileModel(files, model),
    )


class FileModel(Model):
    """What a file's filter believes: by its own functions, and by the model that stands in for what it leaves out."""

    weighs = False

    def __init__(self, files: tuple[FilterFile, ...], base: Model) -> None:
        """Join the versions of a file with a model."""
        functions = files[-1].load().functions
        self.files, self.base = files, base
        self.axes, self.most_places = base.axes, base.most_places
        self._weighs_itself = "log_likelihood" in functions
        if "step" not in functions:  # a step of its own may weigh by anything
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
    """One step of a file: what it is given, and what stands in for what it lacks."""

    code: FilterCode
    model: Model
    state: Any
    particles: ParticleSet
    frame: Frame
    values: Any
    place: tuple[int, int, int]

    @cached_property
    def parameters(self) -> Any:  # noqa: ANN401 - of the file's own class
        """What the functions of the file see of the parameters."""
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
        # Of a run, a frame and a purpose, so that the way to a frame changes nothing.
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
        given["project"] = partial(self.model.project, known=self.state) if self.model.projects else None
        return self.code.call(function, frame=self.seen, parameters=self.parameters, rng=rng, **given)


def _start(
    files: tuple[FilterFile, ...],
    model: Model,
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
    model: Model,
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
        # Ever more seldom, so that it costs nothing in a long run.
        if repeatable and rng.frame & (rng.frame - 1) == 0:
            repeatable = _same(update, call.take())
    believed: TrackState = model.believe(state, replace(update, repeatable=repeatable), frame, parameters)
    return believed


def _measure(model: Model, state: TrackState) -> Mapping[str, SeriesValue]:
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
