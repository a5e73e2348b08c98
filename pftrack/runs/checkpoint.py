"""Kept states of a run: keyframes for seeking, and checkpoints that save computing a run again.

A checkpoint is a file for convenience, not a record: it holds the states of one version of the program on one machine,
and a program that cannot read it computes the run again. So it is written without waiting for the disk, and a checksum
reveals a truncated file. States are the trackers' own classes and therefore pickled; the reader admits only these
classes and NumPy's arrays, so a file can build values but call nothing.
"""

import dataclasses
import enum
import io
import pickle
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pftrack.core.files import part_of
from pftrack.core.model.tracker import Diagnostics, TrackState
from pftrack.core.version import __version__

HEAD = f"pftrack checkpoint 1, pftrack {__version__}\n".encode()
CHECKSUM_BYTES = 4
ARRAYS = {
    ("numpy", "dtype"),
    ("numpy", "ndarray"),
    ("numpy._core.multiarray", "_reconstruct"),
    ("numpy._core.multiarray", "scalar"),
    ("numpy._core.numeric", "_frombuffer"),
}
"""Functions that unpickle NumPy's arrays and numbers."""


BUDGET_BYTES = 32 * 1024 * 1024

STATE_BYTES = 1024
"""Approximate memory of a state without its arrays."""

_PLAIN = str, int, float, type(None)


def bytes_of(value: object, known: set[int]) -> int:
    """Return the memory of all new arrays within a value, bytes, and add them to the known ones.

    A view counts as the whole array that it keeps alive.

    Args:
        value: A state: arrays, and dataclasses, other objects, tuples, lists and mappings of these, possibly circular.
        known: Ids of objects that were counted already, since states share what stays the same from frame to frame.
    """
    total, waiting = 0, [value]
    while waiting:
        part: Any = waiting.pop()
        if isinstance(part, _PLAIN) or id(part) in known or callable(part):
            continue
        known.add(id(part))
        if isinstance(part, np.ndarray):
            total += 0 if isinstance(part.base, np.ndarray) else part.nbytes
            waiting.append(part.base)
        elif isinstance(part, tuple | list | Mapping):
            waiting += part.values() if isinstance(part, Mapping) else part
        else:
            waiting += [getattr(part, name, None) for name in getattr(part, "__dataclass_fields__", ())]
            waiting += getattr(part, "__dict__", {}).values()
    return total


class Keyframes:
    """States at regular intervals within a memory budget; the interval doubles when the budget is used up.

    The newest state is kept as well, so that returning from the past repeats no step.
    """

    def __init__(self, interval: int = 8, budget_bytes: int = BUDGET_BYTES) -> None:
        """Begin with a state every `interval` frames."""
        self._interval = interval
        self._budget_bytes = budget_bytes
        self._states: dict[int, TrackState] = {}
        self._newest: dict[int, TrackState] = {}
        self._bytes, self._known = 0, set[int]()

    def offer(self, frame: int, state: TrackState) -> None:
        """Keep the state of a new frame: for good if its frame is due (frame 0 always is), else until the next one."""
        if frame >= max(self._newest, default=0):
            self._newest = {frame: state}
        if frame % self._interval or frame in self._states:
            return
        self._keep(frame, state)
        while self._bytes > self._budget_bytes and len(self._states) > 1:
            self._interval *= 2
            states, self._states, self._bytes, self._known = self._states, {}, 0, set()
            for index, kept in states.items():
                if index % self._interval == 0:
                    self._keep(index, kept)

    def _keep(self, frame: int, state: TrackState) -> None:
        self._states[frame] = state
        self._bytes += STATE_BYTES + bytes_of(state, self._known)

    def latest(self, frame: int) -> tuple[int, TrackState]:
        """Return the newest kept frame number at or before a frame, and its state."""
        index = max(kept for kept in self.states if kept <= frame)
        return index, self.states[index]

    def until(self, frame: int) -> "Keyframes":
        """Return the keyframes up to a frame; the states are shared."""
        twin = Keyframes(self._interval, self._budget_bytes)
        for index, state in self.states.items():
            if index <= frame:
                twin.offer(index, state)
        return twin

    @property
    def states(self) -> dict[int, TrackState]:
        """All kept states in ascending order of frames."""
        return self._states | self._newest


@dataclasses.dataclass(frozen=True, slots=True)
class Checkpoint:
    """The computed part of a run.

    Attributes:
        recipe: Recipe as JSON, with the changes up to the last frame.
        diagnostics: Rows of all frames.
        states: States of some frames, including frame 0 and the last one.
    """

    recipe: str
    diagnostics: tuple[Diagnostics, ...]
    states: Mapping[int, TrackState]


def write(checkpoint: Checkpoint, path: Path) -> None:
    """Write a checkpoint to a file, which replaces an earlier one only when it is complete.

    Raises:
        OSError: The file cannot be written.
        ValueError: A state cannot be written to any file.
    """
    try:
        # In one piece: states share what stays the same from frame to frame, also after they are read.
        body = pickle.dumps((checkpoint.recipe, checkpoint.diagnostics, dict(checkpoint.states)), protocol=5)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise ValueError(f"the tracker's states cannot be written to a file: {error}") from None
    part = part_of(path)
    try:
        with part.open("wb") as file:
            file.write(HEAD)
            file.write(zlib.crc32(body).to_bytes(CHECKSUM_BYTES, "big"))
            file.write(body)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def read(path: Path, package: str) -> Checkpoint | None:
    """Read a checkpoint; return None if there is none that this version can use.

    Args:
        path: The file.
        package: Package of the run's experiment; only its classes and those of `pftrack` are admitted.
    """
    try:
        data = path.read_bytes()
    except OSError:
        return None
    head, checksum = data[: len(HEAD)], data[len(HEAD) : len(HEAD) + CHECKSUM_BYTES]
    body = memoryview(data)[len(HEAD) + CHECKSUM_BYTES :]
    if head != HEAD or zlib.crc32(body).to_bytes(CHECKSUM_BYTES, "big") != checksum:
        return None
    try:
        return Checkpoint(*_Values(io.BytesIO(body), {"pftrack", package}).load())
    # A file of another version of a package may fail in any way; then there is no checkpoint.
    except Exception:  # noqa: BLE001
        return None


class _Values(pickle.Unpickler):
    """Reads only values: dataclasses, named tuples and enumerations of some packages, and NumPy's arrays."""

    def __init__(self, file: io.BytesIO, packages: set[str]) -> None:
        super().__init__(file)
        self._packages = packages

    def find_class(self, module_name: str, global_name: str, /) -> Any:  # noqa: ANN401 - pickle's own
        """Return an admitted class.

        Raises:
            pickle.UnpicklingError: The class is not admitted.
        """
        if (module_name, global_name) in ARRAYS:
            return super().find_class(module_name, global_name)
        if module_name.partition(".")[0] in self._packages:
            found = super().find_class(module_name, global_name)
            if isinstance(found, type) and (dataclasses.is_dataclass(found) or issubclass(found, tuple | enum.Enum)):
                return found
        raise pickle.UnpicklingError(f"{module_name}.{global_name} is not a class of values")
