"""The commands: all that can be asked of a run, each with what it does in the worker.

A `Command` is one type all the way: the body of a request, the message on the pipe, and the case in the worker. To add
one, declare a class here, name it in the union, and send it from a button. Below them is what the server alone asks.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import AfterValidator, BaseModel, Field, TypeAdapter

from pftrack.analysis.explanation import Explanation
from pftrack.core.model.likelihood import Amount, Contributions, Histograms, Residual
from pftrack.core.model.parameters import NOT_BOOLEAN, Value
from pftrack.core.model.recipe import Seed
from pftrack.core.model.series import Known
from pftrack.runs.inspection import Course, ParticleFinding
from pftrack_server.core.bodies import FrameNumber, Name, RequestBody, Title, Values
from pftrack_server.sessions.spec import RunSnapshot

if TYPE_CHECKING:
    from pftrack_server.sessions.worker.worker import Worker


class PatchesPublic(BaseModel):
    """A piece of the picture beside the one expected, as addresses of PNG data; null where it is outside."""

    kind: Literal["patches"] = "patches"
    title: str
    expected: str | None
    found: str | None


PartPublic: TypeAlias = Amount | Residual | Histograms | PatchesPublic | Contributions


class StateValue(BaseModel):
    """One coordinate of the state that is looked at."""

    name: str
    unit: str
    value: Known


class GenealogyPublic(BaseModel):
    """The ancestors of the particles of the frame."""

    first: int = Field(description="The oldest frame")
    counts: list[int] = Field(description="How many different ancestors there are in each frame from there on")
    coalesced: int | None = Field(description="The newest frame in which one particle is the ancestor of all")
    lines: list[list[Known]] = Field(
        description="The heights of lines, 0 to 1, in each frame, null before a line begins; lines meet, never cross"
    )


class InspectionPublic(BaseModel):
    """What is found in the frame that is shown."""

    frame: int
    subject: Literal["estimate", "place", "particle", "gone"] = Field(
        description="What was looked at; gone is a particle that has no descendants here"
    )
    place: tuple[float, float] | None
    title: str = Field(description="What the likelihood compares; empty for a tracker that cannot be asked")
    has_map: bool = Field(description="Whether the likelihood can lie over the picture")
    scale: tuple[float, float] | None = Field(description="The log likelihoods of the darkest and the lightest colour")
    log_likelihood: Known | None = Field(description="Null where it cannot be asked, or is impossible")
    impossible: bool
    parts: list[PartPublic]
    state: list[StateValue]
    particle: ParticleFinding | None
    update: list[PartPublic] = Field(description="What the tracker's step of this frame was made of")
    courses: tuple[Course, ...]
    genealogy: GenealogyPublic | None


SLOWEST = 0.1
Pixels = Annotated[float, Field(ge=-100_000, le=100_000, allow_inf_nan=False), NOT_BOOLEAN]


def _check_speed(value: float) -> float:
    if value != 0 and value < SLOWEST:
        raise ValueError("Input should be 0 (as fast as possible) or between 0.1 and 10")
    return value


class Order(ABC):
    """Something that is asked of a run.

    Attributes:
        interrupts: Whether it ends a way to a goal, since it changes the run or the frame that is shown.
        queues: Whether it waits for the order before it. A pause must not: it has to reach a worker that seeks.
    """

    interrupts: ClassVar[bool] = True
    queues: ClassVar[bool] = False

    def makes_branch(self, run: RunSnapshot) -> bool:
        """Return whether it makes a branch of a run."""
        del run
        return False

    @abstractmethod
    def carry_out(self, worker: "Worker") -> Any:  # noqa: ANN401 - each has an answer of its own
        """Do it; return the answer, or None where the session as it is then is the answer."""


# ---------------------------------------------------------------- commands of people


class RunCommand(RequestBody, Order):
    """Base of the commands; `kind` says which one it is."""


class Play(RunCommand):
    """Play from the frame that is shown; from the last frame on, play from the first."""

    kind: Literal["play"] = "play"

    def carry_out(self, worker: "Worker") -> None:
        """Begin to play."""
        worker.play()


class Pause(RunCommand):
    """Stop playing, or stop on the way to a frame."""

    kind: Literal["pause"] = "pause"

    def carry_out(self, worker: "Worker") -> None:
        """Stop."""
        worker.pause()


class Step(RunCommand):
    """Go to the next frame, or back to the one before; both ends hold."""

    kind: Literal["step", "back"]

    def carry_out(self, worker: "Worker") -> None:
        """Go there."""
        worker.step(1 if self.kind == "step" else -1)


class Seek(RunCommand):
    """Go to a frame; pftrack computes the frames on the way."""

    kind: Literal["seek"] = "seek"
    frame: FrameNumber

    def carry_out(self, worker: "Worker") -> None:
        """Go there."""
        worker.seek(self.frame)


class BeforeLoss(RunCommand):
    """Go to a frame from which to watch how the target was lost."""

    kind: Literal["before_loss"] = "before_loss"

    def carry_out(self, worker: "Worker") -> None:
        """Go there."""
        worker.seek(worker.tree.before_loss())


class SetSpeed(RunCommand):
    """Play at a multiple of real time; 0 is as fast as possible."""

    interrupts: ClassVar[bool] = False
    kind: Literal["speed"] = "speed"
    speed: Annotated[float, Field(le=10, allow_inf_nan=False), NOT_BOOLEAN, AfterValidator(_check_speed)]

    def carry_out(self, worker: "Worker") -> None:
        """Set it."""
        worker.set_speed(self.speed)


class StopAt(RunCommand):
    """Stop playing where the target is probably lost."""

    interrupts: ClassVar[bool] = False
    kind: Literal["stop_at"] = "stop_at"
    probability: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False), NOT_BOOLEAN] | None = Field(
        None,
        description="That the target is lost, from which on it stops playing; never if left out. On a recording any "
        "value stops it where a mark or the tracker itself says that the target is lost",
    )

    def carry_out(self, worker: "Worker") -> None:
        """Set it."""
        worker.set_stop(self.probability)


class Restart(RunCommand):
    """Start the active branch again with the values in force."""

    kind: Literal["restart"] = "restart"
    seed: Seed | None = Field(None, description="The seed to start again with; the same one if left out")

    def carry_out(self, worker: "Worker") -> None:
        """Start again."""
        worker.tree.restart(self.seed)
        worker.report_restart()


class Changed(BaseModel):
    """The values in force after a change, and the frame from which they count."""

    parameters: dict[str, Value]
    tracker: str
    frame: int
    branch: str


class ChangeValues(RunCommand):
    """Change parameters from the next frame on; in the past this makes a branch."""

    queues: ClassVar[bool] = True
    kind: Literal["change"] = "change"
    values: dict[str, Any] = Field(description="New values by name of the parameter; `tracker` is the tracker")

    def makes_branch(self, run: RunSnapshot) -> bool:
        """Return whether the run has frames that this would change."""
        return bool(self.values) and run.branch_point is not None

    def carry_out(self, worker: "Worker") -> Changed:
        """Change them; one that cannot change in the middle of a run starts it again."""
        tree = worker.tree
        restarts = tree.restarts
        if self.values:
            worker.flush()
            tree.change(self.values, worker.request.branch)
        restarted = tree.restarts != restarts
        if restarted:
            worker.report_restart()
        elif tree.redraws(self.values):
            worker.mark_changed()
        run = tree.snapshot()
        frame = 0 if restarted else run.position + 1
        return Changed(parameters=run.parameters, tracker=run.tracker, frame=frame, branch=run.branch)


class MakeBranch(RunCommand):
    """Leave the active branch at a frame and continue in a new one."""

    queues: ClassVar[bool] = True
    kind: Literal["branch"] = "branch"
    frame: FrameNumber
    values: Values = Field({}, description="New values by name of the parameter; `tracker` is the tracker")
    seed: Seed | None = Field(
        None, description="Of the tracker's random numbers from there on; the scene stays as it is"
    )
    title: Title | None = None

    def makes_branch(self, run: RunSnapshot) -> bool:
        """Return that it does."""
        del run
        return True

    def carry_out(self, worker: "Worker") -> None:
        """Make the branch and show it."""
        worker.flush()
        values = self.values if self.seed is None else {**self.values, "seed": self.seed}
        worker.tree.branch(worker.request.branch, self.frame, values)


class ShowBranch(RunCommand):
    """Show another branch."""

    queues: ClassVar[bool] = True
    kind: Literal["activate"] = "activate"
    branch: Name

    def carry_out(self, worker: "Worker") -> None:
        """Show it; a branch of an earlier worker is computed again."""
        if worker.request.known is not None:
            worker.activate(worker.request.known)


class Inspect(RunCommand):
    """Look at a place, a particle, or without either the estimate; it is drawn from now on.

    It takes the place of what was looked at before.
    """

    interrupts: ClassVar[bool] = False
    kind: Literal["inspect"] = "inspect"
    likelihood: bool = Field(False, description="Whether the likelihood lies over the picture")
    place: tuple[Pixels, Pixels] | None = Field(None, description="Of the picture, px")
    picks: bool = Field(False, description="Whether the particle nearest to the place is looked at, and followed")
    particle: Annotated[int, Field(ge=0), NOT_BOOLEAN] | None = Field(
        None, description="A particle to follow, by its place in its frame"
    )
    frame: FrameNumber | None = Field(None, description="The frame of the particle; the one that is shown if left out")
    genealogy: bool = Field(False, description="Whether the ancestors of all particles are wanted")
    pulls: bool = Field(False, description="Whether arrows show which way the parts of the tracker's step pull")

    def carry_out(self, worker: "Worker") -> InspectionPublic:
        """Look; return what is found."""
        found = worker.tree.inspect(self)
        worker.mark_changed()
        return found


Command: TypeAlias = Annotated[
    Play
    | Pause
    | Step
    | Seek
    | BeforeLoss
    | SetSpeed
    | StopAt
    | Restart
    | ChangeValues
    | MakeBranch
    | ShowBranch
    | Inspect,
    Field(discriminator="kind"),
]
COMMAND: TypeAdapter[Command] = TypeAdapter(Command)


# ---------------------------------------------------------------- what the server alone asks


@dataclass(frozen=True, slots=True)
class ReviseFilter(Order):
    """Continue with another version of a filter's file."""

    queues: ClassVar[bool] = True
    name: str
    text: str

    def makes_branch(self, run: RunSnapshot) -> bool:
        """Return that it may."""
        del run
        return True

    def carry_out(self, worker: "Worker") -> None:
        """Use the version; one that cannot be used is reported, and nothing else changes."""
        worker.revise_filter(self.name, self.text)


@dataclass(frozen=True, slots=True)
class Save(Order):
    """Write the active branch to a file."""

    interrupts: ClassVar[bool] = False
    queues: ClassVar[bool] = True
    path: str

    def carry_out(self, worker: "Worker") -> dict[str, Any]:
        """Write it; return its summary and a thumbnail."""
        return {"summary": worker.tree.save(Path(self.path)), "thumbnail": worker.picture()}


@dataclass(frozen=True, slots=True)
class Picture(Order):
    """Draw the current frame."""

    interrupts: ClassVar[bool] = False

    def carry_out(self, worker: "Worker") -> bytes:
        """Return it as PNG."""
        return worker.picture()


@dataclass(frozen=True, slots=True)
class Explain(Order):
    """Explain why the target was lost.

    Attributes:
        frame: The frame to ask about; None for the first lasting loss.
    """

    interrupts: ClassVar[bool] = False
    frame: int | None

    def carry_out(self, worker: "Worker") -> Explanation:
        """Return the explanation."""
        return worker.tree.explain(self.frame)
