"""A filter by itself: your model on your data, without an experiment.

    class Walk:
        def begin(self, rng, n):
            return rng.normal(0.0, 1.0, (n, 1))

        def propagate(self, states, rng):
            return states + rng.normal(0.0, 0.1, states.shape)

        def log_likelihood(self, states, frame):
            return -0.5 * ((frame - states[:, 0]) / 0.2) ** 2

    found = pftrack.filter(Walk(), measurements, n=1000)

It is the bootstrap filter (`pftrack.filters.bootstrap`; Gordon, Salmond and Smith 1993). A built-in model
(`pftrack.core.model.model.FilterModel`) also runs, on a list of its frames, if its functions do not need a tracker's
state.
"""

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from pftrack.core.arrays import Floats, Ints, check_count
from pftrack.core.model.likelihood import Component
from pftrack.core.numerics.random import Purpose, numpy_generator
from pftrack.filters import bootstrap
from pftrack.filters.dynamics import Sampled
from pftrack.filters.particles import ParticleSet, normalise
from pftrack.filters.resampling import Resampler, systematic

# Checks of what user functions return: arrays of the right shape, without NaN, with values of the right meaning.
#
# pftrack calls the functions of a user's own filter file, and of a model that `pftrack.filter` runs, between the steps
# of a filter. It refuses a wrong result in one sentence that names the function, the expected value and the returned
# value.

MOST_PARTICLES = 1_000_000
LARGEST_EXCESS = 1e-6
"""Largest accepted difference of a sum of weights from one."""


def named_arguments(
    name: str, function: Callable[..., object], allowed: Sequence[str], refuse: Callable[[str, str], Exception]
) -> tuple[str, ...]:
    """Return those of the allowed arguments that a function names.

    Args:
        name: Name of the function.
        function: The user's function.
        allowed: Names of all allowed arguments.
        refuse: See `Answers`; it is raised for an argument of another name.
    """
    try:
        wanted = inspect.signature(getattr(function, "py_func", function)).parameters.values()
    except (TypeError, ValueError):
        return tuple(allowed)
    needed = [one for one in wanted if one.kind not in {one.VAR_POSITIONAL, one.VAR_KEYWORD}]
    for one in needed:
        if one.name not in allowed and one.default is one.empty:
            raise refuse(name, f"asks for {one.name}, but it can have {', '.join(allowed)}")
    return tuple(one.name for one in needed if one.name in allowed)


