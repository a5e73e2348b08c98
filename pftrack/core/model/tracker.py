"""What a tracker is, and what its states and its model offer to the code that runs, records and watches it.

A tracker whose model is linear and all noise Gaussian lays it open:

    x_t = A_t x_{t-1} + d_t + B_t u_t,  u_t ~ N(0, I)
    z_t = C_t x_t + v_t,                v_t ~ N(0, R_t)

For such a model more can be computed than by running the filter: how large the noises were, given all frames, in closed
form (`pftrack.filters.learning.online_em`).
"""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.glossary import Term
from pftrack.core.model.likelihood import Cloud, ObservationLikelihood, Part
from pftrack.core.model.parameters import Declaration
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.source import Frame, History, Target
from pftrack.core.numerics.random import Stream

# A tracker declares which of its numbers scale which noise, and lays the linear model of some frames open as chains.
# One chain is one such recursion; a tracker of many points has one for each.

NoiseKind: TypeAlias = Literal["process", "observation"]

POWERS: Final[Mapping[bool, float]] = {False: 2.0, True: 1.0}
"""Of a number, that its noise's covariance is in proportion to, by whether it is a variance."""


@dataclass(frozen=True, slots=True)
class NoiseScale:
    """A number of a tracker that scales the covariance of one of its noises, and enters nothing else.

    Attributes:
        kind: "process" if all B_t B_t^T are in proportion to it, "observation" if all R_t are.
        is_variance: Whether it is a variance; else it is a standard deviation.
    """

    kind: NoiseKind
    is_variance: bool = False

    def factor(self, before: float, after: float) -> float:
        """Return by what the covariance is multiplied when the number changes."""
        return float((after / before) ** POWERS[self.is_variance])

    def scale(self, before: float, factor: float) -> float:
        """Return the number after the covariance was multiplied by a factor."""
        return float(before * factor ** (1.0 / POWERS[self.is_variance]))


@dataclass(frozen=True, slots=True, eq=False)
class LinearChain:
    """A linear Gaussian model over T frames, and what was measured in them.

    Attributes:
        mean: (d,) of the state before the first of these frames.
        covariance: (d, d) of the same, which may be singular.
        transitions: (T, d, d) A_t.
        offsets: (T, d) d_t.
        noises: (T, d, k) B_t.
        measurements: (T, m) z_t; a row that is not finite is missing.
        observations: (T, m, d) C_t.
        covariances: (T, m, m) R_t, positive definite.
    """

    mean: Floats
    covariance: Floats
    transitions: Floats
    offsets: Floats
    noises: Floats
    measurements: Floats
    observations: Floats
    covariances: Floats

    @classmethod
    def steady(
        cls,
        mean: Floats,
        covariance: Floats,
        transition: Floats,
        offset: Floats,
        noise: Floats,
        measurements: Floats,
        observation: Floats,
        measurement_covariance: Floats,
    ) -> "LinearChain":
        """Return the chain of a model that is the same in all frames.

        Args:
            mean: (d,).
            covariance: (d, d).
            transition: A, (d, d).
            offset: (d,).
            noise: B, (d, k).
            measurements: (T, m).
            observation: C, (m, d).
            measurement_covariance: R, (m, m).
        """

        def repeat(matrix: Floats) -> Floats:
            return np.array(np.broadcast_to(matrix, (len(measurements), *matrix.shape)))

        parts = repeat(transition), repeat(offset), repeat(noise)
        return cls(mean, covariance, *parts, measurements, repeat(observation), repeat(measurement_covariance))


@dataclass(frozen=True)
class LinearModel:
    """That a tracker computes the exact posterior of a linear Gaussian model.

    Attributes:
        scales: What scales its noises, by the names of parameters; one of each kind at most.
        chains: (state of frame 0, frames from 0 on, parameters) -> the model of these frames; None if it is not linear
            with these parameters, or on such frames. What a chain begins with depends on no noise that is scaled, and
            the sum of the chains' log evidence is that of the tracker.
    """

    scales: Mapping[str, NoiseScale]
    chains: Callable[[Any, Sequence[Frame], Any], tuple[LinearChain, ...] | None]


class TrackState(Protocol):
    """The posterior of one frame, immutable; each family of trackers has its own.

    Particles, one Gaussian, a mixture, a set of ellipsoids or a beam of poses: general code needs no more of a belief
    than this. What a kind of belief has beyond it, its trackers declare and report as series.
    """

    @property
    def estimate(self) -> Floats:
        """(d,) posterior mean of what the target's `position` is."""

    @property
    def sigma(self) -> Floats:
        """(d,) posterior standard deviations; NaN of a number in another unit than the experiment's."""

    @property
    def log_evidence(self) -> float:
        """Log p(z_t | z_{1:t-1}) up to the constant that the likelihood leaves out."""

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Return the belief's arrays by name, for a file; empty if mean and covariance are all there is."""


