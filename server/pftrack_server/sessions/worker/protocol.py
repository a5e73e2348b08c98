"""The pipe protocol: what the web process and a worker say to each other.

Orders (`pftrack_server.sessions.worker.commands`) go down, each with the number of its request; events come up. The
worker sends a drawing only when it holds a credit, and the web process gives the next credit when the last drawing has
arrived and somebody looks: so drawings are never queued, and nobody draws for an empty room. A drawing travels in two
forms, for the scene and for flat views, with a credit for each; both are made of one drawing and share its pictures.
"""

from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

from pftrack_server.core.pictures import SceneDrawing
from pftrack_server.sessions.spec import RunSnapshot, SessionDescription
from pftrack_server.sessions.worker.codec import EncodedDrawing
from pftrack_server.sessions.worker.commands import Order

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
        video: Path of an upload, or None for a simulated scene.
        index: What was found when the upload was decoded first, as JSON, so that it opens at once.
        states: Folder in which checkpoints of the branches are kept, or None to keep none.
        reserve_bytes: Free space on the disk that they must leave.
        memory_bytes: What the worker may allocate.
        cpu_seconds: CPU time that the worker may use.
        max_frames: Longest run allowed.
        max_pixels: Most pixels of a frame allowed.
        max_particles: Most particles allowed.
        gives_way: Whether it computes only when no other session wants to.
        filters: Texts of filters that the run may execute, since the owner of this machine has named their files.
    """

    session: str
    run: RunSnapshot
    video: str | None = None
    index: str | None = None
    states: str | None = None
    reserve_bytes: int = 0
    memory_bytes: int = 1 << 30
    cpu_seconds: int = 7200
    max_frames: int = 20_000
    max_pixels: int = 1920 * 1080 * 2
    max_particles: int = 100_000
    gives_way: bool = False
    filters: tuple[str, ...] = ()


# ---------------------------------------------------------------- what the web process sends


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
