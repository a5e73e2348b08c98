"""The recording of a sweep, as workers get it: by its content.

A process of this machine opens the file where it is. A worker elsewhere gets the file's content once, keeps it in a
folder of its own for as long as it lives, and knows it by its hash. Either way it is refused if it is another one.
"""

import io
import tempfile
import threading
import zipfile
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from pftrack.core.model.recipe import Footage
from pftrack.core.model.sequence import FrameIndex, FrameSequence
from pftrack.experiments import Setup
from pftrack.sources.limits import DEFAULT_LIMITS, Limits
from pftrack.sources.sequence import open_sequence
from pftrack.sweep.plan import Plan

__all__ = ["Packed", "Recording", "pack", "setup_of"]


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
