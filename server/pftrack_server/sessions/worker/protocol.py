"""Messages between the web process and a worker: commands and orders go to the worker, events come back.

A `Command` is one type all the way: the body of a request, the message on the pipe, and the case in the worker. To add
one, declare a class here, name it in the union, give it a case in `worker`, and send it from a button.

The worker sends a drawing only when it has a credit, and the web process gives the next credit when the last drawing
has arrived and somebody watches. So drawings never queue, and none is made for nobody. A drawing is sent in two forms,
for the scene and for flat views, with a credit for each. Both come from one drawing and share its pictures.
"""

from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

from pydantic import AfterValidator, BaseModel, Field, TypeAdapter

from pftrack.core.model.likelihood import Amount, Contributions, Histograms, Residual
from pftrack.core.model.parameters import NOT_BOOLEAN, Value
from pftrack.core.model.recipe import Seed
from pftrack.core.model.series import Known
from pftrack.runs.inspection import Course, ParticleFinding
from pftrack.sources.limits import DEFAULT_LIMITS, Limits
from pftrack.sources.sequence import Recording
from pftrack_server.core.bodies import FrameNumber, Name, RequestBody, Title, Values
from pftrack_server.core.pictures import SceneDrawing
from pftrack_server.sessions.spec import RunSnapshot, SessionDescription
from pftrack_server.sessions.worker.codec import EncodedDrawing

Form: TypeAlias = Literal["scene", "flat"]
"""The forms in which a drawing is sent."""

OPENING = 0
"""Number of the reply that no request asks for: it is sent when the run has reached the config's goal."""


@dataclass(frozen=True, slots=True)
class WorkerConfig:
    """Everything that a worker needs to make a session's run.

    Attributes:
        session: The session's name, for the log.
        run: The active branch and its goal, computed before any request; its recipe includes the truth.
        recording: The upload; None for a simulated scene.
        states: Folder for checkpoints of the branches; None to keep none.
        reserve_bytes: Free disk space that the checkpoints must leave.
        memory_bytes: Memory limit of the worker.
        cpu_seconds: Limit of the worker's processor time.
        limits: Limits on the length of a run and the size of an upload.
        max_particles: Most particles allowed.
        gives_way: Whether it computes only when no other session needs the processor.
        filters: Texts of filters that the run may execute: the server's owner named their files.
    """

    session: str
    run: RunSnapshot
    recording: Recording | None = None
    states: str | None = None
    reserve_bytes: int = 0
    memory_bytes: int = 1 << 30
    cpu_seconds: int = 7200
    limits: Limits = DEFAULT_LIMITS
    max_particles: int = 100_000
    gives_way: bool = False
    filters: tuple[str, ...] = ()


# ---------------------------------------------------------------- answers


class PatchesPublic(BaseModel):
    """A patch of the picture and the expected patch, as data URLs of PNG files; null where it is outside."""

    kind: Literal["patches"] = "patches"
    title: str
    expected: str | None
    found: str | None


PartPublic: TypeAlias = Amount | Residual | Histograms | PatchesPublic | Contributions


class StateValue(BaseModel):
    """One coordinate of the inspected state."""

    name: str
    unit: str
    value: Known


class GenealogyPublic(BaseModel):
    """The ancestors of the particles of the frame."""

    first: int = Field(description="The oldest frame")
    counts: list[int] = Field(description="Number of distinct ancestors in each frame from there on")
    coalesced: int | None = Field(description="The newest frame in which one particle is the ancestor of all")
    lines: list[list[Known]] = Field(description="Heights of lines, 0 to 1, in each frame; null before a line begins")


class InspectionPublic(BaseModel):
    """Findings of an inspection in the shown frame."""

    frame: int
    subject: Literal["estimate", "place", "particle", "gone"] = Field(
        description="Inspected subject; gone is a particle without descendants here"
    )
    place: tuple[float, float] | None
    title: str = Field(description="Title of the likelihood; empty if the tracker has none to show")
    has_map: bool = Field(description="Whether the likelihood can be drawn over the picture")
    scale: tuple[float, float] | None = Field(description="Log likelihoods of the darkest and the lightest colour")
    log_likelihood: Known | None = Field(description="Log likelihood at the place; null if unavailable or impossible")
    impossible: bool
    parts: list[PartPublic]
    state: list[StateValue]
    particle: ParticleFinding | None
    update: list[PartPublic] = Field(description="Parts of the tracker's step in this frame")
    courses: tuple[Course, ...]
    genealogy: GenealogyPublic | None


