"""What a run can be exported as, and what shows one: one list for Python, commands, server and pages.

A format is a `RunExport`: a function that writes a run, as far as it has been computed, to a file, and tells how far it
is; the suffix of a file's name chooses it. To add one is to write that function, to add it to `WRITERS`, and to
describe it in runs.yaml; wherever exports are offered it is there then. To these come the files that an experiment
offers of the frame at which a run stands.

Code that writes through `exporting` or `export` gets a file that appears whole or not at all, and beside a file that
cannot hold its manifest, one that is called like it with `.manifest.json` behind.
"""

import errno
import json
import os
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal, Protocol, TypeAlias, cast

from pydantic import ConfigDict, with_config

from pftrack.core.entry_points import load
from pftrack.core.files import part_of, settle, write_whole
from pftrack.core.model.faults import without_faults
from pftrack.core.model.setup import Export, Exported
from pftrack.core.model.source import FrameIndex
from pftrack.core.refusal import ConflictError, RefusedError
from pftrack.core.texts import Origin, read_as
from pftrack.experiments.experiment import Experiment
from pftrack.output.exports import files
from pftrack.runs.manifest import bibtex_of, extent_of, manifest_of
from pftrack.runs.run import Run
from pftrack.runs.scoring import extent_series
from pftrack.sources.beliefs.sequence import BeliefSequence
from pftrack.sources.limits import DEFAULT_LIMITS
from pftrack.sources.results.table import Form
from pftrack.sources.truth import BOXES

# The library draws runs as pictures and films; it knows no browser. A package that shows them otherwise says so by
# entry points of the group `pftrack.viewers`: `page` writes a run as an HTML page that needs no server, `show` opens
# its scene on this machine. pftrack's own server provides both.

GROUP = "pftrack.viewers"


class Shown(Protocol):
    """A run that is being shown in a browser."""

    @property
    def address(self) -> str:
        """Where a browser of this machine finds it."""

    @property
    def run(self) -> Run:
        """What is shown: the run that was given, or the branch that was made of it by turning a parameter."""

    def go(self, frame: int) -> None:
        """Show a frame; one that has not been computed yet is computed, with all before it."""

    def follow(self, run: Run) -> None:
        """Show a longer run in the place of this one, at its newest frame unless an earlier one is being looked at."""

    def wait(self) -> None:
        """Wait until it is closed, or somebody interrupts."""

    def close(self) -> None:
        """Stop showing it; a second call does nothing."""


def write_page(run: Run, path: Path, _plot: str | None = None) -> Iterator[tuple[int, int]]:
    """Write a run, as far as it has been computed, as an HTML page that needs neither server nor network.

    Args:
        run: It is moved to each of its frames.
        path: Where to.

    Yields:
        How many frames are done, of how many.

    Raises:
        ConflictError: No viewer is installed that can do that.
        OSError: The file cannot be written.
    """
    yield from load(GROUP, "page")(run, path)


def show(run: Run, *, port: int = 0, browser: bool | None = None) -> Shown:
    """Open the scene of a run on this machine.

    Args:
        run: What is shown; it is not changed. A parameter that is turned beside the scene makes a branch of it.
        port: Where to listen, of this machine alone; any that is free if 0.
        browser: Whether to open the scene in a browser; if not given, unless it is shown in a notebook.

    Raises:
        ConflictError: No viewer is installed that can do that.
        OSError: The port is taken.
    """
    return cast("Shown", load(GROUP, "show")(run, port=port, browser=browser))


SMALLEST_STILL_PX = 1200
"""A small picture is enlarged so far that lines and letters on it are sharp."""

FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
"""Errors of a disk, or of a limit, that takes no more."""

Steps: TypeAlias = Iterator[tuple[int, int]]
"""How far an export is: (frames or parts that are written, of all)."""

Group: TypeAlias = Literal["numbers", "boxes", "truth", "film", "plots", "documents", "model"]
"""What kind of thing a file is, by which lists are grouped: numbers of all frames, boxes
that are believed and that are true, moving pictures and scenes, pictures
of plots, what makes the run again and says where it comes from, and the frame with what the experiment offers of it."""


