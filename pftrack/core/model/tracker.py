"""Trackers, and the interface of their states for code that runs, records and shows them."""

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
    """The immutable posterior of one frame; each family of trackers has its own class.

    It may hold particles, a Gaussian, a mixture, a set of ellipsoids or a beam of poses. General code needs only these
    members; trackers report further quantities as series.
    """

    @property
    def estimate(self) -> Floats:
        """(d,) posterior mean of the target's `position`."""

    @property
    def sigma(self) -> Floats:
        """(d,) posterior standard deviations; NaN for components in another unit than the experiment's."""

    @property
    def log_evidence(self) -> float:
        """Log p(z_t | z_{1:t-1}) up to a constant of the likelihood."""

    def arrays(self) -> Mapping[str, NDArray[Any]]:
        """Return the arrays of the belief by name, for a file; empty if it has only mean and covariance."""


@dataclass(frozen=True, slots=True)
class Fold:
    """The result of L frames processed at once.

    Attributes:
        state: State of the last frame.
        estimates: (L, tracked) posterior means.
        series: (L,) numbers or (L, d) vectors of the tracker's series, by name; it includes all series with a reduction
            or the role "extent".
    """

    state: TrackState
    estimates: Floats
    series: Mapping[str, Floats]


SHORT_NAME = re.compile(r"\(([^()]+)\)$")


EnsembleStep: TypeAlias = Callable[[Any, Iterable[Frame], History[Any], Sequence[int]], Iterator[Floats]]


@dataclass(frozen=True)
class Tracker:
    """A named tracking method.

    Attributes:
        id: Name in commands, addresses and files.
        start: (target, frame 0, parameters, rng) -> state of frame 0.
        step: (state, frame, parameters, rng) -> state of that frame.
        title: Name on the screen; may stand in `experiment.yaml` instead.
        description: How it works, in one sentence; may stand in `experiment.yaml` instead.
        fold: (state, pictures (L, height, width, 3), parameters, seed, index of the first) -> the result of L steps,
            computed faster; None if the parameters do not allow it.
        series: Series that it reports.
        measure: (state) -> values of these series by name, without those that the state does not have.
        searching: (state) -> whether the tracker reports that it has lost its target and searches for it; None for a
            tracker that never reports this, or does not with its present parameters.
        model: Model of the tracker, for inspecting its likelihood, particles and steps; None if it has none.
        replays: Whether it replays a recording, so that seed and settings have no effect.
        sampling: How it computes the posterior of its model: exactly (linear with Gaussian noise), by particles drawn
            from the dynamics, or in another way.
        ensemble: (state, next frames, history of parameters, seeds) -> for each of these frames the estimates
            (N, tracked) of steps with each of the N seeds, computed faster and without their states; None if there is
            no faster way.
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
        """How the log evidence of its states may be used to compare settings."""
        return self.model.evidence if self.model is not None and self.sampling != "other" else ""

    def cloud(self, state: State) -> Cloud | None:
        """Return the particles of a state; None for a state without particles."""
        return self.model.cloud(state) if self.model is not None else None

    def moved(self, state: State, moves: Iterable[Move]) -> State:
        """Return a state after moves by hand; the tracker's model must allow them."""
        for move in moves:
            assert self.model is not None  # noqa: S101 - for mypy: a run has checked it
            state = self.model.moved(state, move.particle, np.array(move.place))
        return state

    @property
    def term(self) -> Term:
        """Its entry in the glossary, under its title and the abbreviation that the title has in brackets."""
        title = self.title or self.id
        return Term(title, self.description.removesuffix(".") or title, tuple(SHORT_NAME.findall(title)))


def with_readers(declared: Sequence[Declaration], joined: Mapping[str, str]) -> tuple[Declaration, ...]:
    """Return declarations that list trackers added to an experiment among the readers of parameters.

    Args:
        declared: Declarations of the experiment's parameters.
        joined: Names of added trackers, each with the tracker whose parameters it reads.
    """

    def complete(each: Declaration) -> Declaration:
        more = tuple(name for name, like in joined.items() if like in each.trackers and name not in each.trackers)
        return each.model_copy(update={"trackers": each.trackers + more}) if more else each

    return tuple(complete(each) for each in declared)


# Diagnostics are the recorded numbers of a frame, small enough to keep for all frames; a step is a frame of a run with
# everything that views of it need.


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
        observation: Observed value of a signal; None for pictures.
        error: Distance of the estimate from the truth, inf for an estimate that is not finite; None where the truth is
            unknown.
        lost: Whether the target counts as lost by this error; None where the truth is unknown.
        hidden: Whether the target is known to be out of sight.
        searching: Whether the tracker reports that it has lost the target; None for a tracker without such a report.
        step_ms: Time of the tracker's step, ms.
        series: Values by name of the series that tracker and experiment declare and have in this frame.
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
        """Whether the target is lost by the truth, or, where it is unknown, by the tracker's own report."""
        return judge_loss(self.lost, self.searching).lost is True

    def number(self, name: str) -> float:
        """Return the value of a series of numbers; NaN if the frame has none."""
        value = self.series.get(name, math.nan)
        return float(value) if isinstance(value, int | float) else math.nan

    def vector(self, name: str) -> tuple[float, ...] | None:
        """Return the value of a series of vectors or intervals; None if the frame has none."""
        value = self.series.get(name)
        return value if isinstance(value, tuple) else None

    def hypotheses(self, name: str) -> Hypotheses | None:
        """Return the value of a series of hypotheses; None if the frame has none."""
        value = self.series.get(name)
        return value if isinstance(value, Hypotheses) else None

    def as_dict(self) -> dict[str, object]:
        """Return the values by name for JSON, with None for a number that is not finite."""
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
    """Return the diagnostics of a frame.

    Args:
        frame: The observation.
        state: The belief.
        verdict: Error, and whether the target is lost; None where unknown.
        step_ms: Time of the tracker's step, ms.
        scale: Factor from estimates and positions to the experiment's unit.
        searching: Whether the tracker searches for a lost target; None if it never does.
        series: Values of the series of tracker and experiment.
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
        hidden=None if hidden is None else bool(hidden),  # a comparison may give NumPy's bool, which JSON does not have
        searching=searching,
        step_ms=step_ms,
        series=series or {},
    )


def _scale(values: Floats, scale: float) -> tuple[float, ...]:
    return tuple((scale * values).tolist())


@dataclass(frozen=True, slots=True)
class Step:
    """One frame of a run: the observation, the belief, and the numbers of both.

    Attributes:
        frame: The observation.
        state: Posterior of the tracker.
        diagnostics: The numbers.
        parameters: Parameters in force in this frame.
        tracker: Name of the tracker of this step.
        tracker_title: Title of the tracker in the run's experiment.
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
        """Return the drawing of a frame.

        Args:
            step: The frame.
            past: Diagnostics of the run up to this frame or further.
            other: Diagnostics of the same frame in a second run for comparison.
        """
