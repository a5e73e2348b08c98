"""A model of a session: what its branches are made of and how far they are. The library computes their numbers."""

from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

from pftrack.core.model.parameters import flat
from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.runs.run import Run
from pftrack_server.sessions.spec import TRANSITIONS, Phase

__all__ = ["EXPERIMENT", "FIXED", "FRAMES", "BranchModel", "SavedRun", "SessionModel", "hash_of"]

EXPERIMENT, FRAMES = "ball", 24
FIXED = "initial_sd_px"
"""A parameter that cannot change in the middle of a run."""

Values = dict[str, Any]


@dataclass(frozen=True)
class BranchModel:
    """A branch: what makes its run, and how far it is.

    Attributes:
        seed: Of its run.
        tracker: At frame 0.
        changes: By the frame from which they count; those of frame 0 are the values at the beginning.
        position: The frame that is shown.
        computed: The furthest frame computed.
    """

    seed: int
    tracker: str
    changes: dict[int, Values] = field(default_factory=dict)
    position: int = 0
    computed: int = 0

    def at(self, frame: int) -> tuple[Values, str]:
        """Return the parameters and the tracker in force in a frame."""
        values = flat(find(EXPERIMENT).simulate().parameters)
        tracker = self.tracker
        for change in (self.changes[each] for each in sorted(self.changes) if each <= frame):
            given = dict(change)
            tracker = given.pop("tracker", tracker)
            values |= given
        return values, tracker

    @property
    def timeline(self) -> list[dict[str, Any]]:
        """Its changes as a client writes them."""
        return [{"frame": frame, "values": values} for frame, values in sorted(self.changes.items()) if values]

    @property
    def branch_point(self) -> int | None:
        """Frame at which a change leaves it; None where a change counts from its next frame on."""
        if self.position == FRAMES - 1:
            return 0
        return self.position if self.position < self.computed else None

    def change(self, frame: int, values: Values) -> "BranchModel":
        """Return it with values that change from a frame on."""
        return replace(self, changes={**self.changes, frame: {**self.changes.get(frame, {}), **values}})

    def go(self, frame: int) -> "BranchModel":
        """Return it at a frame, computed at least as far."""
        return replace(self, position=frame, computed=max(self.computed, frame))

    def leave(self, frame: int, values: Values) -> "BranchModel":
        """Return the branch that leaves it at a frame with these values."""
        shared = {each: change for each, change in self.changes.items() if each <= frame}
        twin = replace(self, changes=shared, position=frame, computed=frame)
        return twin.change(frame + 1, values) if values else twin

    def restart(self, seed: int, values: Values) -> "BranchModel":
        """Return it with an empty past, begun with what was in force and these values."""
        inforce, tracker = self.at(self.position + 1)
        given = {**inforce, **values}
        tracker = given.pop("tracker", tracker)
        defaults = flat(find(EXPERIMENT).simulate().parameters)
        return BranchModel(seed, tracker, {0: {name: given[name] for name in given if given[name] != defaults[name]}})

    @property
    def estimates_sha256(self) -> str:
        """The hash of its estimates, by the library."""
        changes = tuple((frame, tuple(values.items())) for frame, values in sorted(self.changes.items()))
        return hash_of(self.seed, self.tracker, changes, self.computed)


@dataclass(frozen=True)
class SavedRun:
    """A run that was saved.

    Attributes:
        id: By which the server knows it.
        branch: What was saved.
    """

    id: str
    branch: BranchModel


@dataclass
class SessionModel:
    """A session.

    Attributes:
        id: By which the server knows it.
        branches: By name.
        active: The one that is shown.
        phase: What it does.
    """

    id: str
    branches: dict[str, BranchModel]
    active: str
    phase: Phase = Phase.STARTING

    def pass_through(self, *phases: Phase) -> None:
        """Go through phases; each must be one to which the one before it leads."""
        for phase in phases:
            assert phase is self.phase or phase in TRANSITIONS[self.phase], (self.phase, phase)
            self.phase = phase

    @property
    def branch(self) -> BranchModel:
        """The branch that is shown."""
        return self.branches[self.active]

    @branch.setter
    def branch(self, branch: BranchModel) -> None:
        self.branches[self.active] = branch


@cache
def hash_of(seed: int, tracker: str, changes: tuple[tuple[int, tuple[tuple[str, Any], ...]], ...], last: int) -> str:
    """Compute a run up to a frame by the library, and return the hash of its estimates."""
    experiment = find(EXPERIMENT)
    timeline = [Change(frame, dict(values)) for frame, values in changes]
    run = Run(experiment, experiment.simulate(), tracker=tracker, seed=seed, frames=FRAMES, timeline=timeline)
    run.seek(last)
    return run.estimates_sha256
