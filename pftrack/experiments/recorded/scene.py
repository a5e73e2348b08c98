"""The frames of a recording of beliefs, a synthetic example, and the tracker that returns the recorded beliefs.

Nothing is left to compute but moments. The example is two discs that pass each other, and beliefs in both. The beliefs
do not come from a tracker. The particles of a disc lie around its centre plus a random error, with a spread equal to
the error's standard deviation, so their uncertainty is right, and can be checked. Where the discs meet, their numbers
may be confused, as by trackers of several targets.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.geometry import paint_disc
from pftrack.core.model.likelihood import Cloud
from pftrack.core.model.model import Model
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.series import SeriesValue
from pftrack.core.model.source import Belief, Beliefs, Frame, History, Plane, Target
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.random import Generator, Purpose, Stream
from pftrack.core.refusal import ParameterError
from pftrack.experiments.declared import read_reported
from pftrack.experiments.shared.reports import CLOUD
from pftrack.filters.particles import ParticleSet, normalise
from pftrack.sources.beliefs.content import Content, SelectionParameters
from pftrack.sources.beliefs.sequence import BeliefSequence

SPREAD_FRAMES = 500
"""Largest number of frames used for the spread of the true places."""


# The assignment of a tracker's numbers to true targets follows CLEAR MOT (Bernardin and Stiefelhagen 2008): a pair of
# the frame before stays together while its boxes overlap by half; the rest is paired, the greatest overlap first (they
# take the greatest sum, which differs only where three boxes overlap each other by half). A true target that gets
# another number than the last one it had is an identity switch. Without boxes, the distance of positions replaces the
# overlap.

LEAST_OVERLAP = 0.5


def overlap(one: Floats, other: Floats) -> float:
    """Return the intersection over the union of two boxes (x, y, w, h)."""
    low, high = np.maximum(one[:2], other[:2]), np.minimum(one[:2] + one[2:], other[:2] + other[2:])
    shared = float(np.maximum(high - low, 0.0).prod())
    return shared / float(one[2:].prod() + other[2:].prod() - shared)


@dataclass(frozen=True, slots=True)
class Identities:
    """The assignment of the numbers.

    Attributes:
        pairs: For each frame with both a belief and a truth, the true target of each number.
        switches: Number of true targets whose number has changed, by frame.
        first: The true target that each number stood for first.
    """

    pairs: Mapping[int, Mapping[int, int]]
    switches: Mapping[int, int]
    first: Mapping[int, int]


def pair_up(frames: Sequence[tuple[int, Sequence[Belief], Sequence[Belief]]]) -> Identities:
    """Pair numbers with true targets through all frames.

    Args:
        frames: Number of the frame, beliefs in its targets, and their truths; by ascending number.
    """
    pairs: dict[int, dict[int, int]] = {}
    switches: dict[int, int] = {}
    first: dict[int, int] = {}
    before: dict[int, int] = {}  # the last number of each true target
    last: dict[int, int] = {}  # pairs of the frame before
    for frame, beliefs, truths in frames:
        gains = np.array([[_likeness(one, true) for true in truths] for one in beliefs])
        gains = gains.reshape(len(beliefs), len(truths))
        numbers, trues = [one.target for one in beliefs], [true.target for true in truths]
        found = {
            number: true
            for number, true in last.items()
            if number in numbers and true in trues and gains[numbers.index(number), trues.index(true)] >= LEAST_OVERLAP
        }
        rows = [place for place, number in enumerate(numbers) if number not in found]
        columns = [place for place, true in enumerate(trues) if true not in found.values()]
        ranked = sorted((-float(gains[row, column]), row, column) for row in rows for column in columns)
        for loss, row, column in ranked:
            if -loss >= LEAST_OVERLAP and numbers[row] not in found and trues[column] not in found.values():
                found[numbers[row]] = trues[column]
        changed = sum(before.get(true, number) != number for number, true in found.items())
        if changed:
            switches[frame] = changed
        for number, true in found.items():
            before[true] = number
            first.setdefault(number, true)
        pairs[frame] = last = found
    return Identities(pairs, switches, first)


def _likeness(one: Belief, true: Belief) -> float:
    """Return the overlap of a belief with a truth, 0 to 1; with positions alone there is only one target."""
    if one.box is not None and true.box is not None:
        return overlap(one.box, true.box)
    return float(one.target == true.target)


class RecordedBeliefs:
    """The frames of a recording of beliefs, from a chosen one on.

    Attributes:
        size: Width and height of the picture, or of the paper, px.
        frame_rate_hz: Frames a second.
        frame_count: Frames from the chosen one to the end.
        start: The truth of the first frame, or else the belief there.
        noisy: The frames do not depend on the seed.
    """

    noisy = False

    def __init__(
        self,
        sequence: BeliefSequence,
        parameters: SelectionParameters,
        first: int = 0,
        truth: Callable[[int], Target | None] | None = None,
    ) -> None:
        """Wire a recording up.

        Args:
            sequence: The recording.
            parameters: The shown target and components.
            first: Number of the first frame that is used.
            truth: True place of the target, by number of the frame; by default that of the file.
        """
        self._sequence, self._first, self._truth = sequence, first, truth
        content = sequence.content
        self._selected = _selected(content, parameters.selected_target)
        self._components = _components(content, parameters)
        self._plane = sequence.plane(self._components)
        self._frames = np.array(sorted(content.targets.get(self._selected, [])), dtype=np.int64)
        self._times_s = sequence.times_s[first:] - sequence.times_s[first]
        self.size, self.frame_rate_hz = sequence.size, sequence.frame_rate_hz
        self.frame_count: int | None = sequence.frame_count - first
        self.start = self._target(self._number(0)) or Target(np.zeros(len(self._components)), hidden=None)

    def frame(self, index: int, history: History[Parameters]) -> Frame:
        """Return the beliefs of a frame; the same arguments give the same frame, to the bit."""
        del history
        number = self._number(index)
        content = self._sequence.content
        known, present = self._known(number)
        others = (target for target in content.targets_in(number) if target != self._selected)
        beliefs = Beliefs(
            content.belief(known, self._selected),
            present,
            tuple(content.belief(number, target) for target in others),
            tuple(content.truth(number, target) for target in content.true_targets_in(number)),
            self._identities.switches.get(number, 0),
            self._components,
            content.about.components,
            self._plane,
        )
        shown = self._sequence.picture(self._first + index) if self._sequence.has_pictures else None
        return Frame(index, float(self._times_s[index]), image_rgb=shown, target=self._target(number), beliefs=beliefs)

    def true_spread(self) -> float:
        """Return the root mean square distance of the true places from the middle of their path, in the states' unit.

        Who stays at that middle is wrong by so much (Nash and Sutcliffe 1970 measure skill by it). It is 0 where a
        truth has a box, which is a better tolerance, and where none moves.
        """
        frames = np.unique(np.linspace(0, (self.frame_count or 1) - 1, SPREAD_FRAMES).astype(np.int64)).tolist()
        paths: dict[int, list[Floats]] = {}
        for target, found in (each for frame in frames for each in self._true_targets(self._number(frame))):
            if found.extent is not None:
                return 0.0
            paths.setdefault(target, []).append(found.position)
        offsets = [np.array(path) - np.mean(path, axis=0) for path in paths.values()]
        return float(np.sqrt(np.square(np.concatenate(offsets)).sum(axis=1).mean())) if offsets else 0.0

    def _true_targets(self, number: int) -> Iterator[tuple[int, Target]]:
        """Yield what is true of any target in a frame."""
        if self._truth is not None:
            found = self._truth(number - self._sequence.first)
            if found is not None:
                yield self._selected, found
            return
        content = self._sequence.content
        for target in content.true_targets_in(number):
            found = target_of(content.truth(number, target), self._components)
            if found is not None:
                yield target, found

    def _number(self, index: int) -> int:
        """Return the number in the file of a frame of the run."""
        return self._sequence.first + self._first + index

    def _known(self, number: int) -> tuple[int, bool]:
        """Return the frame whose belief in the selected target is used for a frame, and whether it is that frame."""
        place = int(np.searchsorted(self._frames, number, side="right"))
        known = int(self._frames[max(place - 1, 0)])
        return known, known == number

    def _target(self, number: int) -> Target | None:
        """Return the truth of the selected target."""
        if self._truth is not None:
            return self._truth(number - self._sequence.first)
        content = self._sequence.content
        true = self._identities.first.get(self._selected)
        if true is None or true not in content.true_targets_in(number):
            return None
        return target_of(content.truth(number, true), self._components)

    @cached_property
    def _identities(self) -> Identities:
        content = self._sequence.content
        if not content.has_truth:
            return Identities({}, {}, {})
        frames = (number for number in range(content.first, content.last + 1) if content.true_targets_in(number))
        return pair_up(
            [
                (
                    number,
                    [content.belief(number, target) for target in content.targets_in(number)],
                    [content.truth(number, target) for target in content.true_targets_in(number)],
                )
                for number in frames
            ]
        )


def target_of(truth: Belief, components: tuple[int, ...]) -> Target | None:
    """Return the target that a truth means, with a position of these components; None if that is not known."""
    place: Floats | None = None
    if truth.mean is not None and max(components) < len(truth.mean):
        place = truth.mean[list(components)]
    if (place is None or not np.isfinite(place).all()) and truth.centre is not None and components == (0, 1):
        place = truth.centre
    if place is None or not np.isfinite(place).all():
        return None
    if truth.box is None:
        return Target(place, hidden=None)
    width, height = truth.box[2:].tolist()
    return Target(place, size=max(width, height), extent=(width, height))


def _selected(content: Content, wanted: int) -> int:
    if not content.targets:
        raise ParameterError("selected_target", wanted, "left out: nothing but truth is in the file")
    if wanted == -1:
        return max(content.targets, key=lambda target: (len(content.targets[target]), -target))
    if wanted not in content.targets:
        known = ", ".join(str(target) for target in sorted(content.targets)[:20])
        raise ParameterError("selected_target", wanted, f"-1 or one of the file's, such as {known}")
    return wanted


def _components(content: Content, parameters: SelectionParameters) -> tuple[int, ...]:
    if not content.has_states:
        return 0, 1
    if content.dimension == 1:
        return (0,)
    for name in ("component_across", "component_down"):
        if getattr(parameters, name) >= content.dimension:
            bound = f"a component of the recording, 0 to {content.dimension - 1}"
            raise ParameterError(name, getattr(parameters, name), bound)
    return parameters.component_across, parameters.component_down


FRAMES = 120
SIZE_PX = (480, 320)
GROUP = "Example"
PAPER, COLOURS = 245, ((86, 180, 233), (230, 159, 0))
RADIUS_PX, BOX_PX = 14.0, 28.0
MEETING = 60
"""The frame in which the discs are nearest to each other."""

NAMES = ("x", "y", "vx", "vy")
UNITS = ("px", "px", "px/frame", "px/frame")
VELOCITY_SD_PX = 0.5
EXAMPLE_PARTICLES = 300


class ExampleParameters(SelectionParameters, group=GROUP, constants={"example_particles": EXAMPLE_PARTICLES}):
    """The example that is made up."""

    example_error_px: float = parameter(4, "Error", unit="px", within=(0.1, 50, 0.1), useful=(0.5, 20), role="world")
    """Standard deviation of the estimate's error, and of the particles."""
    confuse_numbers: bool = parameter(False, "Confuse numbers")
    """Whether the two targets have each other's number after they met."""