@dataclass(frozen=True)
class Answers:
    """The checks of one model's functions.

    Attributes:
        refuse: (name of the function, what is wrong) -> the error to raise.
        components: Names of the states' components, in order; if empty, their number is free.
    """

    refuse: Callable[[str, str], Exception]
    components: Sequence[Component] = ()

    def states(self, function: str, found: object, count: int | None) -> Floats:
        """Return states (N, d), contiguous.

        Args:
            function: The function that returned them.
            found: The returned value.
            count: N; any number of particles if None.
        """
        names = ", ".join(each.name for each in self.components)
        states = self.array(function, found)
        width = len(self.components) or (states.shape[1] if states.ndim == 2 else 0)
        if states.ndim != 2 or states.shape[1] != width or width == 0 or count not in {None, len(states)}:
            wanted = f"({'N' if count is None else count}, {width or 'd'})"
            named = f", the columns being {names}" if names else ""
            raise self.refuse(function, f"returned states of shape {states.shape}; expected {wanted}{named}")
        if not 1 <= len(states) <= MOST_PARTICLES:
            raise self.refuse(function, f"returned {len(states):,} particles; expected 1 to {MOST_PARTICLES:,}")
        bad = ~np.isfinite(states).all(axis=1)
        if bad.any():
            first = int(np.argmax(bad))
            raise self.refuse(
                function,
                f"returned states that are not finite for {bad.sum()} of {len(states)} particles; particle {first} is "
                f"{self.describe(states[first])}",
            )
        return np.ascontiguousarray(states)

    def logs(self, function: str, found: object, count: int, what: str = "", states: Floats | None = None) -> Floats:
        """Return logarithms (count,) that may be -inf.

        Args:
            function: The function that returned them.
            found: The returned value.
            count: N.
            what: They are, as the sentence names them.
            states: (N, d) their states, for the sentence.
        """
        logs = self.array(function, found)
        named = f" {what}" if what else ""
        if logs.shape != (count,):
            raise self.refuse(function, f"returned{named} of shape {logs.shape}; expected ({count},)")
        bad = np.isnan(logs) | (logs == np.inf)
        if bad.any():
            first = int(np.argmax(bad))
            of = f", which is {self.describe(states[first])}" if states is not None else ""
            raise self.refuse(
                function,
                f"returned{named} {'NaN' if np.isnan(logs[first]) else 'infinity'} for {bad.sum()} of {count} "
                f"particles, first for particle {first}{of}",
            )
        return logs

    def places(self, function: str, found: object, count: int) -> Ints:
        """Return the places of parents among `count` particles."""
        places = np.asarray(found)
        if places.ndim != 1 or places.dtype.kind not in "iu":
            raise self.refuse(
                function,
                f"must return the places of the parents as whole numbers, one after the other; got an array of "
                f"{places.dtype} of shape {places.shape}",
            )
        if not 1 <= len(places) <= MOST_PARTICLES:
            raise self.refuse(function, f"returned {len(places):,} parents; expected 1 to {MOST_PARTICLES:,}")
        if places.min() < 0 or places.max() >= count:
            worst = int(places.min() if places.min() < 0 else places.max())
            raise self.refuse(function, f"returned the parent {worst}; there are 0 to {count - 1}")
        return places.astype(np.int64)

    def array(self, function: str, found: object) -> Floats:
        """Return an array of numbers."""
        try:
            return np.array(found, dtype=np.float64)
        except (TypeError, ValueError):
            raise self.refuse(function, f"returned {type(found).__name__}, which is not an array of numbers") from None

    def describe(self, state: Floats) -> str:
        """Return the coordinates of a state (d,) with their names and units, as a sentence has them."""
        if not self.components:
            return ", ".join(f"{value:.4g}" for value in state)
        return ", ".join(
            f"{each.name} = {value:.4g}{' ' + each.unit if each.unit else ''}"
            for each, value in zip(self.components, state, strict=False)
        )


ARGUMENTS: Final[Mapping[str, tuple[str, ...]]] = {
    "begin": ("n", "rng", "frame", "parameters", "target", "count"),
    "propagate": ("states", "rng", "frame", "parameters", "known"),
    "log_likelihood": ("states", "frame", "parameters", "known"),
}
"""The functions of a model, with the arguments that each may name."""


@dataclass(frozen=True, slots=True, eq=False)
class Filtered:
    """Results of a filter over T frames.

    Attributes:
        means: (T, d) posterior means.
        sds: (T, d) posterior standard deviations.
        log_evidence: (T,) log p(z_t | z_{1:t-1}), up to the constant that the likelihood leaves out.
        ess: (T,) effective sample size, 1 to n.
        particles: The posterior of the last frame.
    """

    means: Floats
    sds: Floats
    log_evidence: Floats
    ess: Floats
    particles: ParticleSet


