"""Work and workers: measuring a plan, computing a chunk, and the local or remote processes that do so.

Measuring and computing are functions of plain values, so that a process of the pool and a worker of a cluster do the
same. A plan is sent as text and parsed once per process.
"""

import io
import json
import shlex
import tempfile
import threading
import zipfile
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from pathlib import Path
from time import perf_counter
from typing import Any, Protocol, TypeAlias

import cv2

from pftrack.core.model.recipe import Footage
from pftrack.core.model.setup import Setup
from pftrack.core.version import __version__
from pftrack.experiments.own.code import trust
from pftrack.process import UNLIMITED, BlockingPool, CallError, ForkServer, WorkerLostError
from pftrack.runs.reproduction import SourceCode
from pftrack.sources.sequence import Recording
from pftrack.sweep import arrow
from pftrack.sweep.axis import SweepError
from pftrack.sweep.journal import metadata
from pftrack.sweep.plan import Plan
from pftrack.sweep.table import Chunks, carry_out_trials, compute

# The recording of a sweep for its workers, and the code that reproduces a sweep.
#
# A process of this machine opens the file in place. A remote worker gets the file's content once, keeps it in a
# temporary folder, and identifies it by its hash. Both refuse a recording with another hash.


@dataclass(frozen=True)
class Packed:
    """A recording packed for a remote worker.

    Attributes:
        name: Name of the file or folder.
        folder: Whether it is a folder.
        data: Uncompressed zip archive of it.
    """

    name: str
    folder: bool
    data: bytes


def pack(recording: Recording) -> Packed:
    """Pack a recording for remote workers.

    Raises:
        OSError: The recording cannot be read.
    """
    path, data = Path(recording.path), io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_STORED, strict_timestamps=False) as archive:
        for each in sorted(path.iterdir()) if path.is_dir() else [path]:
            if each.is_file():
                archive.write(each, each.name)
    return Packed(path.name, path.is_dir(), data.getvalue())


def setup_of(plan: Plan, given: "Recording | Packed | None") -> Setup:
    """Return the source of a plan's runs, opened once per process.

    Raises:
        RefusedError: The recording cannot be read, is not that of the plan, or does not show the target.
    """
    if plan.footage is None or given is None:
        return plan.setup()
    place = given if isinstance(given, Recording) else _unpack(plan.footage.sha256 or "", given)
    return plan.setup(lambda footage: place.open(square=footage.square))


_UNPACKED: dict[str, tuple[tempfile.TemporaryDirectory[str], Recording]] = {}
"""Unpacked recordings by hash; their folders are removed with the process."""


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
    """Return the code that computes a plan and prints its summary, with a recording in the working folder."""
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
    """Return the command line options for a plan's recording; None if options cannot express it."""
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


Given: TypeAlias = "Recording | Packed | None"

MEASURED_S = 0.5
"""Longest time to measure a plan after its first condition."""

MEASURED_CONDITIONS = 9
MEASURED_TRIALS = 10
UNKNOWN_S = 1e-3
"""Assumed time of a run if none of the measured ones is possible."""


def as_text(plan: Plan) -> str:
    """Return a plan as text for workers."""
    return json.dumps(plan.as_dict(), sort_keys=True)


def compute_chunk(text: str, conditions: int, trials: int, number: int, recording: Given = None) -> bytes:
    """Compute a chunk and return its Parquet file.

    Args:
        text: The plan as text.
        conditions: Number of complete conditions in a chunk.
        trials: Number of trials in a chunk.
        number: Number of the chunk.
        recording: Recording of the plan, if any.
    """
    plan, setup = _plan(text), _setup(text, recording, threading.get_ident())
    table = compute(plan, Chunks(plan, conditions, trials)[number], setup).replace_schema_metadata(metadata(plan))
    sink = arrow.BufferOutputStream()
    arrow.parquet.write_table(table, sink, compression="zstd", write_page_checksum=True)
    return bytes(sink.getvalue().to_pybytes())


def measure(text: str, recording: Given = None) -> float:
    """Return the mean time of a run, s, measured in a few conditions spread over the plan."""
    plan, setup = _plan(text), _setup(text, recording, threading.get_ident())

    def took(number: int, trials: int, frames: int) -> float:
        condition = plan.condition(number)
        values, seeds = {**plan.values, **condition}, plan.seeds(condition, 0, trials)
        begun = perf_counter()
        carry_out_trials(plan, setup, values, plan.trackers, seeds, frames)
        return perf_counter() - begun

    seconds, runs, trials = 0.0, 0, 1
    order = Chunks(plan, 1, plan.trials).spread()
    for number in map(int, islice(order, MEASURED_CONDITIONS)):
        try:
            if not runs:
                took(number, 1, min(plan.frames, 4))  # loads what is compiled
            seconds += took(number, trials, plan.frames)
        except Exception:  # noqa: BLE001, S112 - its rows will say what is wrong with it
            continue
        runs += trials * len(plan.trackers)
        if seconds > MEASURED_S:
            break
        affordable = MEASURED_S / 4 / (len(plan.trackers) * seconds / runs)
        trials = min(plan.trials, MEASURED_TRIALS, max(1, int(affordable)))
    return seconds / runs if runs else UNKNOWN_S