class ExampleSource:
    """The frames of the example.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: Frames a second.
        frame_count: Number of frames.
        start: Place of the selected disc in frame 0.
        noisy: The errors depend on the seed.
    """

    frame_rate_hz = 30.0
    noisy = True

    def __init__(self, seed: int, parameters: ExampleParameters) -> None:
        """Set the example up; the seed is that of the errors.

        Raises:
            ParameterError: The target or component does not exist.
        """
        self._seed = seed
        self._selected = 2 if parameters.selected_target == 2 else 1
        self._components = (min(parameters.component_across, 3), min(parameters.component_down, 3))
        self.size = SIZE_PX
        self.frame_count: int | None = FRAMES
        self.start = self._target(0) or Target(np.zeros(2))

    def frame(self, index: int, history: History[ExampleParameters]) -> Frame:
        """Return a frame; the same arguments give the same frame, to the bit."""
        parameters = history.at(index)
        believed = {target: _belief(self._seed, index, target, parameters) for target in (1, 2)}
        if parameters.confuse_numbers and index >= MEETING:
            believed = {1: believed[2], 2: believed[1]}
        switched = parameters.confuse_numbers and index == MEETING
        beliefs = Beliefs(
            replace(believed[self._selected], target=self._selected),
            present=True,
            others=(replace(believed[3 - self._selected], target=3 - self._selected),),
            truths=tuple(_truth(index, target) for target in (1, 2)),
            switches=2 if switched else 0,
            components=self._components,
            names=NAMES,
            plane=Plane(SIZE_PX),
        )
        return Frame(
            index, index / self.frame_rate_hz, image_rgb=_picture(index), target=self._target(index), beliefs=beliefs
        )

    def _target(self, index: int) -> Target | None:
        return target_of(_truth(index, self._selected), self._components)


