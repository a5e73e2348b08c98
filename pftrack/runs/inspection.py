"""Inspecting a run: the likelihood at a place of the current frame, and ancestors and descendants of a particle.

A run keeps states only at keyframes (`pftrack.runs.checkpoint`). To follow particles back, the inspection repeats the
steps of the last frames once, and keeps the few numbers that it needs of their particles. The position of the run
stays.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
from pydantic import ConfigDict, Field, with_config

from pftrack.core.arrays import Floats, Ints
from pftrack.core.model import likelihood
from pftrack.core.model.model import Model, State
from pftrack.core.model.series import Known
from pftrack.core.model.tracker import Step, Tracker
from pftrack.core.refusal import ParameterError
from pftrack.runs.run import Run

# Each cloud holds the indices of its particles' parents in the cloud before. A frame without particles, with particles
# of other filters, or with unknown parents ends all lines.


def find_ancestor(particle: int, clouds: Sequence[likelihood.Cloud | None]) -> int | None:
    """Return the ancestor in the first cloud of a particle in the last; None if its line began in between."""
    for before, cloud in zip(clouds[-2::-1], clouds[:0:-1], strict=True):
        parents = _parents(before, cloud)
        if parents is None or not 0 <= particle < len(parents):
            return None
        particle = int(parents[particle])
    return particle if particle >= 0 else None


def find_heir(particle: int, clouds: Sequence[likelihood.Cloud | None]) -> int | None:
    """Return the heir in the last cloud of a particle in the first; None if its line has ended."""
    for before, cloud in pairwise(clouds):
        parents = _parents(before, cloud)
        if cloud is None or parents is None:
            return None
        children = np.flatnonzero(parents == particle)
        if not len(children):
            return None
        particle = int(children[cloud.log_weights[children].argmax()])
    return particle


def known_parents(clouds: Sequence[likelihood.Cloud | None]) -> list[Ints]:
    """Return the parents of the particles in the last clouds, as far back as all are known.

    The first cloud is left out, because its parents are not among the clouds.
    """
    pairs = zip(clouds[-2::-1], clouds[:0:-1], strict=True)
    return _until_unknown(pairs)[::-1]


def parents_onward(clouds: Sequence[likelihood.Cloud | None]) -> list[Ints]:
    """Return the parents of the particles in the clouds after the first, as far on as all are known."""
    return _until_unknown(pairwise(clouds))


def _until_unknown(pairs: Iterable[tuple[likelihood.Cloud | None, likelihood.Cloud | None]]) -> list[Ints]:
    found: list[Ints] = []
    for before, cloud in pairs:
        parents = _parents(before, cloud)
        if parents is None:
            break
        found.append(parents)
    return found


def _parents(before: likelihood.Cloud | None, cloud: likelihood.Cloud | None) -> Ints | None:
    """Return the parents of particles in the frame before; None if its particles are of other filters."""
    if cloud is None or cloud.ancestors is None or before is None or cloud.filters != before.filters:
        return None
    return None if cloud.ancestors.max(initial=0) >= len(before) else cloud.ancestors


GENERATIONS = 30
"""Number of frames through which particles are followed, backwards and forwards."""
KEPT_BYTES = 32 * 1024 * 1024
"""Memory for the kept clouds of earlier frames."""


@with_config(ConfigDict(arbitrary_types_allowed=True))
@dataclass(frozen=True, slots=True)
class ParticleFinding:
    """Numbers of one particle.

    Attributes:
        particle: Index in the cloud.
        filter: Filter of the particle, to which the next numbers refer; empty if there is only one.
        number: Index among the particles of that filter.
        count: Number of particles of that filter.
        weight: Normalised weight within that filter, 0..1.
        rank: Rank by weight; the heaviest is 1.
        sampler: Proposal that drew it; empty if there is only one.
        ancestors: Indices of its parent in the frame before, of the parent of that, and so on, as far as known.
        begins: Frame in which the oldest ancestor, or the particle itself, was drawn without a parent; None if that is
            further back.
        path: (A + 1, 2) places of the particle and its ancestors, px; empty if states have no place.
        descendants: Number of descendants in each later frame, as far as computed.
    """

    particle: int
    filter: str
    number: int
    count: int
    weight: float
    rank: int
    sampler: str
    ancestors: tuple[int, ...]
    begins: int | None
    path: Annotated[Floats, Field(exclude=True)]
    descendants: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Course:
    """A number with a limit over the last frames, such as the normalised innovation squared.

    Attributes:
        title: Title of the number.
        limit: Upper limit.
        first: The first frame.
        values: Values from the first frame on; NaN where missing.
    """

    title: str
    limit: float
    first: int
    values: tuple[Known, ...]


@dataclass(frozen=True, slots=True)
class Finding:
    """The likelihood of one state in the current frame.

    Attributes:
        place: (2,) place in the picture, px; None if the state has none.
        title: Title of the likelihood.
        log_likelihood: Its value with the parameters in force; None for a tracker without this function.
        parts: Parts of the likelihood.
        state: Coordinates of the state with their values.
        particle: Numbers of the particle, if the state is one.
    """

    place: Floats | None
    title: str
    log_likelihood: float | None
    parts: tuple[likelihood.Part, ...]
    state: tuple[tuple[likelihood.Component, float], ...]
    particle: ParticleFinding | None = None


class Inspection:
    """The inspection of a run at its current frame."""

    def __init__(self, run: Run) -> None:
        """Begin with the current frame of a run."""
        self.run = run
        self._steps: dict[int, Step] = {}
        self._clouds: dict[int, likelihood.Cloud | None] = {}

    @property
    def tracker(self) -> Tracker:
        """The tracker of the frame."""
        return self.run.experiment.trackers[self.run.current.tracker]

    @property
    def parameters(self) -> Any:  # noqa: ANN401 - the experiment's own model
        """Parameters of the next frame, which show the effect of a change on the current one."""
        return self.run.parameters_at(self.run.position + 1)

    @property
    def cloud(self) -> likelihood.Cloud | None:
        """The particles of the frame."""
        return _cloud(self.run, self.run.current)

    @property
    def before(self) -> Any:  # noqa: ANN401 - the state of any family
        """State of the frame before with its moves; in frame 0 that of frame 0 itself."""
        index, current = max(self.run.position - 1, 0), self.run.current
        self._steps = {at: step for at, step in self._steps.items() if at == index} | {self.run.position: current}
        if index not in self._steps:
            (self._steps[index],) = self.run.replay(index, index)
        step, moves = self._steps[index], self.run.timeline.moves_at(self.run.position)
        return self.run.experiment.trackers[step.tracker].moved(step.state, moves)

    def at_place(self, place: Floats) -> Finding:
        """Return the likelihood of the estimate moved to another place (2,), px.

        Raises:
            ParameterError: The tracker has no likelihood of places.
        """
        model = self.tracker.model
        if model is None or not model.has_place:
            raise ParameterError("place", place.tolist(), "left out: the tracker has no likelihood of places")
        known = self._known(model)
        (state,) = model.put(model.centre(self.run.current.state), place[None], known)
        return self._ask(model, known, state, place)

    def at_estimate(self) -> Finding:
        """Return the likelihood of the estimate."""
        model = self.tracker.model
        if model is None or not model.title:
            return Finding(None, "", None, (), ())
        known = self._known(model)
        state = model.centre(self.run.current.state)
        return self._ask(model, known, state, self._place(model, known, state))

    def at_particle(self, particle: int) -> Finding:
        """Return likelihood and numbers of a particle of the frame.

        Raises:
            ParameterError: The particle does not exist.
        """
        cloud, model = self.cloud, self.tracker.model
        if cloud is None or model is None or not 0 <= particle < len(cloud):
            count = 0 if cloud is None else len(cloud)
            raise ParameterError("particle", particle, f"below {count}, the number of particles in this frame")
        own, state = self._particle(cloud, particle, model), cloud.states[particle]
        if not model.title or cloud.components:
            place = None if cloud.places is None else cloud.places[particle]
            named = tuple(zip(cloud.components, state.tolist(), strict=False))
            said = None if cloud.log_likelihoods is None else float(cloud.log_likelihoods[particle])
            title = "" if said is None else model.title
            return Finding(place, title, said, (), named, own)
        known = self._known(model)
        return self._ask(model, known, state, self._place(model, known, state), own)

    def update_parts(self) -> tuple[likelihood.Part, ...]:
        """Return the parts of the tracker's step in this frame, with the values used."""
        step, model = self.run.current, self.tracker.model
        return () if model is None else model.update_parts(self.before, step.state, step.frame, step.parameters)

    def courses(self) -> tuple[Course, ...]:
        """Return the tracker's series that have a limit, over the last frames."""
        known = {one.role: one for one in self.tracker.series}
        if "nis" not in known or "nis_limit" not in known:
            return ()
        first = max(self.run.position - GENERATIONS + 1, 0)
        rows = self.run.diagnostics[first : self.run.position + 1]
        values, limits = ([row.number(known[role].name) for row in rows] for role in ("nis", "nis_limit"))
        limit = next((one for one in reversed(limits) if not math.isnan(one)), math.nan)
        return () if math.isnan(limit) else (Course(known["nis"].title, limit, first, tuple(values)),)

    def nearest(self, place: Floats) -> int | None:
        """Return the particle nearest to a place (2,), px, or the heaviest of equally near ones.

        Without places it is the heaviest of all; without particles it is None.
        """
        cloud, model = self.cloud, self.tracker.model
        if cloud is None or model is None:
            return None
        places = cloud.places
        if not cloud.components and model.has_place:
            places = model.place(cloud.states, self._known(model))
        if places is None:
            return int(cloud.log_weights.argmax())
        off = np.square(places - place).sum(axis=1)
        near = np.flatnonzero(off <= np.nanmin(off))
        return int(near[cloud.log_weights[near].argmax()]) if len(near) else None

    def map(self, size: tuple[int, int]) -> likelihood.LikelihoodMap | None:
        """Return the likelihood over a picture of this width and height, px; None for a tracker without one."""
        model = self.tracker.model
        if model is None or not model.has_place:
            return None
        step = self.run.current
        return model.map(self.before, step.state, step.frame, self.parameters, size)

    def genealogy(self, particle: int | None = None) -> likelihood.Genealogy | None:
        """Return the known ancestors of the frame's particles; None without particles.

        Args:
            particle: One particle, to choose its filter where there are several.
        """
        cloud = self.cloud
        if cloud is None or cloud.ancestors is None:
            return None
        among = slice(None) if particle is None else cloud.siblings(particle)
        return likelihood.trace(self.run.position, known_parents(self._past(GENERATIONS)), len(cloud), among)

    def follow(self, particle: int, frame: int) -> int | None:
        """Return the ancestor or heir in the current frame of a particle of another frame.

        An heir is the heaviest child of the heaviest child, and so on. The result is None without children, or if the
        frames are too far apart.
        """
        position = self.run.position
        if abs(position - frame) >= GENERATIONS:
            return None
        clouds = self._window(min(frame, position), max(frame, position))
        return find_ancestor(particle, clouds) if position <= frame else find_heir(particle, clouds)

    def _particle(self, cloud: likelihood.Cloud, particle: int, model: Model) -> ParticleFinding:
        past = self._past(GENERATIONS)
        known = known_parents(past)
        lineage = likelihood.trace(self.run.position, known, len(cloud)).places[::-1, particle]
        lineage = lineage[lineage >= 0]
        first = self.run.position + 1 - len(lineage)
        line = [(each, at) for each, at in zip(reversed(past), lineage, strict=False) if each is not None]
        path = np.array([each.places[at] for each, at in line if each.places is not None]).reshape(-1, 2)
        if not cloud.components and model.has_place:
            path = model.place(np.stack([each.states[at] for each, at in line]), self._known(model))
        last = min(self.run.computed, self.run.position + GENERATIONS - 1)
        following = self._window(self.run.position, last)
        siblings = cloud.siblings(particle)
        return ParticleFinding(
            particle,
            cloud.filter(particle),
            particle - siblings.start,
            siblings.stop - siblings.start,
            float(np.exp(cloud.log_weights[particle])),
            cloud.rank(particle),
            cloud.sampler(particle),
            tuple(lineage[1:].tolist()),
            first if len(lineage) <= len(known) else None,
            path,
            tuple(likelihood.count_descendants(particle, parents_onward(following))),
        )

    def _ask(
        self,
        model: Model,
        known: State,
        state: Floats,
        place: Floats | None,
        particle: ParticleFinding | None = None,
    ) -> Finding:
        frame, parameters = self.run.current.frame, self.parameters
        (number,) = model.log_likelihood(state[None], frame, parameters, known)
        return Finding(
            place,
            model.title,
            -np.inf if np.isnan(number) else float(number),
            model.parts(state, frame, parameters, known),
            tuple(zip(model.components(parameters), state.tolist(), strict=True)),
            particle,
        )

    def _known(self, model: Model) -> State:
        return model.prepare(self.before, self.run.current.frame, self.parameters)

    def _place(self, model: Model, known: State, state: Floats) -> Floats | None:
        return model.place(state[None], known)[0] if model.has_place else None

    def _past(self, count: int) -> list[likelihood.Cloud | None]:
        """Return the clouds of at most `count` frames up to the current one."""
        current = _kept(self.run, self.run.current)
        size = 0 if current is None else _bytes(current)
        kept = min(count, max(2, KEPT_BYTES // max(size, 1)))
        return self._window(max(self.run.position - kept + 1, 0), self.run.position)

    def _window(self, first: int, last: int) -> list[likelihood.Cloud | None]:
        position = self.run.position
        self._clouds = {index: cloud for index, cloud in self._clouds.items() if abs(index - position) < GENERATIONS}
        self._clouds[position] = _kept(self.run, self.run.current)
        missing = [index for index in range(first, last + 1) if index not in self._clouds]
        if missing:
            for step in self.run.replay(missing[0], missing[-1]):
                if step.frame.index == position - 1:
                    self._steps[step.frame.index] = step
                if step.frame.index not in self._clouds:
                    self._clouds[step.frame.index] = _kept(self.run, step)
        return [self._clouds[index] for index in range(first, last + 1)]


def _cloud(run: Run, step: Step) -> likelihood.Cloud | None:
    return run.experiment.trackers[step.tracker].cloud(step.state)


def _kept(run: Run, step: Step) -> likelihood.Cloud | None:
    """Return the part of a step's cloud that paths and genealogies need, without the rest of the state."""
    cloud = _cloud(run, step)
    if cloud is None:
        return None
    # Particles with coordinates of their own are found by their places.
    states = cloud.states[:, :0] if cloud.components else cloud.states
    return replace(cloud, states=states.copy(), log_likelihoods=None)


def _bytes(cloud: likelihood.Cloud) -> int:
    arrays = (cloud.states, cloud.log_weights, cloud.ancestors, cloud.places)
    return sum(array.nbytes for array in arrays if array is not None)
