"""What a tracker is, and what its states offer to the code that runs, records and watches it."""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Literal, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.drawing import Drawing
from pftrack.core.model.glossary import Term
from pftrack.core.model.likelihood import Cloud
from pftrack.core.model.measures import judge_loss
from pftrack.core.model.model import Evidence, Model, State
from pftrack.core.model.parameters import Declaration
from pftrack.core.model.recipe import Move
from pftrack.core.model.series import Hypotheses, Series, SeriesValue, to_json
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
        start: (target, frame 0, parameters, rng) -> state of frame 0.
        step: (state, frame, parameters, rng) -> state of that frame.
        title: Name on the screen; `experiment.yaml` may say it instead.
        description: One sentence on how it works; `experiment.yaml` may say it instead.
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
    start: Callable[[Target, Frame, Any, Stream], TrackState]
    step: Callable[[Any, Frame, Any, Stream], TrackState]
    title: str = ""
    description: str = ""
    fold: Callable[[Any, NDArray[np.uint8], Any, int, int], Fold | None] | None = None
    series: tuple[Series, ...] = ()
    measure: Callable[[Any], Mapping[str, SeriesValue]] = lambda _state: {}
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

    def moved(self, state: State, moves: Iterable[Move]) -> State:
        """Return a state after moves by hand; the tracker's model must allow them."""
        for move in moves:
            assert self.model is not None  # noqa: S101 - for mypy: a run has checked it
            state = self.model.moved(state, move.particle, np.array(move.place))
        return state

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


# Diagnostics and steps: what is written down of every frame, and one frame of a run as all that shows it gets it.
#
# Diagnostics are small enough to keep for all frames.


@dataclass(frozen=True, slots=True)
class Diagnostics:
    """One frame of a run in numbers.

    Attributes:
        frame: Index within the run.
        time_s: Time since frame 0, s.
        estimate: Posterior mean, in the experiment's unit (px of the picture, or degrees).
        sigma: Posterior standard deviations, same unit.
        log_evidence: log p(z_t | z_{1:t-1}) up to a constant of the likelihood; -inf if every weight was zero.
        truth: The true position; None where it is unknown.
        extent: Width and height of the true box, px; None where it is unknown, or there is none.
        observation: What was seen of a signal; None for pictures.
        error: Distance of the estimate from the truth, inf for an estimate that is not finite; None where the truth is
            unknown.
        lost: Whether that counts as lost; None where the truth is unknown.
        hidden: Whether the target is known to be out of sight.
        searching: Whether the tracker has lost the target by its own account; None for one that always follows.
        step_ms: Time that the tracker took for the frame, ms.
        series: What tracker and experiment have measured beside it, by name: that which they declare and have.
    """

    frame: int
    time_s: float
    estimate: tuple[float, ...]
    sigma: tuple[float, ...]
    log_evidence: float
    truth: tuple[float, ...] | None
    extent: tuple[float, float] | None
    observation: tuple[float, ...] | None
    error: float | None
    lost: bool | None
    hidden: bool | None
    searching: bool | None
    step_ms: float
    series: Mapping[str, SeriesValue] = field(default_factory=dict)

    @property
    def is_lost(self) -> bool:
        """Whether the target is lost: by the truth, or by the tracker's own account where the truth is unknown."""
        return judge_loss(self.lost, self.searching).lost is True

    def number(self, name: str) -> float:
        """Return the value of a series of numbers; NaN where the frame has none."""
        value = self.series.get(name, math.nan)
        return float(value) if isinstance(value, int | float) else math.nan

    def vector(self, name: str) -> tuple[float, ...] | None:
        """Return the value of a series of vectors or intervals; None where the frame has none."""
        value = self.series.get(name)
        return value if isinstance(value, tuple) else None

    def hypotheses(self, name: str) -> Hypotheses | None:
        """Return the value of a series of hypotheses; None where the frame has none."""
        value = self.series.get(name)
        return value if isinstance(value, Hypotheses) else None

    def as_dict(self) -> dict[str, object]:
        """Return the values by name, ready for JSON: a number that is not finite becomes None."""
        row: dict[str, object] = {}
        for it in fields(self):
            value = getattr(self, it.name)
            row[it.name] = to_json(value) if isinstance(value, float | tuple) else value
        return row | {"series": {name: to_json(value) for name, value in self.series.items()}}


def diagnose(
    frame: Frame,
    state: TrackState,
    verdict: tuple[float | None, bool | None],
    step_ms: float,
    *,
    scale: float = 1.0,
    searching: bool | None = None,
    series: Mapping[str, SeriesValue] | None = None,
) -> Diagnostics:
    """Write down a frame.

    Args:
        frame: What was seen.
        state: What is believed.
        verdict: Error, and whether that is lost; None where unknown.
        step_ms: Time that the tracker took, ms.
        scale: What turns estimates and positions into the experiment's unit.
        searching: Whether the tracker looks for a target that it has lost; None if it never does.
        series: What tracker and experiment have measured.
    """
    target = frame.target
    error, lost = verdict
    hidden = target.hidden if target else None
    return Diagnostics(
        frame=frame.index,
        time_s=frame.time_s,
        estimate=_scale(state.estimate, scale),
        sigma=_scale(state.sigma, scale),
        log_evidence=state.log_evidence,
        truth=_scale(target.position, scale) if target else None,
        extent=target.extent if target else None,
        observation=tuple(frame.signal.tolist()) if frame.signal is not None else None,
        error=error,
        lost=lost,
        hidden=None if hidden is None else bool(hidden),  # NumPy's own kind, which comparisons give, JSON does not know
        searching=searching,
        step_ms=step_ms,
        series=series or {},
    )


def _scale(values: Floats, scale: float) -> tuple[float, ...]:
    return tuple((scale * values).tolist())


@dataclass(frozen=True, slots=True)
class Step:
    """One frame of a run: what was seen, what is believed, and the numbers of both.

    Attributes:
        frame: What the source showed.
        state: The tracker's posterior, of the kind that the experiment's trackers have.
        diagnostics: The numbers.
        parameters: In force in this frame.
        tracker: Name of the tracker that took the step.
        tracker_title: Its title, as the experiment of the run has it.
    """

    frame: Frame
    state: Any
    diagnostics: Diagnostics
    parameters: Any
    tracker: str
    tracker_title: str


class Draw(Protocol):
    """Draw a frame."""

    def __call__(self, step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
        """Return what is to be seen.

        Args:
            step: The frame.
            past: The run's diagnostics up to this frame, or further.
            other: The diagnostics of the same frame in a second run, if there is one to compare with.
        """
