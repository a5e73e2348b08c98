"""The recording of a sweep, as workers get it, and what computes a sweep again: a few lines of Python, and a command.

A process of this machine opens the file where it is. A worker elsewhere gets the file's content once, keeps it in a
folder of its own for as long as it lives, and knows it by its hash. Either way it is refused if it is another one.
"""

import io
import shlex
import tempfile
import threading
import zipfile
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from pftrack.core.model.recipe import Footage
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import FrameIndex, FrameSequence
from pftrack.runs.reproduction import SourceCode
from pftrack.sources.limits import DEFAULT_LIMITS, Limits
from pftrack.sources.sequence import open_sequence
from pftrack.sweep.plan import Plan


@dataclass(frozen=True, slots=True)
class Recording:
    """A recording on this machine.

    Attributes:
        path: The file, or the folder of pictures.
        index: What is known of its frames, as JSON; None to look.
        limits: How large it may be.
    """

    path: str
    index: str | None = None
    limits: Limits = DEFAULT_LIMITS


@dataclass(frozen=True)
class Packed:
    """A recording on its way.

    Attributes:
        name: Of the file, or of the folder.
        folder: Whether it is one.
        data: A zip archive of it, stored as it is.
    """

    name: str
    folder: bool
    data: bytes


def pack(recording: Recording) -> Packed:
    """Return a recording as it travels.

    Raises:
        OSError: It cannot be read.
    """
    path, data = Path(recording.path), io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_STORED, strict_timestamps=False) as archive:
        for each in sorted(path.iterdir()) if path.is_dir() else [path]:
            if each.is_file():
                archive.write(each, each.name)
    return Packed(path.name, path.is_dir(), data.getvalue())


def setup_of(plan: Plan, given: "Recording | Packed | None") -> Setup:
    """Return what the runs of a plan are on; it is opened once in a process.

    Raises:
        RecordError: It is another recording than the plan's, or does not show the target.
        SourceError: It cannot be read.
    """
    if plan.footage is None or given is None:
        return plan.setup()
    place = given if isinstance(given, Recording) else _unpack(plan.footage.sha256 or "", given)
    return plan.setup(partial(_open, place))


def _open(place: Recording, footage: Footage) -> FrameSequence:
    index = None if place.index is None else FrameIndex.from_json(place.index)
    return open_sequence(Path(place.path), place.limits, index=index, square=footage.square)


_UNPACKED: dict[str, tuple[tempfile.TemporaryDirectory[str], Recording]] = {}
"""By hash; the folders go with the process."""


_UNPACKING = threading.Lock()


def _unpack(sha256: str, packed: Packed) -> Recording:
    with _UNPACKING:
        if sha256 not in _UNPACKED:
            folder = tempfile.TemporaryDirectory(prefix="pftrack-recording-")
            with zipfile.ZipFile(io.BytesIO(packed.data)) as archive:
                archive.extractall(folder.name)
            path = Path(folder.name) if packed.folder else Path(folder.name, packed.name)
            _UNPACKED[sha256] = folder, Recording(str(path))
        return _UNPACKED[sha256][1]


OUT = "sweep.parquet"


def sweep_code(plan: Plan) -> SourceCode:
    """Return what carries out a plan and prints its table; a recording is looked for where the command runs."""
    recording = plan.footage.name or "recording.mp4" if plan.footage else None
    trackers = [f"{name}.py" if name in plan.filters else name for name in plan.trackers]
    words = ["pftrack", "sweep", plan.experiment]
    for axis in plan.axes:
        words += ["--axis", f"{axis.name}={','.join(map(str, axis.values))}"]
    words += ["--trackers", ",".join(trackers), "--trials", str(plan.trials), "--frames", str(plan.frames)]
    words += ["--seed", str(plan.seed), *(["--loss-probability"] if plan.loss_probability else [])]
    for name, value in plan.values.items():
        words += ["--set", f"{name}={value}"]
    said = [] if plan.footage is None else _footage_options(plan.footage, recording or "")
    where = "" if recording is None else f", recording=Recording({recording!r})"
    python = _python(plan, where)
    if said is None:
        return SourceCode(python, f"python - <<'EOF'\n{python}EOF\n")
    command = " ".join(map(shlex.quote, [*words, *said, "--out", OUT]))
    return SourceCode(python, f"{command}\n")


def _footage_options(footage: Footage, recording: str) -> list[str] | None:
    """Return the options that say what a plan does of its recording; None where only the plan itself can say it."""
    mark = footage.mark
    if footage.truth or (mark is not None and mark.get("kind") != "box"):
        return None
    box = [] if mark is None else ["--box", ",".join(str(mark[name]) for name in ("x", "y", "width", "height"))]
    return ["--video", recording, *box, "--start", str(footage.start)]


def _python(plan: Plan, recording: str) -> str:
    told = "".join(f"        {key!r}: {value!r},\n" for key, value in plan.as_dict().items() if value is not None)
    names = "Plan, Recording, carry_out, summary" if recording else "Plan, carry_out, summary"
    return (
        f"from pathlib import Path\n\nfrom pftrack.sweep import {names}\n\n"
        f'if __name__ == "__main__":  # its processes import this file\n'
        f"    plan = Plan.from_dict({{\n{told}    }})\n"
        f'    result = carry_out(plan, Path("{OUT}"), jobs=2{recording})\n'
        f"    print(summary(result))\n"
    )