def version() -> str:
    """Return the version of pftrack in this process."""
    return __version__


def one_thread() -> None:
    """Keep libraries from starting threads, because there is a process for every core."""
    cv2.setNumThreads(1)
    arrow.set_cpu_count(1)


@lru_cache(maxsize=4)
def _plan(text: str) -> Plan:
    raw = json.loads(text)
    # The process that started this one has checked the plan already.
    trust(*(each for texts in raw.get("filters", {}).values() for each in texts))
    return Plan.from_dict(raw)


@lru_cache(maxsize=4)
def _setup(text: str, recording: Given, thread: int) -> Setup:
    """Return the source of a plan's runs; each thread has its own decoder."""
    del thread
    return setup_of(_plan(text), recording)


# The driver gives numbered tasks to free workers and collects results. When a worker is lost, its task returns to the
# driver, which decides whether to retry it.


@dataclass(frozen=True, slots=True)
class Done:
    """The end of a task.

    Attributes:
        number: Number of the task.
        value: Its return value.
        lost: How its worker was lost, in words; empty if it was not.
    """

    number: int
    value: Any = None
    lost: str = ""


class Workers(Protocol):
    """A pool of processes or a cluster."""

    def free(self) -> int:
        """Return the number of further tasks that can start soon."""

    def share(self, recording: Recording | None) -> object:
        """Return the argument for tasks that gives all workers a recording of this machine."""

    def start(self, number: int, function: Callable[..., Any], *arguments: object) -> None:
        """Start a task: a function of a module with plain values.

        Raises:
            SweepError: No worker is left.
        """

    def collect(self, timeout_s: float) -> list[Done]:
        """Return the tasks that have ended since the last call, after waiting for one at most this long.

        Raises:
            SweepError: A task failed, or all workers are lost.
        """

    def close(self) -> None:
        """End all workers at once."""


# The local pool notices a lost process at once, which costs only its own task; without the driver all of them end.

PRELOAD = "pftrack.sweep.preload"

_PREPARED: list[ForkServer] = []


def prepare() -> None:
    """Fork the server of the next pool from this process, which has imported everything and has one thread."""
    made = _fresh()
    made.fork_off()
    _PREPARED.append(made)


def open_pool(jobs: int) -> BlockingPool:
    """Return a pool of `jobs` processes that compute with one thread each."""
    fork_server = _PREPARED.pop() if _PREPARED else _fresh()
    return BlockingPool(fork_server, processes=jobs, budget=UNLIMITED, prepare=one_thread)


def _fresh() -> ForkServer:
    return ForkServer(PRELOAD)


class LocalWorkers:
    """Local processes that run one task each at a time."""

    def __init__(self, jobs: int) -> None:
        """Begin with `jobs` processes."""
        self._pool = open_pool(jobs)
        self._numbers: dict[Future[Any], int] = {}

    def free(self) -> int:
        """Return the number of idle processes."""
        return self._pool.processes - len(self._numbers)

    def share(self, recording: Recording | None) -> Recording | None:
        """Return the recording unchanged, because local processes open it in place."""
        return recording

    def start(self, number: int, function: Callable[..., Any], *arguments: object) -> None:
        """Give a task to an idle process; a lost one is replaced."""
        self._numbers[self._pool.submit(function, *arguments)] = number

    def collect(self, timeout_s: float) -> list[Done]:
        """Return the ended tasks; a lost process is replaced.

        Raises:
            SweepError: A task failed, or the system cannot make a process.
        """
        return [self._take(each) for each in wait(self._numbers, timeout_s, FIRST_COMPLETED).done]

    def close(self) -> None:
        """End all processes."""
        self._pool.close()

    def _take(self, future: "Future[Any]") -> Done:
        number = self._numbers.pop(future)
        try:
            return Done(number, future.result())
        except WorkerLostError as error:
            return Done(number, lost=str(error))
        except (CallError, MemoryError, OSError) as error:
            raise SweepError(f"the computation failed: {error}") from None
