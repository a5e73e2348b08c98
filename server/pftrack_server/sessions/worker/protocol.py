"""What the web process and a worker say to each other: commands and orders go down the pipe, events come up.

A `Command` is one type all the way: the body of a request, the message on the pipe, and the case in the worker. To add
one, declare a class here, name it in the union, give it a case in `worker`, and send it from a button.

The worker sends a drawing only when it holds a credit, and the web process gives the next credit when the last drawing
has arrived and somebody looks: so drawings are never queued, and nobody draws for an empty room. A drawing travels in
two forms, for the scene and for flat views, with a credit for each. Both are made of one drawing and share its
pictures.
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
"""Number of the request that nobody sends: it is answered when the run is where the config wants it."""


@dataclass(frozen=True, slots=True)
class WorkerConfig:
    """Everything that a worker needs to know to make, or make again, a session's run.

    Attributes:
        session: The session's name, for the log.
        run: The branch to begin with, and where it shall go before anybody asks for anything; its recipe has the truth.
        recording: The upload; None for a simulated scene.
        states: Folder in which checkpoints of the branches are kept, or None to keep none.
        reserve_bytes: Free space on the disk that they must leave.
        memory_bytes: What the worker may allocate.
        cpu_seconds: CPU time that the worker may use.
        limits: How long a run and how large an upload may be.
        max_particles: Most particles allowed.
        gives_way: Whether it computes only when no other session wants to.
        filters: Texts of filters that the run may execute, since the owner of this machine has named their files.
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
    lines: list[list[Known]] = Field(description="Heights of lines, 0 to 1, in each frame; null before a line begins")


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


class Order:
    """Something that is asked of a run.

    Attributes:
        interrupts: Whether it ends a way to a goal, since it changes the run or the frame that is shown.
        queues: Whether it waits for the order before it. A pause must not: it has to reach a worker that seeks.
    """

    interrupts: ClassVar[bool] = True
    queues: ClassVar[bool] = False


# ---------------------------------------------------------------- commands of people


class RunCommand(RequestBody, Order):
    """Base of the commands; `kind` says which one it is."""


class Play(RunCommand):
    """Play from the frame that is shown; from the last frame on, play from the first."""

    kind: Literal["play"] = "play"


class Pause(RunCommand):
    """Stop playing, or stop on the way to a frame."""

    kind: Literal["pause"] = "pause"


class Step(RunCommand):
    """Go to the next frame, or back to the one before; both ends hold."""

    kind: Literal["step", "back"]


class Seek(RunCommand):
    """Go to a frame; pftrack computes the frames on the way."""

    kind: Literal["seek"] = "seek"
    frame: FrameNumber


class BeforeLoss(RunCommand):
    """Go to a frame from which to watch how the target was lost."""

    kind: Literal["before_loss"] = "before_loss"


class SetSpeed(RunCommand):
    """Play at a multiple of real time; 0 is as fast as possible."""

    interrupts: ClassVar[bool] = False
    kind: Literal["speed"] = "speed"
    speed: Annotated[float, Field(le=10, allow_inf_nan=False), NOT_BOOLEAN, AfterValidator(_check_speed)]


class StopAt(RunCommand):
    """Stop playing where the target is probably lost."""

    interrupts: ClassVar[bool] = False
    kind: Literal["stop_at"] = "stop_at"
    probability: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False), NOT_BOOLEAN] | None = Field(
        None,
        description="That the target is lost, from which on it stops playing; never if left out. On a recording any "
        "value stops it where a mark or the tracker itself says that the target is lost",
    )


class Restart(RunCommand):
    """Start the active branch again with the values in force."""

    kind: Literal["restart"] = "restart"
    seed: Seed | None = Field(None, description="The seed to start again with; the same one if left out")


class Changed(BaseModel):
    """The values in force after a change, and the frame from which they count."""

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
    frame: FrameNumber = Field(description="The one that is shown, in which it is moved")
    particle: Annotated[int, Field(ge=0), NOT_BOOLEAN] | None = Field(
        None, description="Which of the particles that are drawn; the estimate, with all of them, if left out"
    )
    place: tuple[Pixels, Pixels] = Field(description="Of the drawing, px; the nearest that is allowed counts")