def _state(index: int, target: int) -> Floats:
    """Return the true place and velocity of a disc, px and px a frame."""
    pace = 3.2 if target == 1 else -3.2
    x = SIZE_PX[0] / 2 + pace * (index - MEETING)
    bend = 1.0 if target == 1 else -1.0
    y = SIZE_PX[1] / 2 + bend * (18.0 + 0.008 * (index - MEETING) ** 2)
    return np.array([x, y, pace, bend * 0.016 * (index - MEETING)])


def _truth(index: int, target: int) -> Belief:
    state = _state(index, target)
    return Belief(target, mean=state, box=_box(state))


def _box(state: Floats) -> Floats:
    return np.array([*(state[:2] - (BOX_PX - 1.0) / 2.0), BOX_PX, BOX_PX])


def _belief(seed: int, index: int, target: int, parameters: ExampleParameters) -> Belief:
    stream = Stream(seed, index, Purpose.SCENE)
    spread = np.array([parameters.example_error_px] * 2 + [VELOCITY_SD_PX] * 2)
    count = EXAMPLE_PARTICLES
    normals = stream.standard_normal((2, count + 1, 4))[target - 1]
    middle = _state(index, target) + spread * normals[0]
    # Every second one has twice the weight, as if it had been resampled less.
    weights = np.where(np.arange(count) % 2 == 0, 2.0, 1.0)
    ancestors = np.arange(count) - np.arange(count) % 3
    return Belief(
        target,
        particles=middle + spread * normals[1:],
        log_weights=np.where(weights == 2.0, np.float64(0.6931471805599453), np.float64(0.0)),
        ancestors=ancestors,
        box=_box(middle),
    )


