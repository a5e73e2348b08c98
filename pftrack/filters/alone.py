"""A filter by itself: your model on your data, without an experiment.

    class Walk:
        def begin(self, rng, n):
            return rng.normal(0.0, 1.0, (n, 1))

        def propagate(self, states, rng):
            return states + rng.normal(0.0, 0.1, states.shape)

        def log_likelihood(self, states, frame):
            return -0.5 * ((frame - states[:, 0]) / 0.2) ** 2

    found = pftrack.filter(Walk(), measurements, n=1000)

It is the bootstrap filter (`pftrack.filters.bootstrap`; Gordon, Salmond and Smith 1993). A model of pftrack's own
(`pftrack.core.model.model.Model`) whose functions need no tracker's state runs as well, on a list of its frames.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.numerics.checks import check_count
from pftrack.core.numerics.random import Purpose, numpy_generator
from pftrack.filters import bootstrap
from pftrack.filters.answers import MOST_PARTICLES, Answers, named_arguments
from pftrack.filters.dynamics import Sampled
from pftrack.filters.particles import ParticleSet, normalise
from pftrack.filters.resampling import Resampler, systematic

ARGUMENTS: Final[Mapping[str, tuple[str, ...]]] = {
    "begin": ("n", "rng", "frame", "parameters", "target", "count"),
    "propagate": ("states", "rng", "frame", "parameters", "known"),
    "log_likelihood": ("states", "frame", "parameters", "known"),
}
"""The functions of a model, with the arguments that each may name."""


@dataclass(frozen=True, slots=True, eq=False)
class Filtered:
    """What a filter found in T frames.

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

    The model has three functions, which get those of their arguments that they name:

    - begin(n, rng, ...) -> states (n, d), drawn before the first frame is seen;
    - propagate(states, rng, ...) -> states (n, d), each drawn from p(x_t | x_{t-1});
    - log_likelihood(states, frame, ...) -> (n,) log p(z_t | x_t), up to a constant; -inf for what cannot be.

    All may name `parameters` and `frame`, one item of the data; begin may name `target`.

    Args:
        model: Any object with these functions.
        data: One item a frame: numbers, pictures, whatever the likelihood takes.
        n: Number of particles.
        parameters: Handed to the functions as they are.
        target: Handed to begin as it is.
        seed: Of all random numbers; the same one gives the same result.
        resample: How parents are drawn (`pftrack.filters.resampling`).
        threshold: Resample where the effective sample size is below this share of n.

    Raises:
        TypeError: The model lacks a function, or one asks for an argument that there is not.
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
