"""Options of a recording on the command line: its path, its start, its marks and its truth."""

import os
from collections.abc import Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pftrack.cli.output import CommandError, note, whole, wrong_use

if TYPE_CHECKING:
    from pftrack.core.model.recipe import Footage, Recipe
    from pftrack.core.model.setup import Setup
    from pftrack.core.model.source import FrameSequence, Kind
    from pftrack.core.model.source import Truth as TrueRows
    from pftrack.experiments.experiment import Experiment
    from pftrack.runs.reproduction import OpenSequence
    from pftrack.sources.sequence import Recording


Video = Annotated[
    Path | None,
    typer.Option(help="A video, an animation (GIF, PNG, WebP), a folder of pictures, or a table of tracks (CSV)."),
]
Tracks = Annotated[Path | None, typer.Option(help="A table of tracks (CSV), the same as --video.")]
Mark = Annotated[
    str | None,
    typer.Option(metavar="KIND:...", help="The target on the first frame; `show` prints the kinds and their forms."),
]
Box = Annotated[str | None, typer.Option(metavar="X,Y,W,H", help="Short for --mark box:X,Y,W,H, px.")]
Points = Annotated[Path | None, typer.Option(metavar="FILE", help="Short for --mark points:FILE.")]
Start = Annotated[
    str | None,
    typer.Option(metavar="FRAME", help="Frame on which the target is marked (default: the first with truth, or 0)."),
]
Truth = Annotated[Path | None, typer.Option(help="CSV with the true values of each frame; `show` prints the columns.")]
TruthFirst = Annotated[
    str | None, typer.Option("--truth-first-frame", metavar="0|1", help="Number of the first frame in the truth.")
]
Large = Annotated[
    bool, typer.Option("--large", help="Allow pictures up to 8K and files up to 16 GiB; they take time and memory.")
]
Moved = Annotated[Path | None, typer.Option("--video", help="The run's video, if it was moved.")]


@dataclass(frozen=True)
class FootageOptions:
    """The options of a recording, as given.

    Attributes:
        video: Its path.
        option: The option that gave it.
        marks: (name of the option, kind of mark, text) of every mark given.
        start: Number of the picture with the mark.
        truth: File of what is true of it.
        large: Whether it may be larger than usual.
        truth_first: Number of the first frame in that file.
    """

    video: Path | None
    option: str
    marks: tuple[tuple[str, str, str], ...]
    start: str | None
    truth: Path | None
    large: bool = False
    truth_first: int | None = None

    @classmethod
    def of(
        cls,
        video: Video = None,
        tracks: Tracks = None,
        mark: Mark = None,
        box: Box = None,
        points: Points = None,
        start: Start = None,
        truth: Truth = None,
        large: Large = False,
        truth_first: TruthFirst = None,
    ) -> "FootageOptions":
        """Gather the options; --box and --points are short for kinds of --mark."""
        if video is not None and tracks is not None:
            raise wrong_use("give either --video or --tracks, not both")
        marks = []
        if mark is not None:
            kind, colon, text = mark.partition(":")
            if not (kind and colon and text):
                raise wrong_use(f"--mark expected KIND:..., such as box:12,30,40,40, got {mark!r}")
            marks.append(("--mark", kind, text))
        if box is not None:
            marks.append(("--box", "box", box))
        if points is not None:
            marks.append(("--points", "points", str(points)))
        option, first = "--tracks" if tracks else "--video", bit("--truth-first-frame", truth_first)
        return cls(video or tracks, option, tuple(marks), start, truth, large, first)


def open_setup(
    stack: ExitStack, experiment: "Experiment", recipe: "Recipe", said: FootageOptions, folder: Path
) -> "tuple[Setup, FrameSequence | None]":
    """Return the setup of a recipe as changed by a command line, and its recording, which the stack closes.

    Args:
        stack: Closes what is opened.
        experiment: The recipe's.
        recipe: The recipe of a file, or of the experiment alone.
        said: The options, which have precedence.
        folder: Folder of the file, to which the path of its recording is relative.
    """
    from pftrack.core.model.recipe import LONGEST_RUN, Footage
    from pftrack.runs.reproduction import wire
    from pftrack.sources.truth import remarks_on

    if said.video is None and recipe.footage is None:
        _refuse_options(said)
        return experiment.simulate(), None
    if not experiment.accepts_video:
        raise wrong_use(f"{experiment.id} is simulated and takes no {said.option}")
    footage = recipe.footage or Footage()
    place = said.video or folder / (footage.path or footage.name)
    if not place.exists():
        raise CommandError(f"{place} does not exist")
    changes = _mark(experiment, said) if said.marks else {}
    _demand_mark(experiment, said, footage, experiment.video.footage)
    truth = None if said.truth is None else _truth(experiment, said.truth, said.truth_first)
    if truth is not None:
        changes["truth"] = dict(truth.rows)
        if recipe.footage is None or said.marks:  # a recipe's own mark is on the frame that it names
            changes["start"] = min(truth.rows, default=0)
    if said.start is not None:
        changes["start"] = whole("--start", said.start, 0, LONGEST_RUN)

    sequences: list[FrameSequence] = []

    def opened(footage: "Footage") -> "FrameSequence":
        sequence = open_footage(stack, place, square=footage.square, large=said.large)
        sequences.append(sequence)
        for remark in remarks_on(sequence, experiment.video.truth, truth):
            note(f"pftrack: {remark}")
        _demand_mark(experiment, said, footage, (sequence.index.kind,))
        return sequence

    setup = wire(experiment, footage.model_copy(update=changes), opened)
    return setup, sequences[0]