@dataclass(frozen=True, slots=True)
class Fold:
    """What comes of L frames taken at once.

    Attributes:
        state: Of the last frame.
        estimates: (L, tracked) posterior means.
        series: (L,) numbers or (L, d) vectors of the tracker's series, by name; all that have a reduction, or the role
            "extent", are there.
    """

    state: TrackState
    estimates: Floats
    series: Mapping[str, Floats]


def nothing(state: Any) -> Mapping[str, SeriesValue]:  # noqa: ANN401 - the state of any family
    """Measure nothing beyond what every state offers."""
    del state
    return {}


SHORT_NAME = re.compile(r"\(([^()]+)\)$")


Evidence: TypeAlias = Literal["", "relative", "normalised"]
"""What a tracker's log evidence is worth when settings are compared.

- "normalised": it is the log of a density of what was observed that integrates to one whatever the settings, so the
  settings under which it is larger are the more probable ones.
- "relative": it lacks a constant of the frame that the sharpness of the likelihood changes, and nothing else. So how
  the target moves can be compared by it; sharpness only after the level of the likelihood all over the picture is
  taken away, for which the tracker declares its likelihood with an anchor.
- "": neither, or there is none.
"""


EnsembleStep: TypeAlias = Callable[[Any, Iterable[Frame], History[Any], Sequence[int]], Iterator[Floats]]


@dataclass(frozen=True)
class Tracker:
    """A named way of tracking.

    Attributes:
        id: Name in commands, addresses and files.
        title: Name on the screen.
        description: One sentence on how it works.
        start: (target, frame 0, parameters, rng) -> state of frame 0.
        step: (state, frame, parameters, rng) -> state of that frame.
        fold: (state, pictures (L, height, width, 3), parameters, seed, index of the first) -> what comes of them, the
            same as of L steps but faster; None if these parameters do not allow it.
        series: What it reports of its states.
        measure: (state) -> the values of these series, by name; those that a state does not have are left out.
        searching: (state) -> whether it has lost the target by its own account and looks for it; None for a tracker
            that always follows, rightly or wrongly, as for a state of one that does so by its parameters.
        reads: Names of other trackers whose parameters it reads, beside the parameters that name it. None, of one that
            no parameter names, for all parameters: it joined an experiment that was declared without it.
        likelihood: What it weighs states by, to be asked at any state; None where that is nothing that can be asked.
        cloud: (state) -> its particles, laid open; None of a state without, and for a tracker that never has any.
        evidence: What the log evidence of its states is worth when settings are compared.
        update_parts: (state before, state, frame, parameters) -> what the step of the frame was made of, beside
            particles: innovation and gain, or what each feature contributed.
        replays: It says again what was recorded, whatever seed and settings are: nothing can be tried with it.
        linear: The model, where it is linear, its noise Gaussian, and what the tracker computes is exact.
        ensemble: (state, frames to come, history of parameters, seeds) -> for each of these frames the estimates
            (N, tracked) that steps come to with each of the N seeds, faster than by steps and without their states;
            None for a tracker that knows no faster way.
    """

    id: str
    title: str
    description: str
    start: Callable[[Target, Frame, Any, Stream], TrackState]
    step: Callable[[Any, Frame, Any, Stream], TrackState]
    fold: Callable[[Any, NDArray[np.uint8], Any, int, int], Fold | None] | None = None
    series: tuple[Series, ...] = ()
    measure: Callable[[Any], Mapping[str, SeriesValue]] = nothing
    searching: Callable[[Any], bool | None] | None = None
    reads: tuple[str, ...] | None = None
    likelihood: ObservationLikelihood | None = None
    cloud: Callable[[Any], Cloud | None] | None = None
    evidence: Evidence = ""
    update_parts: Callable[[Any, Any, Frame, Any], tuple[Part, ...]] | None = None
    replays: bool = False
    linear: LinearModel | None = None
    ensemble: EnsembleStep | None = None

    @property
    def term(self) -> Term:
        """What the glossary says of it, under its title and the short name that the title has in brackets."""
        title = self.title or self.id
        return Term(title, self.description.removesuffix(".") or title, tuple(SHORT_NAME.findall(title)))


def with_readers(declared: Sequence[Declaration], trackers: Mapping[str, Tracker]) -> tuple[Declaration, ...]:
    """Return declarations that name all their readers among some trackers, those that joined later included."""
    named = {name for each in declared for name in each.trackers}

    def joins(name: str, tracker: Tracker, readers: tuple[str, ...]) -> bool:
        if tracker.reads is None:
            return name not in named
        return name not in readers and not set(tracker.reads).isdisjoint(readers)

    def complete(each: Declaration) -> Declaration:
        joined = tuple(name for name, tracker in trackers.items() if joins(name, tracker, each.trackers))
        return each.model_copy(update={"trackers": each.trackers + joined}) if each.trackers and joined else each

    return tuple(complete(each) for each in declared)
