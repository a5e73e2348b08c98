"""The tracker that a file makes: a particle filter of the file's parts, and the experiment's where it has none."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model.likelihood import Cloud, ObservationLikelihood, Part
from pftrack.core.model.parameters import Parameters, flat
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Tracker, TrackState
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.own.code import FilterCode, FilterFile
from pftrack.experiments.shared.beliefs import FilterInterface, Update
from pftrack.filters.particles import ParticleSet, normalise
from pftrack.filters.resampling import systematic

NOT_REPEATABLE = Series("not_repeatable", "not repeatable", role="flag")
"""Of a filter in a file: whether a step came to other numbers when it was computed again, in this frame or before."""

MOST_PARTICLES = 1_000_000
LARGEST_EXCESS = 1e-6
"""By which a sum of weights may differ from one."""


def version_parameter(tracker: str) -> str:
    """Return the name of the parameter that says which version of a file is in force, from 1."""
    return f"{tracker}_version"


def series_of(interface: FilterInterface) -> tuple[Series, ...]:
    """Return what every filter from a file reports."""
    return (*interface.series, NOT_REPEATABLE)


def tracker_of(name: str, texts: tuple[str, ...], interface: FilterInterface) -> Tracker:
    """Return the tracker of a file, given all its versions.

    Raises:
        FilterFileError: The newest cannot be executed.
    """
    files = tuple(FilterFile(name, text) for text in texts)
    code = files[-1].load()
    return Tracker(
        name,
        code.file,
        f"{code.title}: it defines {', '.join(code.functions)}.",
        partial(_start, files, interface),
        partial(_step, files, interface),
        series=series_of(interface),
        measure=partial(_measure, interface),
        reads=(interface.reads,),
        # A step of its own may weigh by anything.
        likelihood=None if "step" in code.functions else _likelihood(files, interface),
        cloud=_cloud,
    )


@dataclass(frozen=True)
class _Call:
    """One step of a file: what it is given, and what stands in for what it lacks."""

    code: FilterCode
    interface: FilterInterface
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
    def seen(self) -> Frame:
        """The frame without its truth, which no filter may look at."""
        seen = self.frame if self.interface.see is None else self.interface.see(self.state, self.frame)
        return replace(seen, target=None)

    def take(self) -> Update:
        """Take the step."""
        # Of a run, a frame and a purpose, so that the way to a frame changes nothing.
        rng = _generator(*self.place)
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
        moved = self._states("step", found[0], None)
        unnormalised = self._logs("step", found[1], len(moved), "log_weights")
        parents = self._places("step", found[2], len(states)) if len(found) == 3 else None
        if parents is None or len(parents) != len(moved):
            if parents is not None:
                raise self.code.refuse("step", f"returned {len(parents)} ancestors of {len(moved)} states")
            parents = np.arange(len(moved)) % len(states)
        normalised, log_sum = normalise(unnormalised)
        resampled = len(found) == 3 and not np.array_equal(parents, np.arange(len(states)))
        return Update(ParticleSet(moved, normalised, parents), log_sum, resampled)

    @property
    def _count(self) -> int:
        return self.interface.count(self.values)

    def _must_resample(self, log_weights: Floats) -> bool:
        if "should_resample" in self.code.functions:
            return bool(self._call("should_resample", None, log_weights=log_weights))
        threshold = self.interface.resample_below(self.values)
        if threshold >= 1.0 or self._count != len(log_weights):
            return True
        return self.particles.effective_sample_size < threshold * self._count

    def _parents(self, log_weights: Floats, rng: np.random.Generator) -> Ints:
        if "resample" not in self.code.functions:
            return systematic(rng, log_weights, self._count)
        found = self._call("resample", rng, log_weights=log_weights, count=self._count)
        return self._places("resample", found, len(log_weights))

    def _move(self, states: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
        nothing = np.zeros(len(states))
        if "propose" in self.code.functions:
            found = self._call("propose", rng, states=states)
            if not isinstance(found, tuple) or len(found) != 2:
                raise self.code.refuse("propose", "must return states and log_correction")
            return self._states("propose", found[0], len(states)), self._logs(
                "propose", found[1], len(states), "log_correction"
            )
        if "propagate" in self.code.functions:
            return self._states("propagate", self._call("propagate", rng, states=states), len(states)), nothing
        return self.interface.propagate(self.state, states, self.frame, self.values, rng), nothing

    def weigh(self, states: Floats) -> Floats:
        """Return the log likelihoods (N,) of states (N, d)."""
        if "log_likelihood" in self.code.functions:
            found = self._call("log_likelihood", None, states=states)
            return self._logs("log_likelihood", found, len(states), "", states)
        return self.interface.likelihood.log_likelihood(self.state, states, self.frame, self.values)

    def _normalise(self, log_weights: Floats) -> tuple[Floats, float]:
        if "normalise" not in self.code.functions:
            return normalise(log_weights)
        found = self._call("normalise", None, log_weights=_locked(log_weights))
        if not isinstance(found, tuple) or len(found) != 2 or np.ndim(found[1]) != 0:
            raise self.code.refuse("normalise", "must return log_weights and the logarithm of their sum")
        logs = self._logs("normalise", found[0], len(log_weights), "log_weights")
        total = float(np.exp(logs).sum())
        if abs(total - 1.0) > LARGEST_EXCESS:
            raise self.code.refuse("normalise", f"returned weights that sum to {total:.6g}; expected 1")
        return logs, float(found[1])

    def _call(self, function: str, rng: np.random.Generator | None, **given: Any) -> Any:  # noqa: ANN401
        project = self.interface.project
        given["project"] = None if project is None else partial(project, self.state)
        return self.code.call(function, frame=self.seen, parameters=self.parameters, rng=rng, **given)

    # ------------------------------------------------------------ what came back

    def _states(self, function: str, found: object, count: int | None) -> Floats:
        components = self.interface.likelihood.components(self.values)
        names = ", ".join(each.name for each in components)
        states = self._array(function, found)
        if states.ndim != 2 or states.shape[1] != len(components) or count not in {None, len(states)}:
            wanted = f"({'N' if count is None else count}, {len(components)})"
            raise self.code.refuse(
                function, f"returned states of shape {states.shape}; expected {wanted}, the columns being {names}"
            )
        if not 1 <= len(states) <= MOST_PARTICLES:
            raise self.code.refuse(function, f"returned {len(states):,} particles; expected 1 to {MOST_PARTICLES:,}")
        bad = ~np.isfinite(states).all(axis=1)
        if bad.any():
            first = int(np.argmax(bad))
            raise self.code.refuse(
                function,
                f"returned states that are not finite for {bad.sum()} of {len(states)} particles; particle {first} is "
                f"{self._told(states[first])}",
            )
        return np.ascontiguousarray(states)

    def _logs(self, function: str, found: object, count: int, what: str, states: Floats | None = None) -> Floats:
        logs = self._array(function, found)
        named = f" {what}" if what else ""
        if logs.shape != (count,):
            raise self.code.refuse(function, f"returned{named} of shape {logs.shape}; expected ({count},)")
        bad = np.isnan(logs) | (logs == np.inf)
        if bad.any():
            first = int(np.argmax(bad))
            of = f", which is {self._told(states[first])}" if states is not None else ""
            raise self.code.refuse(
                function,
                f"returned{named} {'NaN' if np.isnan(logs[first]) else 'infinity'} for {bad.sum()} of {count} "
                f"particles, first for particle {first}{of}",
            )
        return logs

    def _places(self, function: str, found: object, count: int) -> Ints:
        places = np.asarray(found)
        if places.ndim != 1 or places.dtype.kind not in "iu":
            raise self.code.refuse(
                function,
                f"must return the places of the parents as whole numbers, one after the other; got an array of "
                f"{places.dtype} of shape {places.shape}",
            )
        if not 1 <= len(places) <= MOST_PARTICLES:
            raise self.code.refuse(function, f"returned {len(places):,} parents; expected 1 to {MOST_PARTICLES:,}")
        if places.min() < 0 or places.max() >= count:
            worst = int(places.min() if places.min() < 0 else places.max())
            raise self.code.refuse(function, f"returned the parent {worst}; there are 0 to {count - 1}")
        return places.astype(np.int64)

    def _array(self, function: str, found: object) -> Floats:
        try:
            return np.array(found, dtype=np.float64)
        except (TypeError, ValueError):
            raise self.code.refuse(function, f"returned {type(found).__name__}, which is no array of numbers") from None

    def _told(self, state: Floats) -> str:
        components = self.interface.likelihood.components(self.values)
        return ", ".join(
            f"{each.name} = {value:.4g}{' ' + each.unit if each.unit else ''}"
            for each, value in zip(components, state, strict=False)
        )


def _start(
    files: tuple[FilterFile, ...],
    interface: FilterInterface,
    target: Target,
    frame: Frame,
    parameters: Parameters,
    rng: Stream,
) -> TrackState:
    code = _in_force(files, parameters)
    state: TrackState = interface.start(target, frame, parameters, rng)
    if "start" not in code.functions:
        return state
    particles = interface.particles(state, parameters, rng)
    place = rng.seed, rng.frame, int(Purpose.START)
    call = _Call(code, interface, state, particles, frame, parameters, place)
    with code.limited():
        found = code.call(
            "start",
            position=_locked(target.position),
            frame=call.seen,
            parameters=call.parameters,
            rng=_generator(*place),
        )
    states = call._states("start", found, None)  # noqa: SLF001 - of this module
    begun: TrackState = interface.believe(state, Update(ParticleSet.uniform(states), 0.0, False), frame, parameters)
    return begun


def _step(
    files: tuple[FilterFile, ...],
    interface: FilterInterface,
    state: TrackState,
    frame: Frame,
    parameters: Parameters,
    rng: Stream,
) -> TrackState:
    code = _in_force(files, parameters)
    state = interface.likelihood.prepare(state, frame, parameters)
    particles = interface.particles(state, parameters, rng)
    call = _Call(code, interface, state, particles, frame, parameters, (rng.seed, rng.frame, int(Purpose.TRACK)))
    with code.limited():
        update = call.take()
        repeatable = bool(getattr(state, "repeatable", True))
        # Ever more seldom, so that it costs nothing in a long run.
        if repeatable and rng.frame & (rng.frame - 1) == 0:
            repeatable = _same(update, call.take())
    believed: TrackState = interface.believe(state, replace(update, repeatable=repeatable), frame, parameters)
    return believed


def _likelihood(files: tuple[FilterFile, ...], interface: FilterInterface) -> ObservationLikelihood:
    """Return what a file's filter weighs by: its own function, or that which stands in for it."""

    def weigh(state: Any, states: Floats, frame: Frame, parameters: Parameters) -> Floats:  # noqa: ANN401 - the state of any family
        code = _in_force(files, parameters)
        if "log_likelihood" not in code.functions:
            return interface.likelihood.log_likelihood(state, states, frame, parameters)
        nobody = ParticleSet.uniform(states[:1])
        call = _Call(code, interface, state, nobody, frame, parameters, (0, frame.index, int(Purpose.TRACK)))
        with code.limited():
            return call.weigh(_locked(states))

    stood_in = replace(interface.likelihood, log_likelihood=weigh, weighs=False)
    if "log_likelihood" not in files[-1].load().functions:
        return stood_in
    # The parts would be those of what stands in.
    return replace(stood_in, title="the file's likelihood", parts=_no_parts)


def _no_parts(*_: object) -> tuple[Part, ...]:
    return ()


def _cloud(state: Any) -> Cloud | None:  # noqa: ANN401 - the state of any family
    particles = getattr(state, "particles", None)
    if not isinstance(particles, ParticleSet):
        return None
    return Cloud(particles.states, particles.log_weights, particles.ancestors)


def _measure(interface: FilterInterface, state: TrackState) -> Mapping[str, SeriesValue]:
    return {**interface.measure(state), NOT_REPEATABLE.name: float(not getattr(state, "repeatable", True))}


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


def _generator(seed: int, frame: int, purpose: int) -> np.random.Generator:
    """Return NumPy's generator of a frame: the same on every way to it, since the counter holds the frame."""
    return np.random.Generator(np.random.Philox(key=[seed, purpose], counter=[0, 0, 0, frame]))


def _locked(array: NDArray[Any]) -> NDArray[Any]:
    """Return a view that cannot be written to: the past is the past."""
    view = array.view()
    view.flags.writeable = False
    return view