@dataclass(frozen=True)
class Swept:
    """A recording on which a sweep is.

    Attributes:
        footage: Its entry in a recipe, with the marked or found target.
        kind: Kind of recording.
        frames: Number of frames from its start on.
        recording: Its path.
    """

    footage: "Footage"
    kind: "Kind"
    frames: int
    recording: "Recording"


def swept_recording(experiment: "Experiment", said: FootageOptions, out: Path | None) -> Swept | None:
    """Return the recording that options speak of; None if they speak of none.

    Args:
        experiment: Whose sweep it is.
        said: The options.
        out: Path of the result, to which the path of the recording is relative.
    """
    from pftrack.core.model.recipe import Recipe
    from pftrack.sources.limits import DEFAULT_LIMITS, LARGE_LIMITS
    from pftrack.sources.sequence import Recording

    with ExitStack() as stack:
        setup, sequence = open_setup(stack, experiment, Recipe(experiment=experiment.id), said, Path())
        if sequence is None or setup.footage is None or said.video is None:
            return None
        path = path_from(said.video, out) if out is not None else None
        return Swept(
            setup.footage.model_copy(update={"path": path}),
            sequence.index.kind,
            frames_left(sequence, setup),
            Recording(str(said.video), sequence.index.to_json(), LARGE_LIMITS if said.large else DEFAULT_LIMITS),
        )


def frames_left(sequence: "FrameSequence", setup: "Setup") -> int:
    """Return the number of a recording's frames from its start on."""
    return sequence.frame_count - (setup.footage.start if setup.footage else 0)


def path_from(video: Path, out: Path) -> str:
    """Return where a recording is, seen from a file that is written: the two can be moved together."""
    return os.path.relpath(video.absolute(), out.absolute().parent)


def open_footage(stack: ExitStack, path: Path, *, square: bool | None = None, large: bool = False) -> "FrameSequence":
    """Open a recording, with square pixels if the run requires them; it is closed with the stack."""
    from pftrack.core.refusal import RefusedError
    from pftrack.sources.limits import DEFAULT_LIMITS, LARGE_LIMITS
    from pftrack.sources.sequence import open_sequence

    try:
        return stack.enter_context(
            closing(open_sequence(path, LARGE_LIMITS if large else DEFAULT_LIMITS, square=square))
        )
    except RefusedError as error:
        raise CommandError(f"{path.name}: {error}") from None


def place_of(footage: "Footage", file: Path, video: Path | None, used: str) -> Path:
    """Return the path of a recording: the given one, else the one in a file.

    Args:
        footage: Its entry in the file.
        file: The file.
        video: Present path of the recording.
        used: Its use, the beginning of the sentence that refuses.
    """
    place = video or file.parent / (footage.path or footage.name)
    if not place.exists():
        raise CommandError(f"{used} {place}, which does not exist; give its path with --video")
    return place


def footage_of(stack: ExitStack, file: Path, video: Path | None) -> "OpenSequence":
    """Return a finder of a saved run's recording: at the given path, else at the path in its file.

    Args:
        stack: Keeps files open while it lasts.
        file: The saved run.
        video: Where the recording is now.
    """

    def find(footage: "Footage") -> "FrameSequence":
        place = place_of(footage, file, video, "the run was made on")
        return open_footage(stack, place, square=footage.square, large=True)  # as the run was allowed

    return find


def _refuse_options(said: FootageOptions) -> None:
    """Refuse what would go with a recording where there is none."""
    options = {**{option: text for option, _, text in said.marks}, "--start": said.start, "--truth": said.truth}
    for name, given in options.items():
        if given is not None:
            raise wrong_use(f"{name} needs --video: a simulated scene has its own start and truth")


def _demand_mark(experiment: "Experiment", said: FootageOptions, footage: "Footage", kinds: Sequence[str]) -> None:
    """Refuse to go on without a mark if a recording of each of these kinds needs one."""
    if not (said.marks or footage.mark) and all(experiment.video.needs_mark(kind) for kind in kinds):
        marks = " or ".join(f"--mark {kind.name()}:{kind.text}" for kind in experiment.video.marks)
        raise wrong_use(f"{said.option} needs {marks}: where the target is on the first frame")


def _mark(experiment: "Experiment", said: FootageOptions) -> dict[str, Any]:
    from pftrack.core.refusal import ParameterError

    if len(said.marks) > 1:
        given = " and ".join(option for option, _, _ in said.marks)
        raise wrong_use(f"mark the target only once, got {given}")
    ((option, name, text),) = said.marks
    kinds = {kind.name(): kind for kind in experiment.video.marks}
    if name not in kinds:
        only = f", only {', '.join(kinds)}" if kinds else ": all of the recording is followed"
        raise wrong_use(f"{experiment.id} takes no mark of kind {name!r}{only}")
    try:
        # It is in the pixels of the recording as shown today, independent of a file's entry.
        return {"mark": kinds[name].parse(text).model_dump(mode="json"), "square": None}
    except ParameterError:
        raise
    except ValueError as error:
        raise wrong_use(f"{option} {error}") from None


def bit(option: str, text: str | None) -> int | None:
    """Return the number that was given, 0 or 1, or none."""
    return None if text is None else whole(option, text, 0, 1)


def _truth(experiment: "Experiment", path: Path, first_frame: int | None) -> "TrueRows":
    """Return what is true of each frame that a file lists."""
    if experiment.video.truth is None:
        raise wrong_use(f"{experiment.id} takes no --truth")
    return experiment.video.truth.read(path, first_frame)