class MakeBranch(RunCommand):
    """Leave the active branch at a frame and continue in a new one."""

    queues: ClassVar[bool] = True
    kind: Literal["branch"] = "branch"
    frame: FrameNumber
    values: Values = Field({}, description="New values by name of the parameter; `tracker` is the tracker")
    seed: Seed | None = Field(None, description="Seed of the tracker from there on; the scene stays as it is")
    title: Title | None = None


class ShowBranch(RunCommand):
    """Show another branch."""

    queues: ClassVar[bool] = True
    kind: Literal["activate"] = "activate"
    branch: Name


class Inspect(RunCommand):
    """Look at a place, a particle, or without either the estimate; it is drawn from now on.

    It takes the place of what was looked at before.
    """

    interrupts: ClassVar[bool] = False
    kind: Literal["inspect"] = "inspect"
    likelihood: bool = Field(False, description="Whether the likelihood lies over the picture")
    place: tuple[Pixels, Pixels] | None = Field(None, description="Of the picture, px")
    picks: bool = Field(False, description="Whether the particle nearest to the place is looked at, and followed")
    particle: Annotated[int, Field(ge=0), NOT_BOOLEAN] | None = Field(None, description="Place of a particle to follow")
    frame: FrameNumber | None = Field(None, description="The frame of the particle; the one that is shown if left out")
    genealogy: bool = Field(False, description="Whether the ancestors of all particles are wanted")
    pulls: bool = Field(False, description="Whether arrows show which way the parts of the tracker's step pull")


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


# ---------------------------------------------------------------- what the server alone asks


@dataclass(frozen=True, slots=True)
class ReviseFilter(Order):
    """Continue with another version of a filter's file; one that cannot be used is reported, and changes nothing."""

    queues: ClassVar[bool] = True
    name: str
    text: str


@dataclass(frozen=True, slots=True)
class Save(Order):
    """Write the active branch to a file; answered with its summary and a thumbnail."""

    interrupts: ClassVar[bool] = False
    queues: ClassVar[bool] = True
    path: str


@dataclass(frozen=True, slots=True)
class Picture(Order):
    """Draw the current frame; answered with the picture as PNG."""

    interrupts: ClassVar[bool] = False


@dataclass(frozen=True, slots=True)
class Explain(Order):
    """Explain why the target was lost; answered with an `Explanation`.

    Attributes:
        frame: The frame to ask about; None for the first lasting loss.
    """

    interrupts: ClassVar[bool] = False
    frame: int | None


# ---------------------------------------------------------------- messages on the pipe


@dataclass(frozen=True, slots=True)
class Credit:
    """One drawing may be sent in this form; no answer."""

    form: Form


@dataclass(frozen=True, slots=True)
class Request:
    """An order that wants the answer with this number.

    Attributes:
        number: Of the request.
        order: What is asked for.
        branch: What to call a branch that it makes.
        known: What the session knows of the branch that it shows, which makes it again in a worker without it.
    """

    number: int
    order: Order
    branch: str = ""
    known: RunSnapshot | None = None


# ---------------------------------------------------------------- events


@dataclass(frozen=True, slots=True)
class Ready:
    """The run stands at its beginning or at its checkpoint; the first event of every worker that did not fail.

    Attributes:
        description: What is fixed of it.
        run: What moves of the run.
        rows: Diagnostics of the frames computed.
    """

    description: SessionDescription
    run: RunSnapshot
    rows: list[dict[str, Any]]


@dataclass(frozen=True, slots=True)
class Described:
    """What is fixed of the run is something else from now on: it has other trackers and parameters."""

    description: SessionDescription


@dataclass(frozen=True, slots=True)
class Progress:
    """Frames were computed or another one is shown.

    Attributes:
        changes: What has changed of the run's snapshot since the last event, by field.
        rows: Diagnostics of the frames computed since the last event, in order.
        scene: The newest drawing for the scene, where a credit was left for it.
        flat: The newest drawing for flat views, where a credit was left for it.
        is_ahead: Whether the run is now seen otherwise than in the newest drawing for flat views.
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
    """The worker is alive; sent when there is nothing else to say."""


@dataclass(frozen=True, slots=True)
class Failed:
    """The worker cannot go on; the last event before it ends.

    Attributes:
        message: Sentence for a person.
        error: The refusal that stopped it from starting, where it was one.
    """

    message: str
    error: Exception | None = None


Event: TypeAlias = Ready | Described | Progress | Reply | Heartbeat | Failed
