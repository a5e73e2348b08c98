"""What a family believes of the world: where a target begins, how it moves, and how probable it makes what is seen.

A model is pure and knows no filter. From it follow the trackers (`pftrack.experiments.shared.filtered`), what can be
asked at any state and all over the picture (`pftrack.runs.inspection`), the fit of its noises, and the filter in a
person's own file, which replaces some of its functions (`pftrack.experiments.own`).

A model that is linear with Gaussian noise lays that open:

    x_t = A_t x_{t-1} + d_t + B_t u_t,  u_t ~ N(0, I)
    z_t = C_t x_t + v_t,                v_t ~ N(0, R_t)

Then the posterior can be computed exactly, and how large the noises were, given all frames, in closed form
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
"""The state of a tracker; each family has its own (`TrackState`)."""

Values: TypeAlias = Any
"""The experiment's own parameters."""

Evidence: TypeAlias = Literal["", "relative", "normalised"]
"""What a tracker's log evidence is worth when settings are compared.

- "normalised": it is the log of a density of what was observed that integrates to one whatever the settings, so the
  settings under which it is larger are the more probable ones.
- "relative": it lacks a constant of the frame that the sharpness of the likelihood changes, and nothing else. So how
  the target moves can be compared by it; sharpness only after the level of the likelihood all over the picture is
  taken away, for which states must have a place there.
- "": neither, or there is none.
"""

NoiseKind: TypeAlias = Literal["process", "observation"]

POWERS: Final[Mapping[bool, float]] = {False: 2.0, True: 1.0}
"""Of a number, that its noise's covariance is in proportion to, by whether it is a variance."""


