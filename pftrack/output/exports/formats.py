"""Export formats and viewers of runs: one list for Python, command line, server and pages.

A format is a `RunExport`: a function that writes the computed part of a run to a file and reports its progress. The
suffix of the file name chooses the format. To add a format, write that function, add it to `WRITERS`, and describe it
in runs.yaml; every list of exports then has it. An experiment can offer more files for the current frame of a run.

`exporting` and `export` write a file completely or not at all. A file that cannot hold its manifest gets a second file
with the suffix `.manifest.json`.
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

# The library draws runs as pictures and films, without a browser. Other packages provide viewers by entry points of the
# group `pftrack.viewers`: `page` writes a run as an HTML page that needs no server, `show` opens its scene on this
# machine. pftrack's own server provides both.

GROUP = "pftrack.viewers"


class Shown(Protocol):
    """A run shown in a browser."""

    @property
    def address(self) -> str:
        """Address for a browser on this machine."""

    @property
    def run(self) -> Run:
        """The shown run: the given one, or a branch of it after a change of a parameter."""

    def go(self, frame: int) -> None:
        """Show a frame, and compute it first if necessary."""

    def follow(self, run: Run) -> None:
        """Show a longer run instead, at its newest frame unless the viewer shows an earlier one."""

    def wait(self) -> None:
        """Wait until the viewer is closed or interrupted."""

    def close(self) -> None:
        """Close the viewer; a second call has no effect."""


def write_page(run: Run, path: Path, _plot: str | None = None) -> Iterator[tuple[int, int]]:
    """Write the computed part of a run as an HTML page that needs neither server nor network.

    Args:
        run: The run, which is moved to each of its frames.
        path: Path of the file.

    Yields:
        Number of frames done, and the total.

    Raises:
        ConflictError: No installed viewer provides `page`.
        OSError: The file cannot be written.
    """
    yield from load(GROUP, "page")(run, path)


def show(run: Run, *, port: int = 0, browser: bool | None = None) -> Shown:
    """Open the scene of a run on this machine.

    Args:
        run: The run, which stays unchanged. Changing a parameter next to the scene makes a branch.
        port: Port on this machine; 0 chooses a free one.
        browser: Whether to open a browser (default: unless in a notebook).

    Raises:
        ConflictError: No installed viewer provides `show`.
        OSError: The port is in use.
    """
    return cast("Shown", load(GROUP, "show")(run, port=port, browser=browser))


SMALLEST_STILL_PX = 1200
"""Width to which a small picture is enlarged so that lines and text are sharp."""

FULL = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}
"""Errors of a full disk or an exceeded limit."""

Steps: TypeAlias = Iterator[tuple[int, int]]
"""Progress of an export: (frames or parts written, total)."""

Group: TypeAlias = Literal["numbers", "boxes", "truth", "film", "plots", "documents", "model"]
"""Groups of exports in lists: numbers of all frames, estimated boxes, true boxes, films and scenes, pictures of plots,
documents that reproduce and cite the run, and files of the current frame."""


class Write(Protocol):
    """Write a run to a file."""

    def __call__(self, run: Run, path: Path, plot: str | None, /) -> Steps:
        """Write the file step by step.

        Args:
            run: The run; it may be moved to other frames.
            path: Path of a temporary file.
            plot: Id of the one plot to write in a format of the group "plots"; None for all plots.

        Raises:
            ConflictError: The run cannot be written in this format; the message says why.
            OSError: The file cannot be written.
        """


@with_config(ConfigDict(extra="forbid", revalidate_instances="subclass-instances"))
@dataclass(frozen=True, slots=True)
class FileKind:
    """A file format for runs or comparisons.

    Attributes:
        name: Name in commands and addresses.
        title: Title in a few words.
        suffix: Suffix of the file name, without the dot.
        media_type: Media type of the file.
        group: Group in lists.
        beside: Whether its manifest is a separate file.
        short: Short title within its group; the title if empty.
        origin: File and line of the declaration.
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
    """A file format for runs.

    Attributes:
        write: Function that writes the file.
    """

    write: Write


def read_kinds(name: str) -> dict[str, dict[str, Any]]:
    """Return by name the file formats that a YAML file of this package declares."""
    return {it.name: asdict(it) for it in read_as(FileKind, Path(__file__).with_name(name), "name")}


def exports_of(experiment: Experiment) -> tuple[RunExport, ...]:
    """Return all export formats for runs of an experiment."""
    believes = experiment.boxes is not None or extent_series(experiment.all_series()) is not None
    boxes = BELIEVED if believes else ()
    known = experiment.accepts_video and experiment.video.truth is BOXES
    true = TRUE if believes or known else ()
    return (*FORMATS, *boxes, *true, *map(_of_frame, experiment.exports))


