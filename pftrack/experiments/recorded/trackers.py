"""The tracker of recorded beliefs.

A step of the tracker of recorded beliefs looks at its frame alone, but for the paths by which the particles came, which
their ancestors tell. Weights are made to sum to one, mean and covariance come from the particles where they were not
recorded, and effective sample size and different parents are counted as of any particle filter.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.likelihood import Cloud
from pftrack.core.model.model import Model
from pftrack.core.model.parameters import Parameters
from pftrack.core.model.series import Series, SeriesValue
from pftrack.core.model.source import Belief, Beliefs, Frame, Target
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.random import Generator
from pftrack.experiments.shared.reports import CLOUD
from pftrack.filters.fixed_lag import Lineage, begin_lineage, extend_lineage
from pftrack.filters.particles import ParticleSet, normalise

PATH_FRAMES = 30
"""So far back the ancestors of particles are followed."""

BOX = Series("box", "believed box", "px", "vector", role="extent", components=("width", "height"))
SCORE = Series("score", "score of the box")
ACROSS, DOWN = Series("across", "first component"), Series("down", "second component")
ACROSS_SD, DOWN_SD = Series("across_sd", "deviation of the first"), Series("down_sd", "deviation of the second")
TARGETS = Series("targets", "targets in the frame")


@dataclass(frozen=True, eq=False)
class BeliefState:
    """What was recorded of a frame, immutable.

    Attributes:
        beliefs: Of all targets.
        particles: Of the selected one, with weights that sum to one; None without.
        estimate: (tracked,) the chosen components of its mean, or the middle of its box.
        covariance: (tracked, tracked) of these; None where it is not known.
        paths: Where the particles' ancestors were in the frames before; None without ancestors.
    """

    beliefs: Beliefs
    particles: ParticleSet | None
    estimate: Floats
    covariance: Floats | None
    paths: Lineage | None = None

    @property
    def sigma(self) -> Floats:
        """(tracked,) standard deviations; NaN where they are not known."""
        if self.covariance is None:
            return np.full(len(self.estimate), np.nan)
        return np.asarray(np.sqrt(np.maximum(self.covariance.diagonal(), 0.0)))

    @property
    def log_evidence(self) -> float:
        """Nothing is known of it: 0."""
        return 0.0

    @property
    def nbytes(self) -> int:
        """About how much memory it takes, bytes."""
        held = [self.beliefs.selected, *self.beliefs.others]
        paths = 0 if self.paths is None else self.paths.paths.nbytes
        return 4096 + paths + sum(3 * one.particles.nbytes for one in held if one.particles is not None)

    def arrays(self) -> Mapping[str, Floats]:
        """Return states and log weights of the particles; empty without."""
        if self.particles is None:
            return {}
        return {"states": self.particles.states, "log_weights": self.particles.log_weights}


def place_of(belief: Belief, components: tuple[int, ...]) -> Floats:
    """Return the chosen components of what is believed in the mean, (tracked,); NaN where nothing is."""
    mean = belief.mean
    if mean is None and belief.particles is not None:
        mean = _set_of(belief).mean
    if mean is not None and max(components) < len(mean):
        return mean[list(components)]
    if belief.centre is not None:
        return belief.centre[list(components)] if max(components) < 2 else belief.centre
    return np.full(len(components), np.nan)


def _set_of(belief: Belief) -> ParticleSet:
    states = belief.particles
    if states is None:
        raise ValueError("a set of particles needs particles, got a belief without")
    weights = np.zeros(len(states)) if belief.log_weights is None else belief.log_weights
    ancestors = np.arange(len(states)) if belief.ancestors is None else np.maximum(belief.ancestors, 0)
    return ParticleSet(states, normalise(weights)[0], ancestors)


def step(state: BeliefState | None, frame: Frame, parameters: Parameters, rng: Generator) -> BeliefState:
    """Take over what was recorded of the frame."""
    del parameters, rng
    beliefs = frame.beliefs
    if beliefs is None:
        raise ValueError("a recorded tracker needs a recording of beliefs, got pictures or measurements")
    selected, components = beliefs.selected, beliefs.components
    particles = None if selected.particles is None else _set_of(selected)
    estimate = particles.mean[list(components)] if particles is not None else place_of(selected, components)
    if selected.mean is not None:
        estimate = selected.mean[list(components)]
    chosen = np.ix_(components, components)
    covariance = None if particles is None else particles.covariance[chosen]
    if selected.covariance is not None:
        covariance = selected.covariance[chosen]
    return BeliefState(beliefs, particles, estimate, covariance, _paths(state, beliefs, particles))


def _paths(before: BeliefState | None, beliefs: Beliefs, particles: ParticleSet | None) -> Lineage | None:
    """Return the pasts of the particles, as far as every frame since has said their ancestors."""
    if not beliefs.present:
        return None if before is None else before.paths
    if particles is None or beliefs.selected.ancestors is None:
        return None
    tracked = len(beliefs.components)
    places = ParticleSet(particles.states[:, list(beliefs.components)], particles.log_weights, particles.ancestors)
    known = None if before is None else before.paths
    if known is None or particles.ancestors.max() >= known.paths.shape[1]:
        return begin_lineage(places, tracked)
    return extend_lineage(known, places, PATH_FRAMES)


def start(target: Target, frame: Frame, parameters: Parameters, rng: Generator) -> BeliefState:
    """Take over what was recorded of frame 0."""
    del target
    return step(None, frame, parameters, rng)


def measure(state: BeliefState) -> Mapping[str, SeriesValue]:
    """Report what there is: the components that are looked at, the particles, the box, and how many targets."""
    beliefs, belief = state.beliefs, state.beliefs.selected
    sigma = state.sigma
    found: dict[str, SeriesValue] = {
        ACROSS.name: float(state.estimate[0]),
        TARGETS.name: float(len(beliefs.others) + beliefs.present),
    }
    if len(state.estimate) > 1:
        found[DOWN.name] = float(state.estimate[1])
    if state.covariance is not None:
        found[ACROSS_SD.name] = float(sigma[0])
        if len(sigma) > 1:
            found[DOWN_SD.name] = float(sigma[1])
    if state.particles is not None:
        found |= {"ess": state.particles.effective_sample_size, "particles": float(len(state.particles))}
        if belief.ancestors is not None:
            found["unique_ancestors"] = float(state.particles.unique_ancestors)
            found["resampled"] = float(not np.array_equal(belief.ancestors, np.arange(len(belief.ancestors))))
    if belief.box is not None:
        found[BOX.name] = tuple(belief.box[2:].tolist())
        if np.isfinite(belief.score):
            found[SCORE.name] = belief.score
    return found


class Recorded(Model):
    """What was recorded says nothing of a model, but its particles can be looked into."""

    def cloud(self, state: BeliefState) -> Cloud | None:
        """Return the particles as they were recorded; their parents only where these were."""
        particles = state.particles
        if particles is None:
            return None
        ancestors = particles.ancestors if state.beliefs.selected.ancestors is not None else None
        return Cloud(particles.states, particles.log_weights, ancestors)


def _is_absent(state: BeliefState) -> bool:
    return not state.beliefs.present


TRACKERS: dict[str, Tracker] = {
    "recorded": Tracker(
        "recorded",
        "As recorded",
        "Takes over what was recorded: whatever filter, tracker or person has said it.",
        start,
        step,
        series=(*CLOUD, BOX, SCORE, ACROSS, DOWN, ACROSS_SD, DOWN_SD, TARGETS),
        measure=measure,
        searching=_is_absent,
        model=Recorded(),
        replays=True,
    )
}
"""The one tracker of recorded beliefs."""