SLOWEST = 0.1
Pixels = Annotated[float, Field(ge=-100_000, le=100_000, allow_inf_nan=False), NOT_BOOLEAN]


def _check_speed(value: float) -> float:
    if value != 0 and value < SLOWEST:
        raise ValueError("Input should be 0 (as fast as possible) or between 0.1 and 10")
    return value


class Order:
    """A request to a run.

    Attributes:
        interrupts: Whether it stops a seek, since it changes the run or the shown frame.
        queues: Whether it waits for the order before it. A pause must not: it has to reach a worker that seeks.
    """

    interrupts: ClassVar[bool] = True
    queues: ClassVar[bool] = False


# ---------------------------------------------------------------- commands of people


class RunCommand(RequestBody, Order):
    """Base of the commands, which `kind` tells apart."""


class Play(RunCommand):
    """Play from the shown frame, or from the first frame if the last one is shown."""

    kind: Literal["play"] = "play"


class Pause(RunCommand):
    """Stop playing or seeking."""

    kind: Literal["pause"] = "pause"


class Step(RunCommand):
    """Go one frame forward or back; at an end nothing happens."""

    kind: Literal["step", "back"]


class Seek(RunCommand):
    """Go to a frame; pftrack computes the frames on the way."""

    kind: Literal["seek"] = "seek"
    frame: FrameNumber


class BeforeLoss(RunCommand):
    """Go to a frame shortly before the target was lost."""

    kind: Literal["before_loss"] = "before_loss"


class SetSpeed(RunCommand):
    """Play at a multiple of real time; 0 is as fast as possible."""

    interrupts: ClassVar[bool] = False
    kind: Literal["speed"] = "speed"
    speed: Annotated[float, Field(le=10, allow_inf_nan=False), NOT_BOOLEAN, AfterValidator(_check_speed)]


class StopAt(RunCommand):
    """Stop playing when the target is probably lost."""

    interrupts: ClassVar[bool] = False
    kind: Literal["stop_at"] = "stop_at"
    probability: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False), NOT_BOOLEAN] | None = Field(
        None,
        description="P(lost) at which playing stops; left out for never. On a recording any "
        "value stops it when a mark or the tracker itself reports a loss",
    )


class Restart(RunCommand):
    """Start the active branch again with the current values."""

    kind: Literal["restart"] = "restart"
    seed: Seed | None = Field(None, description="New random seed; left out for the same one")


class Changed(BaseModel):
    """The values after a change, and the frame from which they apply."""

    parameters: dict[str, Value]
    tracker: str
    frame: int
    branch: str


class ChangeValues(RunCommand):
    """Change parameters from the next frame on; in the past this makes a branch.

    A parameter that cannot change in the middle of a run starts it again.
    """

    queues: ClassVar[bool] = True
    kind: Literal["change"] = "change"
    values: dict[str, Any] = Field(description="New values by name of the parameter; `tracker` is the tracker")


class MoveBelief(RunCommand):
    """Move a particle or the estimate before the next frame; in the past this makes a branch."""

    queues: ClassVar[bool] = True
    kind: Literal["move"] = "move"
    frame: FrameNumber = Field(description="The shown frame, in which it is moved")
    particle: Annotated[int, Field(ge=0), NOT_BOOLEAN] | None = Field(
        None, description="Index of a drawn particle; left out for the estimate with all particles"
    )
    place: tuple[Pixels, Pixels] = Field(description="New place in the drawing, px; the nearest allowed place is used")


class MakeBranch(RunCommand):
    """Leave the active branch at a frame and continue in a new one."""

    queues: ClassVar[bool] = True
    kind: Literal["branch"] = "branch"
    frame: FrameNumber
    values: Values = Field({}, description="New values by name of the parameter; `tracker` is the tracker")
    seed: Seed | None = Field(None, description="Random seed of the tracker from there on; the scene stays the same")
    title: Title | None = None


class ShowBranch(RunCommand):
    """Show another branch."""

    queues: ClassVar[bool] = True
    kind: Literal["activate"] = "activate"
    branch: Name


