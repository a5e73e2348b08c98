"""Work and workers: a plan measured, a chunk computed, and the processes, here or elsewhere, that do it.

Measuring and computing are functions of plain values, so that a process of the pool and a worker of a cluster do the
same. A plan travels as text and is understood once in a process.
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

# The recording of a sweep, as workers get it, and what computes a sweep again: a few lines of Python, and a command.
#
# A process of this machine opens the file where it is. A worker elsewhere gets the file's content once, keeps it in a
# folder of its own for as long as it lives, and knows it by its hash. Either way it is refused if it is another one.


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
        RefusedError: It cannot be read, is another recording than the plan's, or does not show the target.
    """
    if plan.footage is None or given is None:
        return plan.setup()
    place = given if isinstance(given, Recording) else _unpack(plan.footage.sha256 or "", given)
    return plan.setup(lambda footage: place.open(square=footage.square))


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


Given: TypeAlias = "Recording | Packed | None"

MEASURED_S = 0.5
"""How long a plan is measured at most, beyond the first condition."""

MEASURED_CONDITIONS = 9
MEASURED_TRIALS = 10
UNKNOWN_S = 1e-3
"""What a run is taken to cost where none of those looked at is possible."""


def as_text(plan: Plan) -> str:
    """Return a plan as it travels to workers."""
    return json.dumps(plan.as_dict(), sort_keys=True)


def compute_chunk(text: str, conditions: int, trials: int, number: int, recording: Given = None) -> bytes:
    """Carry out a chunk and return its Parquet file.

    Args:
        text: The plan.
        conditions: Whole conditions in a chunk.
        trials: Trials in a chunk.
        number: Of the chunk.
        recording: That of the plan, where it is on one.
    """
    plan, setup = _plan(text), _setup(text, recording, threading.get_ident())
    table = compute(plan, Chunks(plan, conditions, trials)[number], setup).replace_schema_metadata(metadata(plan))
    sink = arrow.BufferOutputStream()
    arrow.parquet.write_table(table, sink, compression="zstd", write_page_checksum=True)
    return bytes(sink.getvalue().to_pybytes())


def measure(text: str, recording: Given = None) -> float:
    """Return how long a run of a plan takes, s, from a few conditions all over it."""
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
    """Return the version of pftrack here."""
    return __version__


def one_thread() -> None:
    """Keep the libraries from starting threads: there is a process for every core already."""
    cv2.setNumThreads(1)
    arrow.set_cpu_count(1)


@lru_cache(maxsize=4)
def _plan(text: str) -> Plan:
    raw = json.loads(text)
    # Whoever has started this process has looked at the plan already.
    trust(*(each for texts in raw.get("filters", {}).values() for each in texts))
    return Plan.from_dict(raw)


@lru_cache(maxsize=4)
def _setup(text: str, recording: Given, thread: int) -> Setup:
    """Return what a plan's runs are on; each thread has a decoder of its own."""
    del thread
    return setup_of(_plan(text), recording)


# The driver hands out tasks by number, as many as there are free workers, and takes back what is done. A worker that is
# lost gives its task back; the driver decides whether it is tried again.


@dataclass(frozen=True, slots=True)
class Done:
    """What became of a task.

    Attributes:
        number: Of the task.
        value: What it returned.
        lost: How its worker was lost, in words, or empty.
    """

    number: int
    value: Any = None
    lost: str = ""


class Workers(Protocol):
    """A pool of processes or a cluster."""

    def free(self) -> int:
        """Return how many more tasks can be given out without keeping them waiting for long."""

    def share(self, recording: Recording | None) -> object:
        """Return what tasks are given in the place of a recording of this machine, so that all workers have it."""

    def start(self, number: int, function: Callable[..., Any], *arguments: object) -> None:
        """Give out a task: a function of a module and plain values.

        Raises:
            SweepError: There is nobody to take it any more.
        """

    def collect(self, timeout_s: float) -> list[Done]:
        """Return what was done since the last call, after waiting for something at most so long.

        Raises:
            SweepError: A task failed, or all workers are gone.
        """

    def close(self) -> None:
        """Let all workers go, whatever they are doing."""


# In the pool of this machine the loss of a process is seen at once and costs its own task alone, and when the driver is
# lost, all of them end.

PRELOAD = "pftrack.sweep.preload"

_PREPARED: list[ForkServer] = []


def prepare() -> None:
    """Fork the server of the next pool off this process, which has imported everything and started no thread."""
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
    """Some processes; each takes one task at a time."""

    def __init__(self, jobs: int) -> None:
        """Begin with `jobs` processes."""
        self._pool = open_pool(jobs)
        self._numbers: dict[Future[Any], int] = {}

    def free(self) -> int:
        """Return how many processes have nothing to do."""
        return self._pool.processes - len(self._numbers)

    def share(self, recording: Recording | None) -> Recording | None:
        """Return the recording: a process of this machine opens it where it is."""
        return recording

    def start(self, number: int, function: Callable[..., Any], *arguments: object) -> None:
        """Give a task to a process that has nothing to do; one that was lost meanwhile is replaced."""
        self._numbers[self._pool.submit(function, *arguments)] = number

    def collect(self, timeout_s: float) -> list[Done]:
        """Return what was done; a process that was lost is replaced.

        Raises:
            SweepError: A task failed, or the system makes no process.
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
