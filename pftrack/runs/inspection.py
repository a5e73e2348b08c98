"""Looking into a run: what a likelihood says at a place of the frame that is shown, and what became of a particle.

A run keeps states now and then only (`pftrack.runs.recursion`). To follow particles back, the steps of the last frames
are taken again once, and what is asked of their particles is kept while one looks: of a state with very many particles
that is a small part. The run stands where it is.
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

# Each cloud knows the places of its particles' parents in the cloud before. A frame without particles, or with those of
# other filters, or one whose parents are not known, ends all lines.


def find_ancestor(particle: int, clouds: Sequence[likelihood.Cloud | None]) -> int | None:
    """Return what a particle of the last of some clouds was in the first; None if its line began in between."""
    for before, cloud in zip(clouds[-2::-1], clouds[:0:-1], strict=True):
        parents = _parents(before, cloud)
        if parents is None or not 0 <= particle < len(parents):
            return None
        particle = int(parents[particle])
    return particle if particle >= 0 else None


def find_heir(particle: int, clouds: Sequence[likelihood.Cloud | None]) -> int | None:
    """Return what has become of a particle of the first of some clouds in the last; None if its line has ended."""
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
    """Return the parents of the particles of clouds that end with the last one, as far back as all are known.

    Those of the first cloud are left out: their parents are not among the clouds.
    """
    pairs = zip(clouds[-2::-1], clouds[:0:-1], strict=True)
    return _until_unknown(pairs)[::-1]


def parents_onward(clouds: Sequence[likelihood.Cloud | None]) -> list[Ints]:
    """Return the parents of the particles of clouds after the first one, as far on as all are known."""
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
    """Return the parents of particles among those of the frame before; None if these are of other filters."""
    if cloud is None or cloud.ancestors is None or before is None or cloud.filters != before.filters:
        return None
    return None if cloud.ancestors.max(initial=0) >= len(before) else cloud.ancestors


GENERATIONS = 30
"""So many frames back particles are followed, and as many on."""
KEPT_BYTES = 32 * 1024 * 1024
"""That the clouds of earlier frames may take which are kept while one looks."""


@with_config(ConfigDict(arbitrary_types_allowed=True))
@dataclass(frozen=True, slots=True)
class ParticleFinding:
    """What there is to say of one particle.

    Attributes:
        particle: Its place in the cloud.
        filter: The filter that has drawn it, where there are several; all numbers are of that one. Else empty.
        number: Its place among the particles of that filter.
        count: How many these are.
        weight: Of them all, 0..1.
        rank: The heaviest is 1.
        sampler: What has drawn it; empty where nothing is to choose from.
        ancestors: Its parent in the frame before, the parent of that, and so on, as far as they are known.
        begins: The frame in which the oldest of them, or it itself, was drawn without a parent; None where that is not
            so far back.
        path: (A + 1, 2) where it is, and where its ancestors were, px; empty where states have no place.
        descendants: How many it has in each of the frames after, as far as they were computed.
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
        title: What it is.
        limit: What it should not be above.
        first: The first frame.
        values: Of the frames from there on; NaN where there is none.
    """

    title: str
    limit: float
    first: int
    values: tuple[Known, ...]


@dataclass(frozen=True, slots=True)
class Finding:
    """What is found at one state of the frame that is shown.

    Attributes:
        place: (2,) where it is in the picture, px; None if it has no place.
        title: What the likelihood compares.
        log_likelihood: What it says, with the values that are in force; None for a tracker that cannot be asked.
        parts: What that is made of.
        state: The coordinates of the state, and their values.
        particle: What there is to say of the particle, if it is one.
    """

    place: Floats | None
    title: str
    log_likelihood: float | None
    parts: tuple[likelihood.Part, ...]
    state: tuple[tuple[likelihood.Component, float], ...]
    particle: ParticleFinding | None = None


class Inspection:
    """A run that is looked into, at the frame at which it stands."""

    def __init__(self, run: Run) -> None:
        """Begin to look."""
        self.run = run
        self._steps: dict[int, Step] = {}
        self._clouds: dict[int, likelihood.Cloud | None] = {}

    @property
    def tracker(self) -> Tracker:
        """The tracker of the frame."""
        return self.run.experiment.trackers[self.run.current.tracker]

    @property
    def parameters(self) -> Any:  # noqa: ANN401 - the experiment's own model
        """The values in force: those that the next frame has, so that one sees what a change would make of this one."""
        return self.run.parameters_at(self.run.position + 1)

    @property
    def cloud(self) -> likelihood.Cloud | None:
        """The particles of the frame."""
        return _cloud(self.run, self.run.current)

    @property
    def before(self) -> Any:  # noqa: ANN401 - the state of any family
        """The state of the frame before, after what was moved in it; of frame 0 that of frame 0 itself."""
        index, current = max(self.run.position - 1, 0), self.run.current
        self._steps = {at: step for at, step in self._steps.items() if at == index} | {self.run.position: current}
        if index not in self._steps:
            (self._steps[index],) = self.run.replay(index, index)
        step, moves = self._steps[index], self.run.timeline.moves_at(self.run.position)
        return self.run.experiment.trackers[step.tracker].moved(step.state, moves)

    def at_place(self, place: Floats) -> Finding:
        """Return what the likelihood says of the state that is like the estimate in all but the place (2,), px.

        Raises:
            ParameterError: The tracker cannot be asked at places.
        """
        model = self.tracker.model
        if model is None or not model.has_place:
            raise ParameterError("place", place.tolist(), "left out: the tracker has no likelihood of places")
        known = self._known(model)
        (state,) = model.put(model.centre(self.run.current.state), place[None], known)
        return self._ask(model, known, state, place)

    def at_estimate(self) -> Finding:
        """Return what the likelihood says of the estimate."""
        model = self.tracker.model
        if model is None or not model.title:
            return Finding(None, "", None, (), ())
        known = self._known(model)
        state = model.centre(self.run.current.state)
        return self._ask(model, known, state, self._place(model, known, state))

    def at_particle(self, particle: int) -> Finding:
        """Return what there is to say of a particle of the frame.

        Raises:
            ParameterError: There is no such particle.
        """
        cloud, model = self.cloud, self.tracker.model
        if cloud is None or model is None or not 0 <= particle < len(cloud):
            count = 0 if cloud is None else len(cloud)
            raise ParameterError("particle", particle, f"a particle of the frame, of which there are {count}")
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
        """Return what the tracker's step of the frame was made of, with the values that it was taken with."""
        step, model = self.run.current, self.tracker.model
        return () if model is None else model.update_parts(self.before, step.state, step.frame, step.parameters)

    def courses(self) -> tuple[Course, ...]:
        """Return what the tracker tells of every frame and has a limit, over the last frames."""
        known = {one.role: one for one in self.tracker.series}
        if "nis" not in known or "nis_limit" not in known:
            return ()
        first = max(self.run.position - GENERATIONS + 1, 0)
        rows = self.run.diagnostics[first : self.run.position + 1]
        values, limits = ([row.number(known[role].name) for row in rows] for role in ("nis", "nis_limit"))
        limit = next((one for one in reversed(limits) if not math.isnan(one)), math.nan)
        return () if math.isnan(limit) else (Course(known["nis"].title, limit, first, tuple(values)),)

    def nearest(self, place: Floats) -> int | None:
        """Return the particle that is nearest to a place (2,), px; of those as near, the heaviest.

        Of particles that have no place it is the heaviest of all; None where there are no particles.
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
        """Return the likelihood all over a picture of a width and height, px; None of a tracker that has none."""
        model = self.tracker.model
        if model is None or not model.has_place:
            return None
        step = self.run.current
        return model.map(self.before, step.state, step.frame, self.parameters, size)

    def genealogy(self, particle: int | None = None) -> likelihood.Genealogy | None:
        """Return the ancestors of the frame's particles as far back as they are known; None without.

        Args:
            particle: One of them, if only its own filter's are wanted, where there are several.
        """
        cloud = self.cloud
        if cloud is None or cloud.ancestors is None:
            return None
        among = slice(None) if particle is None else cloud.siblings(particle)
        return likelihood.trace(self.run.position, known_parents(self._past(GENERATIONS)), len(cloud), among)

    def follow(self, particle: int, frame: int) -> int | None:
        """Return what a particle of another frame is in the frame that is shown: its ancestor, or its heaviest child.

        Further frames on, the heaviest child of that one, and so on. None if it has no children, or if the frames are
        too far apart.
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
        """Return the clouds of the last frames up to the one that is shown, at most so many."""
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
    """Return of a step's cloud what paths and genealogies need, without the rest of the state."""
    cloud = _cloud(run, step)
    if cloud is None:
        return None
    # Particles of coordinates of their own are found by their places.
    states = cloud.states[:, :0] if cloud.components else cloud.states
    return replace(cloud, states=states.copy(), log_likelihoods=None)


def _bytes(cloud: likelihood.Cloud) -> int:
    arrays = (cloud.states, cloud.log_weights, cloud.ancestors, cloud.places)
    return sum(array.nbytes for array in arrays if array is not None)