class Inspect(RunCommand):
    """Inspect a place or a particle, or the estimate if neither is given; it is drawn from now on.

    It replaces what was inspected before.
    """

    interrupts: ClassVar[bool] = False
    kind: Literal["inspect"] = "inspect"
    likelihood: bool = Field(False, description="Whether to draw the likelihood over the picture")
    place: tuple[Pixels, Pixels] | None = Field(None, description="Place in the picture, px")
    picks: bool = Field(False, description="Whether to inspect and follow the particle nearest to the place")
    particle: Annotated[int, Field(ge=0), NOT_BOOLEAN] | None = Field(None, description="Index of a particle to follow")
    frame: FrameNumber | None = Field(None, description="Frame of the particle; left out for the shown one")
    genealogy: bool = Field(False, description="Whether to return the ancestors of all particles")
    pulls: bool = Field(False, description="Whether to draw the parts of the tracker's step as arrows")


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
    | MoveBelief
    | MakeBranch
    | ShowBranch
    | Inspect,
    Field(discriminator="kind"),
]
COMMAND: TypeAdapter[Command] = TypeAdapter(Command)


# ---------------------------------------------------------------- orders of the server alone


@dataclass(frozen=True, slots=True)
class ReviseFilter(Order):
    """Continue with another version of a filter file; an unusable one is reported and changes nothing."""

    queues: ClassVar[bool] = True
    name: str
    text: str


@dataclass(frozen=True, slots=True)
class Save(Order):
    """Write the active branch to a file; the answer is its summary and a thumbnail."""

    interrupts: ClassVar[bool] = False
    queues: ClassVar[bool] = True
    path: str


@dataclass(frozen=True, slots=True)
class Picture(Order):
    """Draw the shown frame; the answer is a PNG picture."""

    interrupts: ClassVar[bool] = False


@dataclass(frozen=True, slots=True)
class Explain(Order):
    """Explain why the target was lost; the answer is an `Explanation`, or None if the branch is not active.

    Attributes:
        frame: The frame to ask about; None for the first lasting loss.
        branch: The branch to ask about; None for the active one.
    """

    interrupts: ClassVar[bool] = False
    frame: int | None
    branch: str | None


# ---------------------------------------------------------------- messages on the pipe


@dataclass(frozen=True, slots=True)
class Credit:
    """Permission to send one drawing in this form; it has no answer."""

    form: Form


@dataclass(frozen=True, slots=True)
class Request:
    """An order, and the number of its reply.

    Attributes:
        number: Number of the request and its reply.
        order: The order.
        branch: Name for a branch that it makes.
        known: The session's snapshot of the branch to show, from which a worker without that branch makes it again.
    """

    number: int
    order: Order
    branch: str = ""
    known: RunSnapshot | None = None


# ---------------------------------------------------------------- events


@dataclass(frozen=True, slots=True)
class Ready:
    """The run is ready, at its beginning or its checkpoint; the first event of every worker that did not fail.

    Attributes:
        description: The unchanging part of the session.
        run: The run's snapshot.
        rows: Diagnostics of the frames computed.
    """

    description: SessionDescription
    run: RunSnapshot
    rows: list[dict[str, Any]]


@dataclass(frozen=True, slots=True)
class Described:
    """The description of the session has changed: it has other trackers and parameters."""

    description: SessionDescription


@dataclass(frozen=True, slots=True)
class Progress:
    """New frames, another shown frame, or changed fields.

    Attributes:
        changes: Changed fields of the run's snapshot since the last event.
        rows: Diagnostics of the frames computed since the last event, in order.
        scene: The newest drawing for the scene, if there was a credit for it.
        flat: The newest drawing for flat views, if there was a credit for it.
        is_ahead: Whether the run now looks different from the newest drawing for flat views.
    """

    changes: dict[str, Any]
    rows: list[dict[str, Any]] = field(default_factory=list)
    scene: SceneDrawing | None = None
    flat: EncodedDrawing | None = None
    is_ahead: bool = True


@dataclass(frozen=True, slots=True)
class Reply:
    """The answer to a request: a result, or the error that refused it."""

    number: int
    result: object = None
    error: Exception | None = None


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """The worker is alive; sent when there is no other event."""


@dataclass(frozen=True, slots=True)
class Failed:
    """The worker cannot continue; the last event before it ends.

    Attributes:
        message: Sentence for a person.
        error: The refusal that prevented its start, if there was one.
    """

    message: str
    error: Exception | None = None


Event: TypeAlias = Ready | Described | Progress | Reply | Heartbeat | Failed