class Write(Protocol):
    """Write a run to a file."""

    def __call__(self, run: Run, path: Path, plot: str | None, /) -> Steps:
        """Write it step by step.

        Args:
            run: As far as it has been computed; it may be moved to other frames.
            path: Where to; nobody looks there yet.
            plot: Id of the one plot that is wanted of a format of the group "plots"; None for all of them.

        Raises:
            ConflictError: It cannot be written so; the sentence says why.
            OSError: The file cannot be written.
        """


@with_config(ConfigDict(extra="forbid", revalidate_instances="subclass-instances"))
@dataclass(frozen=True, slots=True)
class FileKind:
    """A kind of file that can be made of a run, or of a comparison.

    Attributes:
        name: Name in commands and addresses.
        title: What it is, a few words.
        suffix: Of the file's name, without the dot.
        media_type: Of the file.
        group: What kind of thing it is.
        beside: Whether its manifest is a file of its own.
        short: What it is called beside others of its group; the title if empty.
        origin: File and line where it is declared.
    """

    name: str
    title: str
    suffix: str
    media_type: str
    group: Group
    beside: bool = False
    short: str = ""
    origin: Origin = field(default="", compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunExport(FileKind):
    """A kind of file that can be made of a run.

    Attributes:
        write: What writes it.
    """

    write: Write


def read_kinds(name: str) -> dict[str, dict[str, Any]]:
    """Return what a YAML file beside this module declares of files of some kind, by name."""
    return {it.name: asdict(it) for it in read_as(FileKind, Path(__file__).with_name(name), "name")}


def exports_of(experiment: Experiment) -> tuple[RunExport, ...]:
    """Return all that a run of an experiment can be exported as."""
    believes = experiment.boxes is not None or extent_series(experiment.all_series()) is not None
    boxes = BELIEVED if believes else ()
    known = experiment.accepts_video and experiment.video.truth is BOXES
    true = TRUE if believes or known else ()
    return (*FORMATS, *boxes, *true, *map(_of_frame, experiment.exports))


def export_at(experiment: Experiment, path: Path, plot: str | None = None) -> RunExport:
    """Return the export that the name of a file asks for: the one with the longest suffix that it ends in.

    Args:
        experiment: Of the run.
        path: Where it shall be written.
        plot: Id of the one plot that is wanted in a picture.

    Raises:
        ConflictError: The kind of file, its folder or the plot does not exist.
    """
    offered = exports_of(experiment)
    name = path.name.lower()
    fitting = [one for one in offered if name == one.suffix or name.endswith(f".{one.suffix}")]
    if not fitting:
        known = ", ".join(f".{one.suffix}" for one in offered)
        raise ConflictError(f"a run of {experiment.id} can be exported as {known}; got {path.name!r}")
    folder = path.absolute().parent
    if not folder.is_dir():
        raise ConflictError(f"{path} cannot be written: the folder {folder} does not exist")
    if path.is_dir():
        raise ConflictError(f"{path} is a folder, not a file to write")
    # Of two with the same suffix the experiment's own comes last, and is meant.
    found = max(reversed(fitting), key=lambda one: len(one.suffix))
    meant = next((one for one in (*BELIEVED, *TRUE) if name.endswith(f".{one.suffix}")), found)
    if len(meant.suffix) > len(found.suffix):
        raise ConflictError(f"{path.name} would hold boxes ({meant.title}), and runs of {experiment.id} know of none")
    check_plot(experiment, found, plot)
    return found


def export(run: Run, path: Path, *, plot: str | None = None) -> Exported:
    """Write a run, as far as it has been computed, to a file of the kind that its name asks for.

    Args:
        run: Afterwards it stands at the frame at which it stood.
        path: Where to; an existing file is replaced.
        plot: Id of the one plot that is wanted in a picture; all if not given.

    Raises:
        ConflictError: The kind of file or the plot does not exist, or it cannot be made of this run.
        OSError: The file cannot be written; what was there before is still there.
    """
    kind = export_at(run.experiment, path, plot)
    for _ in exporting(run, path, kind, plot):
        pass
    return Exported(files_of(kind, path), extent_of(run), run.computed + 1 == run.frames)


def exporting(run: Run, path: Path, kind: RunExport, plot: str | None = None) -> Steps:
    """Write a file like `export`, and tell how far it is; closed before its end, it leaves nothing behind."""
    check_plot(run.experiment, kind, plot)
    position, part = run.position, part_of(path)
    try:
        yield from kind.write(run, part, plot)
        if kind.beside:
            write_whole(_beside(path), _manifest(run))
        settle(part, path)
    except OSError as error:
        if error.errno is None:
            raise
        reason = os.strerror(error.errno)  # some libraries tell it in words of their own, with the part's name
        if error.errno not in FULL:
            raise OSError(error.errno, reason, str(path)) from None
        raise ConflictError(f"{path.name} cannot be written: {reason}; make room, or export fewer frames") from None
    finally:
        part.unlink(missing_ok=True)
        if run.position != position:
            run.seek(position)


def files_of(kind: RunExport, path: Path) -> tuple[Path, ...]:
    """Return the files that an export writes: the one that is asked for, and its manifest where that lies beside it."""
    return (path, _beside(path)) if kind.beside else (path,)


def check_plot(experiment: Experiment, kind: RunExport, plot: str | None) -> None:
    """Make sure that a plot that is wanted can be exported so.

    Raises:
        ConflictError: The kind is not a picture of plots, or the plot does not exist.
    """
    known = [one.id for one in experiment.display.plots]
    if plot is not None and kind.group != "plots":
        raise ConflictError(f"a plot can be written as a picture, .png or .svg; got .{kind.suffix}")
    if plot is not None and plot not in known:
        raise ConflictError(f"{experiment.id} has no plot {plot!r}, only {', '.join(known)}")


def _beside(path: Path) -> Path:
    return path.with_name(f"{path.name}.manifest.json")


def _at_once(make: Callable[[Run], bytes]) -> Write:
    """Return what writes a file whose content is made in one go."""

    def write(run: Run, path: Path, _plot: str | None) -> Steps:
        path.write_bytes(make(run))
        yield 1, 1

    return write


def _table(pieces: Callable[[Run, Path], Steps]) -> Write:
    return lambda run, path, _plot: pieces(run, path)


def _plots(form: Literal["png", "svg"]) -> Write:
    def write(run: Run, path: Path, plot: str | None) -> Steps:
        from pftrack.output.figures.sheet import picture_of  # noqa: PLC0415 - it loads matplotlib

        path.write_bytes(picture_of(run, form, plot))
        yield 1, 1

    return write


def _still(run: Run) -> bytes:
    """Return the frame at which a run stands, with its worlds, as PNG, enlarged by a whole number."""
    from pftrack.vision.rendering import png, render_beside  # noqa: PLC0415 - only who wants a picture has to wait for it

    drawing = without_faults(run.experiment.draw(run.current, run.diagnostics))
    scale = max(1, round(SMALLEST_STILL_PX / drawing.width))
    return png(render_beside(drawing, layers=run.experiment.display.shown, scale=scale))


def _of_frame(offered: Export) -> RunExport:
    def make(run: Run) -> bytes:
        return offered.make(run.current.state, run.diagnostics[: run.position + 1])

    fields = {name: getattr(offered, name) for name in ("name", "title", "suffix", "media_type")}
    return RunExport(**fields, group="model", write=_at_once(make))


def _manifest(run: Run) -> bytes:
    return f"{json.dumps(manifest_of(run), indent=1, ensure_ascii=False)}\n".encode()


def _recipe(run: Run) -> bytes:
    recipe = run.recipe.with_footage(path=None).as_dict()
    return f"{json.dumps(recipe, indent=2, ensure_ascii=False)}\n".encode()


def _boxes(name: str) -> Write:
    """Return what writes boxes, given the name of the export: which of them, and the form."""
    which, _, form = name.partition("-")
    make = files.believed_file if which == "boxes" else files.true_file
    return _at_once(lambda run: make(run, cast("Form", form)))


WRITERS: Mapping[str, Write] = {
    "csv": _table(files.csv_of),
    "parquet": _table(files.parquet_of),
    "npz": _table(files.npz_of),
    "jsonl": _table(files.json_lines_of),
    "mp4": _table(files.mp4_of),
    "gif": _table(files.gif_of),
    "png": _plots("png"),
    "svg": _plots("svg"),
    "frame-png": _at_once(_still),
    "html": write_page,
    "notebook": _at_once(files.run_notebook),
    "recipe": _at_once(_recipe),
    "bibtex": _at_once(lambda run: bibtex_of(run).encode()),
}
"""What writes what every run can be exported as."""

EVERY = tuple(
    RunExport(**fields, write=WRITERS.get(name) or _boxes(name)) for name, fields in read_kinds("runs.yaml").items()
)
FORMATS = tuple(it for it in EVERY if it.name in WRITERS)
"""What every run can be exported as, in the order in which it is listed."""

BELIEVED, TRUE = (tuple(it for it in EVERY if it.group == group) for group in ("boxes", "truth"))
"""What a run of a target with a box can be exported as besides."""

# While a recording is written, the scene follows the newest frame. The recorder says whenever something has been
# written; the file is read as far as it is whole, and the newest frames become a run that takes the place of the one
# that is shown. The loop waits for none of it.

SPAN = 1000
"""Frames: so many at least, and twice as many at most, are computed anew whenever something has been written."""

GROWING = "0" * 64
"""In the place of a digest: what grows has none yet."""


class Watcher:
    """Shows a recording that is being written.

    Attributes:
        shown: The scene; None before there is a frame.
        failure: Why it is not shown; None as long as it is.
    """

    def __init__(
        self, experiment: Experiment, path: Path, *, clip: Path | None = None, browser: bool | None = None
    ) -> None:
        """Begin to watch, in a thread of its own.

        Args:
            experiment: What shows recordings of beliefs.
            path: The file.
            clip: The clip that it is of, where that is not in it.
            browser: Whether to open a browser; as `show` does if not given.
        """
        self._experiment, self._path, self._clip, self._browser = experiment, path, clip, browser
        self.shown: Shown | None = None
        self.failure: Exception | None = None
        self._index: FrameIndex | None = None
        self._news, self._is_over = threading.Event(), False
        self._thread = threading.Thread(target=self._watch, name="pftrack watcher", daemon=True)
        self._thread.start()

    def tell(self) -> None:
        """Say that something has been written."""
        self._news.set()

    def end(self) -> None:
        """Say that nothing more will be written; the last frame is shown, and the scene stays open."""
        self._is_over = True
        self._news.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._is_over and self.failure is None:
            self._news.wait()
            self._news.clear()
            try:
                self._show()
            except RefusedError:
                continue  # nothing whole is in the file yet
            except Exception as error:  # noqa: BLE001 - the loop goes on, whatever is wrong with a picture of it
                self.failure = error

    def _show(self) -> None:
        run = self._newest()
        if self.shown is None:
            self.shown = show(run, browser=self._browser)
        else:
            self.shown.follow(run)

    def _newest(self) -> Run:
        """Return the newest frames as a run that stands at the last."""
        sequence = BeliefSequence(
            self._path.open("rb"),
            name=self._path.name,
            sha256=GROWING,
            limits=DEFAULT_LIMITS,
            index=self._index,
            clip=self._clip,
        )
        self._index = sequence.index
        if not self._experiment.accepts_video:
            raise ValueError(f"{self._experiment.id} takes no recording")
        last = min(sequence.content.last - sequence.first, sequence.frame_count - 1)
        setup = self._experiment.video.on_video(sequence, None, start=max(last // SPAN - 1, 0) * SPAN)
        start = 0 if setup.footage is None else setup.footage.start
        run = Run(self._experiment, setup, frames=last - start + 1)
        run.finish()
        return run
