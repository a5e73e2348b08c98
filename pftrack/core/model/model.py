"""Models: the start and the motion of a target, and the likelihood of observations.

A model is pure and independent of filters. It is the basis of trackers (`pftrack.experiments.shared.filtered`),
inspection at any state and all over the picture (`pftrack.runs.inspection`), fits of noises, and filters in people's
own files, which replace some of its functions (`pftrack.experiments.own`).

A model that is linear with Gaussian noise declares it:

    x_t = A_t x_{t-1} + d_t + B_t u_t,  u_t ~ N(0, I)
    z_t = C_t x_t + v_t,                v_t ~ N(0, R_t)

Then the posterior has an exact form, and so have the estimates of the noises from all frames
(`pftrack.filters.learning.online_em`).
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Final, Literal, NamedTuple, Protocol, TypeAlias

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.likelihood import Cloud, Component, LikelihoodMap, Part, lattice
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.source import Frame, Target
from pftrack.core.numerics.random import Generator, Stream

State: TypeAlias = Any
"""The state of a tracker; each family has its own class (`TrackState`)."""

Values: TypeAlias = Any
"""The experiment's own parameters."""

Evidence: TypeAlias = Literal["", "relative", "normalised"]
"""How a tracker's log evidence may be used to compare settings.

- "normalised": it is the log of a density of the observations that integrates to one for all settings, so settings with
  a larger value are more probable.
- "relative": it lacks a constant of the frame that depends only on the sharpness of the likelihood. So it compares
  motion models; it compares sharpness only after subtracting the level of the likelihood over the picture, which needs
  states with a place.
- "": it must not be used, or does not exist.
"""

NoiseKind: TypeAlias = Literal["process", "observation"]

POWERS: Final[Mapping[bool, float]] = {False: 2.0, True: 1.0}
"""Power of a number to which the noise's covariance is proportional, by whether the number is a variance."""


@dataclass(frozen=True, slots=True)
class NoiseScale:
    """A number of a model that only scales the covariance of one of its noises.

    Attributes:
        kind: "process" if it scales all B_t B_t^T, "observation" if it scales all R_t.
        is_variance: Whether it is a variance and not a standard deviation.
    """

    kind: NoiseKind
    is_variance: bool = False

    def factor(self, before: float, after: float) -> float:
        """Return the factor of the covariance when the number changes."""
        return float((after / before) ** POWERS[self.is_variance])

    def scale(self, before: float, factor: float) -> float:
        """Return the number after multiplying the covariance by a factor."""
        return float(before * factor ** (1.0 / POWERS[self.is_variance]))


class LinearTransition(Protocol):
    """x' = A x + d + B u, as `pftrack.filters.dynamics.LinearDynamics`."""

    @property
    def transition(self) -> Floats:
        """A, (d, d)."""

    @property
    def offset(self) -> Floats:
        """d, (d,)."""

    @property
    def noise(self) -> Floats:
        """B, (d, k)."""


@dataclass(frozen=True, slots=True, eq=False)
class LinearStep:
    """A linear Gaussian model of one frame with its measurement.

    Attributes:
        dynamics: A_t, d_t and B_t.
        measurement: (m,) z_t; None if it is missing.
        observation: (m, d) C_t.
        covariance: (m, m) R_t, positive definite.
    """

    dynamics: LinearTransition
    measurement: Floats | None
    observation: Floats
    covariance: Floats