def _picture(index: int) -> NDArray[np.uint8]:
    image = np.full((SIZE_PX[1], SIZE_PX[0], 3), PAPER, dtype=np.uint8)
    for target, colour in zip((1, 2), COLOURS, strict=True):
        x, y, _, _ = _state(index, target).tolist()
        paint_disc(image, x, y, RADIUS_PX, colour)
    image.flags.writeable = False
    return image


# A step of the tracker of recorded beliefs looks at its frame alone. Weights are made to sum to one, mean and
# covariance come from the particles where they were not recorded, and effective sample size and different parents are
# counted as of any particle filter.

REPORTED = tuple(read_reported(Path(__file__).parent).values())


@dataclass(frozen=True, eq=False)
class BeliefState:
    """The record of a frame, immutable.

    Attributes:
        beliefs: Beliefs in all targets.
        particles: Particles of the selected one, with weights that sum to one; None without.
        estimate: (tracked,) the chosen components of its mean, or the middle of its box.
        covariance: (tracked, tracked) of these; None where it is not known.
    """

    beliefs: Beliefs
    particles: ParticleSet | None
    estimate: Floats
    covariance: Floats | None

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

    def arrays(self) -> Mapping[str, Floats]:
        """Return states and log weights of the particles; empty without."""
        if self.particles is None:
            return {}
        return {"states": self.particles.states, "log_weights": self.particles.log_weights}


def place_of(belief: Belief, components: tuple[int, ...]) -> Floats:
    """Return the chosen components of the mean, (tracked,); NaN where nothing is."""
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


def step(state: BeliefState, frame: Frame, parameters: Parameters, rng: Generator) -> BeliefState:
    """Take over what was recorded of the frame."""
    del state, parameters, rng
    return _take(frame)


def _take(frame: Frame) -> BeliefState:
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
    return BeliefState(beliefs, particles, estimate, covariance)


def start(target: Target, frame: Frame, parameters: Parameters, rng: Generator) -> BeliefState:
    """Take over what was recorded of frame 0."""
    del target, parameters, rng
    return _take(frame)


def measure(state: BeliefState) -> Mapping[str, SeriesValue]:
    """Report the available values: the shown components, the particles, the box, and the number of targets."""
    beliefs, belief = state.beliefs, state.beliefs.selected
    sigma = state.sigma
    found: dict[str, SeriesValue] = {
        "across": float(state.estimate[0]),
        "targets": float(len(beliefs.others) + beliefs.present),
    }
    if len(state.estimate) > 1:
        found["down"] = float(state.estimate[1])
    if state.covariance is not None:
        found["across_sd"] = float(sigma[0])
        if len(sigma) > 1:
            found["down_sd"] = float(sigma[1])
    if state.particles is not None:
        found |= {"ess": state.particles.effective_sample_size, "particles": float(len(state.particles))}
        if belief.ancestors is not None:
            found["unique_ancestors"] = float(state.particles.unique_ancestors)
            found["resampled"] = float(not np.array_equal(belief.ancestors, np.arange(len(belief.ancestors))))
    if belief.box is not None:
        found["box"] = tuple(belief.box[2:].tolist())
        if np.isfinite(belief.score):
            found["score"] = belief.score
    return found


class Recorded(Model):
    """The record has no model, but its particles can be inspected."""

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
        start,
        step,
        series=(*CLOUD, *REPORTED),
        measure=measure,
        searching=_is_absent,
        model=Recorded(),
        replays=True,
    )
}
"""The one tracker of recorded beliefs."""