def export_at(experiment: Experiment, path: Path, plot: str | None = None) -> RunExport:
    """Return the export for a file name: the one with the longest matching suffix.

    Args:
        experiment: Experiment of the run.
        path: Path of the file.
        plot: Id of the one plot to show in a picture.

    Raises:
        ConflictError: The format, the folder or the plot does not exist.
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
    # Of two formats with the same suffix, the experiment's own comes last and has precedence.
    found = max(reversed(fitting), key=lambda one: len(one.suffix))
    meant = next((one for one in (*BELIEVED, *TRUE) if name.endswith(f".{one.suffix}")), found)
    if len(meant.suffix) > len(found.suffix):
        raise ConflictError(f"{path.name} would hold boxes ({meant.title}), and runs of {experiment.id} have none")
    check_plot(experiment, found, plot)
    return found


def export(run: Run, path: Path, *, plot: str | None = None) -> Exported:
    """Write the computed part of a run to a file; the suffix chooses the format.

    Args:
        run: The run; its position stays.
        path: Path of the file; an existing file is replaced.
        plot: Id of the one plot to show in a picture (default: all).

    Raises:
        ConflictError: The format or the plot does not exist, or the run cannot be written in this format.
        OSError: The file cannot be written; an existing file is left as it was.
    """
    kind = export_at(run.experiment, path, plot)
    for _ in exporting(run, path, kind, plot):
        pass
    return Exported(files_of(kind, path), extent_of(run), run.computed + 1 == run.frames)


def exporting(run: Run, path: Path, kind: RunExport, plot: str | None = None) -> Steps:
    """Write a file as `export` does and yield the progress; if closed early, it leaves no file."""
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
        reason = os.strerror(error.errno)  # some libraries have their own wording, with the name of the temporary file
        if error.errno not in FULL:
            raise OSError(error.errno, reason, str(path)) from None
        raise ConflictError(f"{path.name} cannot be written: {reason}; make room, or export fewer frames") from None
    finally:
        part.unlink(missing_ok=True)
        if run.position != position:
            run.seek(position)


def files_of(kind: RunExport, path: Path) -> tuple[Path, ...]:
    """Return the files that an export writes: the requested one, and the manifest if it is a separate file."""
    return (path, _beside(path)) if kind.beside else (path,)


def check_plot(experiment: Experiment, kind: RunExport, plot: str | None) -> None:
    """Check that a format can show one plot.

    Raises:
        ConflictError: The format is not a picture of plots, or the plot does not exist.
    """
    known = [one.id for one in experiment.display.plots]
    if plot is not None and kind.group != "plots":
        raise ConflictError(f"a plot can be written as a picture, .png or .svg; got .{kind.suffix}")
    if plot is not None and plot not in known:
        raise ConflictError(f"{experiment.id} has no plot {plot!r}, only {', '.join(known)}")


def _beside(path: Path) -> Path:
    return path.with_name(f"{path.name}.manifest.json")


def _at_once(make: Callable[[Run], bytes]) -> Write:
    """Return a function that writes a file whose content is made in one step."""

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
    """Return the current frame of a run with its worlds as PNG, enlarged by a whole number."""
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
    """Return the function that writes boxes; the name of the export says which boxes in which form."""
    which, _, form = name.partition("-")
    make = files.believed_file if which == "boxes" else files.true_file
    return _at_once(lambda run: make(run, cast("Form", form)))


WRITERS: Mapping[str, Write] = {
    "csv": _table(files.csv_of),
    "parquet": _table(files.parquet_of),
    "npz": _table(files.npz_of),
    "cloud": _table(files.cloud_npz_of),
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
"""Functions that write the formats of every run."""

EVERY = tuple(
    RunExport(**fields, write=WRITERS.get(name) or _boxes(name)) for name, fields in read_kinds("runs.yaml").items()
)
FORMATS = tuple(it for it in EVERY if it.name in WRITERS)
"""Formats of every run, in the order of lists."""

BELIEVED, TRUE = (tuple(it for it in EVERY if it.group == group) for group in ("boxes", "truth"))
"""Additional formats of runs whose target has a box."""

# While a recording is written, the scene follows its newest frame. The recorder reports each write; the whole part of
# the file is read, and its newest frames become a run that replaces the shown one. The recording loop never waits.

SPAN = 1000
"""Frames that are recomputed after each write: at least this many, at most twice as many."""

GROWING = "0" * 64
"""Placeholder for the digest of a growing file."""


class Watcher:
    """A viewer of a recording that is being written.

    Attributes:
        shown: The scene; None before the first frame.
        failure: Why it is not shown; None while it is.
    """

    def __init__(
        self, experiment: Experiment, path: Path, *, clip: Path | None = None, browser: bool | None = None
    ) -> None:
        """Begin to watch in a separate thread.

        Args:
            experiment: Experiment that shows recordings of beliefs.
            path: The file.
            clip: Its clip, if the file does not name it.
            browser: Whether to open a browser (default: as for `show`).
        """
        self._experiment, self._path, self._clip, self._browser = experiment, path, clip, browser
        self.shown: Shown | None = None
        self.failure: Exception | None = None
        self._index: FrameIndex | None = None
        self._news, self._is_over = threading.Event(), False
        self._thread = threading.Thread(target=self._watch, name="pftrack watcher", daemon=True)
        self._thread.start()

    def tell(self) -> None:
        """Report a write."""
        self._news.set()

    def end(self) -> None:
        """Report the end of the recording; the scene stays open at the last frame."""
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
                continue  # the file has no complete part yet
            except Exception as error:  # noqa: BLE001 - the recording continues, whatever is wrong with its picture
                self.failure = error

    def _show(self) -> None:
        run = self._newest()
        if self.shown is None:
            self.shown = show(run, browser=self._browser)
        else:
            self.shown.follow(run)

    def _newest(self) -> Run:
        """Return the newest frames as a run at its last frame."""
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