class LinearChain(NamedTuple):
    """A linear Gaussian model of T frames with their measurements.

    Attributes:
        mean: (d,) mean of the state before the first frame.
        covariance: (d, d) its covariance, which may be singular.
        transitions: (T, d, d) A_t.
        offsets: (T, d) d_t.
        noises: (T, d, k) B_t.
        measurements: (T, m) z_t; a non-finite row is missing.
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
    def of(cls, mean: Floats, covariance: Floats, steps: Sequence[LinearStep]) -> "LinearChain":
        """Return the chain of some frames.

        Args:
            mean: (d,) mean of the state before them.
            covariance: (d, d) its covariance.
            steps: Steps of the T frames.
        """
        missing = np.full(len(steps[0].observation), np.nan)
        return cls(
            mean,
            covariance,
            np.array([step.dynamics.transition for step in steps]),
            np.array([step.dynamics.offset for step in steps]),
            np.array([step.dynamics.noise for step in steps]),
            np.array([missing if step.measurement is None else step.measurement for step in steps]),
            np.array([step.observation for step in steps]),
            np.array([step.covariance for step in steps]),
        )


class Model:
    """A model of a family, with states as arrays (N, d).

    A family overrides the functions that it has. `known` is the tracker's state in the frame before, as updated by
    `prepare`; in frame 0 it is the state of frame 0.

    Attributes:
        title: Title of the likelihood in a few words; empty if it cannot be evaluated.
        evidence: How the mean likelihood of predicted particles may be used to compare settings.
        weighs: Whether the weight of a predicted particle is proportional to the likelihood alone.
        scales: Scales of the noises of a linear model, by names of parameters; at most one of each kind.
        axes: The two components that are the place in the picture, px; None if `place` and `put` define it, or if
            states have no place.
        most_places: Largest number of states on a map of the picture, so that it takes at most 50 ms.
        movable: Whether people may move its particles and its estimate.
    """

    title: str = ""
    evidence: Evidence = ""
    weighs: bool = True
    scales: ClassVar[Mapping[str, NoiseScale]] = {}
    axes: tuple[int, int] | None = (0, 1)
    most_places: int = 4800
    movable: bool = False

    # ------------------------------------------------------------ belief

    def components(self, parameters: Values) -> tuple[Component, ...]:
        """Return the d coordinates of a state in order; a model with a title must define it."""
        del parameters
        raise TypeError(f"the model {type(self).__name__} must define components")

    def log_likelihood(self, states: Floats, frame: Frame, parameters: Values, known: State) -> Floats:
        """Return log p(z_t | x_t) (N,) of states (N, d), up to a constant; NaN counts as impossible.

        A model with a title must define it.
        """
        del states, frame, parameters, known
        raise TypeError(f"the model {type(self).__name__} must define log_likelihood")

    def linear(self, frame: Frame, parameters: Values, known: State) -> LinearStep | None:
        """Return the model of a frame if it is linear with Gaussian noise; else None."""
        del frame, parameters, known
        return None

    def prepare(self, state: State, frame: Frame, parameters: Values) -> State:
        """Return the state of the frame before, updated to this frame except for its particles."""
        del frame, parameters
        return state

    # ------------------------------------------------------------ what there is to look into

    def centre(self, state: State) -> Floats:
        """Return the state (d,) that represents the belief."""
        mean: Floats = state.posterior.mean
        return mean

    @property
    def has_place(self) -> bool:
        """Whether its states have places in the picture, so that a map is possible."""
        return bool(self.title) and self.axes is not None

    def place(self, states: Floats, known: State) -> Floats:
        """Return the places (N, 2) of states (N, d) in the picture, px."""
        del known
        return np.asarray(states[:, list(self.axes or ())])

    def put(self, one: Floats, places: Floats, known: State) -> Floats:
        """Return states (M, d) at places (M, 2), px, that otherwise equal one state (d,)."""
        del known
        states = np.tile(one, (len(places), 1))
        states[:, list(self.axes or ())] = places
        return states

    def moved(self, state: State, particle: int | None, place: Floats) -> State:
        """Return a state with a particle at a place, or (particle None) shifted until its estimate is there."""
        del state, particle, place
        raise TypeError(f"the model {type(self).__name__} must define moved")

    def reach(self, size: tuple[int, int], count: int) -> Floats:
        """Return the lowest and the highest place for moves, (2, count).

        Args:
            size: Width and height of the picture, px.
            count: Number of coordinates of a place.
        """
        return np.array([(0.0,) * count, np.array(size) - 1.0])

    def landing(self, current: Floats, place_px: Floats) -> Floats:
        """Return the new place of an object at `current` that is moved to (2,) in the drawing, px."""
        del current
        return place_px

    def parts(self, one: Floats, frame: Frame, parameters: Values, known: State) -> tuple[Part, ...]:
        """Return the parts of the likelihood of one state (d,)."""
        del one, frame, parameters, known
        return ()

    def update_parts(self, before: State, state: State, frame: Frame, parameters: Values) -> tuple[Part, ...]:
        """Return the parts of a step besides particles: innovation and gain, or contributions of features."""
        del before, state, frame, parameters
        return ()

    def cloud(self, state: State) -> Cloud | None:
        """Return the particles of a state; None for a state without particles."""
        particles = state.particles
        return None if particles is None else Cloud(particles.states, particles.log_weights, particles.ancestors)

    def chains(self, state: State, frames: Sequence[Frame], parameters: Values) -> tuple[LinearChain, ...] | None:
        """Return the linear model of some frames as chains whose log evidence sums to that of the tracker.

        The initial state of a chain does not depend on scaled noises.

        Args:
            state: State of the first frame.
            frames: The frames from that one on.
            parameters: Parameters in force.

        Returns:
            One chain, or one for each point of a tracker of many points; None if the model is not linear.
        """
        steps = [self.linear(frame, parameters, state) for frame in frames[1:]]
        known = [step for step in steps if step is not None]
        if not known or len(known) < len(steps):
            return None
        posterior = state.reference or state.posterior
        return (LinearChain.of(posterior.mean, posterior.covariance, known),)

    def evaluate(self, before: State, states: Floats, frame: Frame, parameters: Values) -> Floats:
        """Return log p(z_t | x_t) (N,) of states (N, d), given the state before; NaN becomes -inf."""
        found = self.log_likelihood(states, frame, parameters, self.prepare(before, frame, parameters))
        return np.where(np.isnan(found), -np.inf, found)

    def map(
        self, before: State, state: State, frame: Frame, parameters: Values, size: tuple[int, int]
    ) -> LikelihoodMap:
        """Return the likelihood over a picture.

        Args:
            before: State of the frame before.
            state: State of the frame; the evaluated states differ from it only in the place.
            frame: The observation.
            parameters: Parameters in force.
            size: Width and height of the picture, px.

        Raises:
            ValueError: The states have no place in the picture.
        """
        if not self.has_place:
            raise ValueError(f"the {self.title} has no place in the picture")
        known = self.prepare(before, frame, parameters)
        places, (rows, columns), step = lattice(size, self.most_places)
        found = self.log_likelihood(self.put(self.centre(state), places, known), frame, parameters, known)
        return LikelihoodMap(np.where(np.isnan(found), -np.inf, found).reshape(rows, columns), step)


class FilterModel(Model, ABC):
    """A model for particle filters: those of pftrack, and people's own in files.

    Python refuses a model that lacks one of the abstract functions, and names it.

    Attributes:
        observed: Content of a frame for a filter in a file, as a sentence.
        example: Name of the module whose text is an example file; it is not imported.
        reads: Name of the tracker whose parameters are used by the functions that a file leaves out.
        project: (states (N, d), known) -> images of the F points of a solid in each state, (F, N, 2) px; None if states
            are not poses.
    """

    observed: str = ""
    example: str = ""
    reads: str = ""
    project: Callable[..., Floats] | None = None

    @abstractmethod
    def count(self, parameters: Values) -> int:
        """Return the number of particles."""

    @abstractmethod
    def start(self, target: Target, frame: Frame, parameters: Values, rng: Stream) -> State:
        """Return the state of frame 0, with particles."""

    @abstractmethod
    def particles(self, state: State, parameters: Values, rng: Stream) -> Any:  # noqa: ANN401 - see `ParticleSet`
        """Return the particles of a state; if another tracker made it, draw them from its belief."""

    @abstractmethod
    def propagate(self, states: Floats, frame: Frame, parameters: Values, rng: Generator, known: State) -> Floats:
        """Return states (N, d), each drawn from p(x_t | x_{t-1}) given one of the states (N, d)."""

    @abstractmethod
    def components(self, parameters: Values) -> tuple[Component, ...]:
        """Return the d coordinates of a state, in order."""

    @abstractmethod
    def log_likelihood(self, states: Floats, frame: Frame, parameters: Values, known: State) -> Floats:
        """Return log p(z_t | x_t) (N,) of states (N, d), up to a constant; NaN counts as impossible."""

    @abstractmethod
    def believe(self, known: State, update: Any, frame: Frame, parameters: Values) -> State:  # noqa: ANN401
        """Return the state of a frame from the particles of a filter (`filtered.Update`)."""

    @property
    @abstractmethod
    def series(self) -> tuple[Series, ...]:
        """Series that a particle filter with this model reports."""

    @abstractmethod
    def measure(self, state: State) -> Mapping[str, SeriesValue]:
        """Return the values of these series, without those that a state does not have."""

    def see(self, frame: Frame, known: State) -> Frame:
        """Return a frame as a filter in a file sees it."""
        del known
        return frame