@dataclass(frozen=True, slots=True)
class NoiseScale:
    """A number of a model that scales the covariance of one of its noises, and enters nothing else.

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
    """A linear Gaussian model of one frame, and what was measured in it.

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
    def of(cls, mean: Floats, covariance: Floats, steps: Sequence[LinearStep]) -> "LinearChain":
        """Return the chain of some frames.

        Args:
            mean: (d,) of the state before them.
            covariance: (d, d) of the same.
            steps: Of the T frames.
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
    """A family's belief about the world, of states that are arrays (N, d).

    A family overrides what it has. `known` is what its functions may know beside states: the state of the tracker in
    the frame before, as `prepare` has brought it up to the frame; of frame 0, that of frame 0 itself.

    Attributes:
        title: What the likelihood compares, a few words; empty where no state can be asked.
        evidence: What the mean likelihood of particles that are drawn by prediction is worth.
        weighs: Whether a particle that is drawn by prediction has a weight in proportion to the likelihood alone.
        scales: What scales the noises of a linear model, by the names of parameters; one of each kind at most.
        axes: Which two components are the place in the picture, px; None where `place` and `put` say it, or where
            states have none.
        most_places: How many states a map of the picture may ask for, so that it takes 50 ms at most.
        movable: Whether a person may put its particles and its estimate elsewhere.
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
        """Return the d coordinates of a state, in order; a model with a title must define it."""
        del parameters
        raise TypeError(f"the model {type(self).__name__} must define components")

    def log_likelihood(self, states: Floats, frame: Frame, parameters: Values, known: State) -> Floats:
        """Return log p(z_t | x_t) (N,) of states (N, d), up to a constant; NaN counts as impossible.

        A model with a title must define it.
        """
        del states, frame, parameters, known
        raise TypeError(f"the model {type(self).__name__} must define log_likelihood")

    def linear(self, frame: Frame, parameters: Values, known: State) -> LinearStep | None:
        """Return the model of a frame where it is linear and its noise Gaussian; else None."""
        del frame, parameters, known
        return None

    def prepare(self, state: State, frame: Frame, parameters: Values) -> State:
        """Return the state before as far as it can be brought up to a frame without its particles."""
        del frame, parameters
        return state

    # ------------------------------------------------------------ what there is to look into

    def centre(self, state: State) -> Floats:
        """Return the state (d,) that stands for what is believed."""
        mean: Floats = state.posterior.mean
        return mean

    @property
    def has_place(self) -> bool:
        """Whether its states lie in the picture, and can be asked all over it."""
        return bool(self.title) and self.axes is not None

    def place(self, states: Floats, known: State) -> Floats:
        """Return where states (N, d) are in the picture, (N, 2) px."""
        del known
        return np.asarray(states[:, list(self.axes or ())])

    def put(self, one: Floats, places: Floats, known: State) -> Floats:
        """Return states (M, d) at places (M, 2), px, that are else like one (d,)."""
        del known
        states = np.tile(one, (len(places), 1))
        states[:, list(self.axes or ())] = places
        return states

    def moved(self, state: State, particle: int | None, place: Floats) -> State:
        """Return a state with a particle at a place, or shifted as a whole until its estimate lies there."""
        del state, particle, place
        raise TypeError(f"the model {type(self).__name__} must define moved")

    def reach(self, size: tuple[int, int], count: int) -> Floats:
        """Return the lowest and the highest place that something can be moved to, (2, count).

        Args:
            size: Width and height of the picture, px.
            count: How many numbers a place has.
        """
        return np.array([(0.0,) * count, np.array(size) - 1.0])

    def landing(self, current: Floats, place_px: Floats) -> Floats:
        """Return the place of what was at another one, `current`, and is seen at one (2,) of the drawing, px."""
        del current
        return place_px

    def parts(self, one: Floats, frame: Frame, parameters: Values, known: State) -> tuple[Part, ...]:
        """Return what the likelihood of one state (d,) is made of."""
        del one, frame, parameters, known
        return ()

    def update_parts(self, before: State, state: State, frame: Frame, parameters: Values) -> tuple[Part, ...]:
        """Return what a step was made of beside particles: innovation and gain, or what each feature contributed."""
        del before, state, frame, parameters
        return ()

    def cloud(self, state: State) -> Cloud | None:
        """Return the particles of a state, laid open; None of a state without."""
        particles = state.particles
        return None if particles is None else Cloud(particles.states, particles.log_weights, particles.ancestors)

    def chains(self, state: State, frames: Sequence[Frame], parameters: Values) -> tuple[LinearChain, ...] | None:
        """Return the linear model of some frames, as chains whose log evidence sums to the tracker's.

        What a chain begins with depends on no noise that is scaled.

        Args:
            state: Of the first frame.
            frames: From that one on.
            parameters: In force.

        Returns:
            One chain, or of a tracker of many points one for each; None if the model is not linear.
        """
        steps = [self.linear(frame, parameters, state) for frame in frames[1:]]
        known = [step for step in steps if step is not None]
        if not known or len(known) < len(steps):
            return None
        posterior = state.reference or state.posterior
        return (LinearChain.of(posterior.mean, posterior.covariance, known),)

    def evaluate(self, before: State, states: Floats, frame: Frame, parameters: Values) -> Floats:
        """Return log p(z_t | x_t) (N,) of states (N, d), given the state before; NaN counts as impossible, -inf."""
        found = self.log_likelihood(states, frame, parameters, self.prepare(before, frame, parameters))
        return np.where(np.isnan(found), -np.inf, found)

    def map(
        self, before: State, state: State, frame: Frame, parameters: Values, size: tuple[int, int]
    ) -> LikelihoodMap:
        """Return the likelihood all over a picture.

        Args:
            before: The state of the frame before.
            state: The state of the frame: what is asked for is like it in all but the place.
            frame: What was seen.
            parameters: In force.
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
    """A belief that particle filters join: those of pftrack, and a person's own in a file.

    Python refuses a model that lacks one of the abstract functions, and names it.

    Attributes:
        observed: What a filter in a file finds in a frame, as a sentence.
        example: Address of the module whose text is a file to begin with; nothing imports it.
        reads: Name of the tracker whose parameters those functions read that stand in for what a file leaves out.
        project: (states (N, d), known) -> where each state sees the F points of a solid, (F, N, 2) px; None if states
            are not poses.
    """

    observed: str = ""
    example: str = ""
    reads: str = ""
    project: Callable[..., Floats] | None = None

    @abstractmethod
    def count(self, parameters: Values) -> int:
        """Return how many particles there are to be."""

    @abstractmethod
    def start(self, target: Target, frame: Frame, parameters: Values, rng: Stream) -> State:
        """Return the state of frame 0, with particles."""

    @abstractmethod
    def particles(self, state: State, parameters: Values, rng: Stream) -> Any:  # noqa: ANN401 - see `ParticleSet`
        """Return the particles of a state, drawn from what it believes if another tracker was at work before."""

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
        """Return the state of a frame, given the particles that a filter has made (`filtered.Update`)."""

    @property
    @abstractmethod
    def series(self) -> tuple[Series, ...]:
        """What a particle filter of it reports."""

    @abstractmethod
    def measure(self, state: State) -> Mapping[str, SeriesValue]:
        """Return the values of these series; those that a state does not have are left out."""

    def see(self, frame: Frame, known: State) -> Frame:
        """Return a frame as a filter in a file sees it."""
        del known
        return frame