def filter(  # noqa: A001 - as users call it, pftrack.filter
    model: Any,  # noqa: ANN401 - of anybody, by the names of its functions
    data: Iterable[Any],
    n: int = 1000,
    *,
    parameters: Any = None,  # noqa: ANN401 - of anybody
    target: Any = None,  # noqa: ANN401 - of anybody
    seed: int = 0,
    resample: Resampler = systematic,
    threshold: float = 0.5,
) -> Filtered:
    """Run a particle filter over data, and return what it finds.

    The model has three functions. Each receives only the arguments that it names:

    - begin(n, rng, ...) -> states (n, d), drawn before the first frame is seen;
    - propagate(states, rng, ...) -> states (n, d), each drawn from p(x_t | x_{t-1});
    - log_likelihood(states, frame, ...) -> (n,) log p(z_t | x_t), up to a constant; -inf for impossible states.

    All may name `parameters` and `frame`, one item of the data; begin may name `target`.

    Args:
        model: Any object with these functions.
        data: One item a frame: numbers, pictures, whatever the likelihood takes.
        n: Number of particles.
        parameters: Handed to the functions as they are.
        target: Handed to begin as it is.
        seed: Random seed; the same seed gives the same result.
        resample: How parents are drawn (`pftrack.filters.resampling`).
        threshold: Resample where the effective sample size is below this share of n.

    Raises:
        TypeError: The model lacks a function, or a function asks for an unknown argument.
        ValueError: There are no data, a function returns a wrong shape or NaN, or no particle is possible.
    """
    check_count("n", n)
    if n > MOST_PARTICLES:
        raise ValueError(f"a filter has at most {MOST_PARTICLES:,} particles, got n = {n:,}")
    functions = {name: _bind(model, name) for name in ARGUMENTS}
    answers = Answers(lambda name, problem: ValueError(f"{name} {problem}"))
    given = {"parameters": parameters, "target": target, "known": None, "n": n, "count": n}
    particles: ParticleSet | None = None
    rows: list[tuple[Floats, Floats, float, float]] = []
    for index, frame in enumerate(data):
        rng = numpy_generator(seed, index, int(Purpose.TRACK))
        seen = {**given, "frame": frame}

        def log_likelihood(states: Floats, seen: Mapping[str, Any] = seen, index: int = index) -> Floats:
            found = functions["log_likelihood"](**seen, states=states)
            logs = answers.logs("log_likelihood", found, len(states), states=states)
            if logs.max() == -np.inf:
                raise ValueError(
                    f"log_likelihood returned -inf for all {len(states)} particles of frame {index}: none is near what "
                    "was observed; use more particles, a wider begin or propagate, or a likelihood with heavier tails"
                )
            return logs

        def propagate(states: Floats, generator: Any, seen: Mapping[str, Any] = seen) -> Floats:  # noqa: ANN401
            found = functions["propagate"](**seen, states=states, rng=generator)
            return answers.states("propagate", found, len(states))

        if particles is None:
            start = numpy_generator(seed, index, int(Purpose.START))
            begun = ParticleSet.uniform(answers.states("begin", functions["begin"](**seen, rng=start), n))
            log_weights, log_evidence = normalise(begun.log_weights + log_likelihood(begun.states))
            particles = ParticleSet(begun.states, log_weights, begun.ancestors)
        else:
            posterior = bootstrap.step(
                particles, Sampled(propagate), log_likelihood, rng, count=n, resample=resample, threshold=threshold
            )
            particles, log_evidence = posterior.particles, posterior.log_evidence
        mean, covariance = particles.moments
        deviations = np.sqrt(np.maximum(covariance.diagonal(), 0.0))
        rows.append((mean, deviations, log_evidence, particles.effective_sample_size))
    if particles is None:
        raise ValueError("there are no data: a filter needs one frame at least")
    means, sds, evidence, ess = (np.array(column) for column in zip(*rows, strict=True))
    return Filtered(means, sds, evidence, ess, particles)


def _bind(model: object, name: str) -> Callable[..., object]:
    """Return a function of a model that takes any arguments and passes on those that it names."""
    function = getattr(model, name, None)
    if not callable(function):
        raise TypeError(f"a model has the functions {', '.join(ARGUMENTS)}; {type(model).__name__} has no {name}")
    wanted = named_arguments(name, function, ARGUMENTS[name], lambda of, problem: TypeError(f"{of} {problem}"))
    return lambda **given: function(**{each: given[each] for each in wanted})
