"""The frames of a recording of beliefs as a tracker gets them: nothing is left to compute but moments."""

from collections.abc import Callable, Iterator
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.belief import Belief, Beliefs
from pftrack.core.model.frame import Frame, Target
from pftrack.core.model.parameters import ParameterError, Parameters
from pftrack.core.model.source import History
from pftrack.sources.beliefs.content import Content
from pftrack.sources.beliefs.identities import Identities, pair_up
from pftrack.sources.beliefs.selection import SelectionParameters
from pftrack.sources.beliefs.sequence import BeliefSequence
from pftrack.sources.recording import check_start

__all__ = ["RecordedBeliefs", "target_of"]

SPREAD_FRAMES = 500
"""So many frames at most are looked at for how far the true places lie apart."""


class RecordedBeliefs:
    """The frames of a recording of beliefs, from a chosen one on.

    Attributes:
        size: Width and height of the picture, or of the paper, px.
        frame_rate_hz: Frames a second.
        frame_count: Frames from the chosen one to the end.
        start: The truth of the first frame, or else what is believed there.
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
            parameters: Which target and which components are looked at.
            first: Number of the first frame that is used.
            truth: Where the target truly is, by number of the frame; what the file itself says if not given.

        Raises:
            ParameterError: There is no such frame, target or component.
        """
        check_start(first, sequence)
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
        """Return what is believed in a frame; the same arguments give the same frame, to the bit."""
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
        """Return how far the true places lie from the middle of their path: root mean square, in the states' unit.

        Who stays at that middle is wrong by so much (Nash and Sutcliffe 1970 measure skill by it). It is 0 where a
        truth has a box, which says better how near is near enough, and where none moves.
        """
        frames = np.unique(np.linspace(0, (self.frame_count or 1) - 1, SPREAD_FRAMES).astype(np.int64)).tolist()
        paths: dict[int, list[NDArray[np.float64]]] = {}
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
        """Return the frame whose belief of the selected target stands for a frame's, and whether it is that one's."""
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
    place: NDArray[np.float64] | None = None
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
