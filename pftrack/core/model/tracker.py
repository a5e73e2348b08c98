"""What a tracker is, and what its states offer to the code that runs, records and watches it."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.glossary import Term
from pftrack.core.model.likelihood import Cloud
from pftrack.core.model.model import Evidence, Model, State, nothing
from pftrack.core.model.parameters import Declaration
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.source import Frame, History, Target
from pftrack.core.numerics.random import Stream


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


SHORT_NAME = re.compile(r"\(([^()]+)\)$")


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
        model: What it believes of the world: its likelihood, its particles and what a step was made of can be looked
            into; None where there is nothing to be seen.
        replays: It says again what was recorded, whatever seed and settings are: nothing can be tried with it.
        sampling: How it computes the posterior of its model: exactly, since that is linear with Gaussian noise; by
            particles that are all drawn from the dynamics; or in another way.
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
    model: Model | None = None
    replays: bool = False
    sampling: Literal["exact", "prior", "other"] = "other"
    ensemble: EnsembleStep | None = None

    @property
    def evidence(self) -> Evidence:
        """What the log evidence of its states is worth when settings are compared."""
        return self.model.evidence if self.model is not None and self.sampling != "other" else ""

    def cloud(self, state: State) -> Cloud | None:
        """Return the particles of a state, laid open; None of a state without."""
        return self.model.cloud(state) if self.model is not None else None

    @property
    def term(self) -> Term:
        """What the glossary says of it, under its title and the short name that the title has in brackets."""
        title = self.title or self.id
        return Term(title, self.description.removesuffix(".") or title, tuple(SHORT_NAME.findall(title)))


def with_readers(declared: Sequence[Declaration], joined: Mapping[str, str]) -> tuple[Declaration, ...]:
    """Return declarations that name trackers as readers that joined an experiment later.

    Args:
        declared: What the experiment's parameters declare.
        joined: Names of such trackers, each with the one whose parameters it reads.
    """

    def complete(each: Declaration) -> Declaration:
        more = tuple(name for name, like in joined.items() if like in each.trackers and name not in each.trackers)
        return each.model_copy(update={"trackers": each.trackers + more}) if more else each

    return tuple(complete(each) for each in declared)
