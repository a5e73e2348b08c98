"""The doctor finds missing parts, and compiles in other processes."""

import os
import socket
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.doctor import checks as doctor
from pftrack.doctor import memory, warming
from pftrack.doctor.checks import Check, examine
from pftrack.doctor.warming import Progress, Schedule, Warming
from pftrack.experiments.shared.sampling import loop_with
from pftrack.process import ForkServer
from tests.doctor.pretending import compile_little, pause, pretend, slow_down
from tests.process.conftest import server as server  # noqa: PLC0414 - a fixture


def found(checks: list[Check], name: str) -> Check:
    return next(check for check in checks if check.name == name)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the check that runs trackers."""
    monkeypatch.setattr(doctor, "_compilation", lambda *, everything: ("ok", f"everything: {everything}"))


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))


@pytest.fixture
def no_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Put the cache below a file, where it cannot be written."""
    (tmp_path / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "cache"))


def test_an_old_or_missing_library_is_broken(monkeypatch: pytest.MonkeyPatch) -> None:
    """The message names the required versions; numbers of versions are compared as numbers."""
    assert doctor._numbers("4.9") < doctor._numbers("4.12.0rc1") == (4, 12)
    needs = ["numpy>=99", "rich>=1,<2", "pftrack-nowhere>=1", "absent>=1; extra == 'bench'"]
    monkeypatch.setattr(doctor.metadata, "requires", lambda _name: needs)
    status, text = doctor._libraries()
    assert (status, "absent" in text) == ("broken", False)
    for words in (">=99 is needed", ">=1 and <2 is needed", "pftrack-nowhere is missing"):
        assert words in text


@pytest.mark.usefixtures("quick")
def test_what_a_server_needs_is_examined(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A port in use is not broken, since another can be chosen; a new folder of data is fine if it can be made.

    The folder comes from the argument or the environment. A check that fails itself is broken, for the reason that its
    error has in its first line.
    """

    def fail() -> tuple[doctor.Status, str]:
        raise ImportError("libsomething.so is missing\nand more")

    monkeypatch.setattr(doctor, "_codecs", fail)
    monkeypatch.setenv("PFTRACK_DATA_DIR", str(tmp_path / "new" / "data"))
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        checks = examine(port=taken.getsockname()[1])
    port = found(checks, "port")
    assert (port.status, "--port" in port.found) == ("warning", True)
    assert found(checks, "video") == Check("video", "broken", "ImportError: libsomething.so is missing")
    assert str(tmp_path / "new" / "data") in found(checks, "data folder").found
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "file").touch()
    check = found(examine(data_dir=tmp_path / "file" / "data"), "data folder")
    assert (check.status, "--data-dir" in check.found) == ("broken", True)


@pytest.mark.usefixtures("no_cache")
def test_without_a_place_for_compiled_code_there_is_a_warning() -> None:
    """The doctor warns that each start compiles again; that is not an error."""
    check = doctor._compilation(everything=False)
    assert (check.status, "NUMBA_CACHE_DIR" in check.found) == ("warning", True)
    memory.remember("one")
    assert memory.ready(["one"]) == frozenset()


def test_compiled_functions_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    """`doctor --warm --json` has the time of each function, the slowest first; a failure is broken."""
    done = Progress(seconds={"a": 1.0, "b": 2.5}, elapsed_s=2.0, finished=True)
    monkeypatch.setattr(Warming, "__init__", lambda self, names, **_: None)
    monkeypatch.setattr(Warming, "wait", lambda self: done)
    check = doctor._compilation(everything=True)
    assert check.found.startswith("2 functions compiled now, in 2 s; kept in ")
    assert list(check.as_dict()["seconds"].items()) == [("b", 2.5), ("a", 1.0)]
    monkeypatch.setattr(Warming, "wait", lambda self: Progress(failed={"sine": "no"}, finished=True))
    assert doctor._compilation(everything=True) == Check("compiled code", "broken", "sine: no")


LIVE = """
from pathlib import Path
from pftrack.doctor import checks as doctor
from pftrack.experiments import EXPERIMENTS
from pftrack.runs.run import Change, Run
from tests.making import whole_run
def compiled():
    return sorted(str(file) for file in Path({folder!r}).rglob("*.nbc"))
doctor._compilation(everything=True)
before = compiled()
assert len(before) > 50, before
for experiment in EXPERIMENTS.values():
    for preset in experiment.presets:
        timeline = (Change(0, preset.parameters),)
        run = whole_run(experiment, tracker=preset.tracker, frames=6, timeline=timeline)
for name, value in (("apf_weights", "corrected"), ("upper_layer", "perspective"), ("pose_estimator", "particle")):
    for experiment in EXPERIMENTS.values():
        setup = experiment.simulate()
        if name in type(setup.parameters).model_fields:
            run = Run(experiment, setup, frames=6)
            run.change({{name: value}})
            run.finish()
print(*sorted(set(compiled()) - set(before)))
"""


@pytest.mark.slow
def test_after_warming_nothing_is_compiled_in_a_session(tmp_path: Path) -> None:
    """Neither a preset nor a live choice waits for the compiler."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    script = LIVE.format(folder=str(tmp_path))
    done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.strip()) == (0, ""), done.stderr


def test_a_browser_is_found(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The shell without windows counts; otherwise the doctor lists the names that it looked for."""
    monkeypatch.setenv("PATH", str(tmp_path))
    status, text = doctor._browser()
    assert (status, text.startswith("none of chromium-headless-shell, chromium, ")) == ("warning", True)
    shell = tmp_path / "chromium-headless-shell"
    shell.touch(0o755)
    assert doctor._browser() == ("ok", str(shell))


# Compilation in other processes, by functions that only pretend.


@compiled
def silent(image_rgb: NDArray[np.uint8], states: NDArray[np.float64], packed: tuple[float, ...]) -> NDArray[np.float64]:
    """Return the log likelihoods (N,) of a likelihood that says nothing."""
    return np.zeros(states.shape[0])


def share(made: ForkServer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have compilations fork their processes from one server, which outlives them."""
    monkeypatch.setattr(warming, "ForkServer", lambda _: Mock(wraps=made, close=Mock()))


@pytest.fixture
def pretending(own_cache: None, server: ForkServer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Compilations have a cache of their own, and processes that import little."""
    share(server, monkeypatch)


@pytest.mark.usefixtures("pretending")
def test_progress_comes_with_every_function() -> None:
    """Functions add up, experiments get ready one by one, and each case is compiled once."""
    told: list[Progress] = []
    done = Warming(["one", "two", "three"], processes=2, told=told.append, compile_case=pretend).wait()
    assert (done.finished, done.sentence) == (True, "compiled")
    assert (done.done, done.total, done.ready) == (6, 6, {"one", "two", "three"})
    assert done.seconds == {f"{name}.{part}": 0.5 for name in done.ready for part in "ab"}
    counts = [progress.done for progress in told]
    assert counts == sorted(counts)
    assert any(progress.ready and not progress.finished for progress in told)
    assert memory.ready(["two", "four"]) == {"two"}


@pytest.mark.usefixtures("pretending")
@pytest.mark.parametrize(
    ("bad", "reason", "processes"), [("broken", "ValueError: no", 1), ("dies", "ended with status 3", 2)]
)
def test_a_failing_experiment_affects_no_other(bad: str, reason: str, processes: int) -> None:
    """An experiment that raises an error, or ends its process, is reported with the reason; the others get ready."""
    done = Warming([bad, "one"], processes=processes, compile_case=pretend).wait()
    assert (done.finished, reason in done.failed[bad]) == (True, True)
    assert done.ready == memory.ready([bad, "one"]) == {"one"}


def test_a_schedule_spreads_cases_over_processes() -> None:
    """First come the defaults of all experiments, then a process's own cases, then the fullest one's last cases."""
    schedule = Schedule(["short", "long", "tiny"])
    assert [schedule.take(None), schedule.take(None)] == [("short", 0), ("long", 0)]
    schedule.on_begin("short", 3)
    schedule.on_begin("long", 5)
    assert schedule.take("short") == ("tiny", 0)
    schedule.on_begin("tiny", 1)
    assert (schedule.done("tiny"), schedule.done("short")) == (True, False)
    assert schedule.take("tiny") == ("long", 4)
    assert [schedule.take("short"), schedule.take("short")] == [("short", 1), ("short", 2)]
    assert [schedule.take("long") for _ in range(3)] == [("long", 1), ("long", 2), ("long", 3)]
    assert [schedule.done("long") for _ in range(5)] == [False] * 4 + [True]
    assert not schedule
    schedule.on_begin("tiny", 4)
    assert schedule
    schedule.give_up("tiny")
    assert schedule.take("long") is None


def test_a_preferred_experiment_comes_first() -> None:
    """It precedes a process's own cases and other experiments."""
    schedule = Schedule(["first", "second", "third"])
    assert schedule.take(None) == ("first", 0)
    schedule.on_begin("first", 3)
    schedule.prefer("third")
    assert schedule.take("first") == ("third", 0)
    assert schedule.take("first") == ("second", 0)  # the third's number of cases is unknown
    schedule.on_begin("third", 2)
    assert [schedule.take("first"), schedule.take("first")] == [("third", 1), ("first", 1)]


@pytest.mark.usefixtures("pretending")
def test_the_time_left_never_rises() -> None:
    """It is the mean processor time of the functions so far, times the number of others; it stays if that rises.

    Progress is a sentence with the number of functions.
    """
    told: list[Progress] = []
    Warming(["one"], processes=1, told=told.append, compile_case=slow_down).wait()
    left = [progress.left_s for progress in told if progress.left_s is not None]
    assert left[0] == pytest.approx((2**5 - 1) / 5 * 15)  # of five functions, for fifteen
    assert left == sorted(left, reverse=True)
    words = "compiling, 14 of 41 functions, about 40 s on an idle machine, only once"
    assert (Progress().sentence, Progress(14, 41, left_s=40.5).sentence) == ("compiling, only once", words)


@pytest.mark.usefixtures("pretending")
def test_it_ends_when_asked() -> None:
    """A stop ends a process at once, starts no other, and lets `wait` return."""
    warming = Warming(["one", "two", "three"], processes=1, compile_case=pause)
    warming.stop()
    done = warming.wait()
    assert not done.finished
    assert done.failed.keys() <= {"one"}


@pytest.mark.usefixtures("own_cache")
def test_ready_experiments_are_remembered(monkeypatch: pytest.MonkeyPatch) -> None:
    """A finished experiment is ready in the next process, until anything changes that compiled code depends on.

    That is so for a process that has compiled more than others, too.
    """
    assert memory.ready(["one", "two"]) == frozenset()
    memory.remember("one")
    memory.remember("three")
    loop_with(silent)
    assert memory.ready(["one", "two"]) == {"one"}
    others = dict.fromkeys(["target", "numba", "llvmlite", "numpy"], "9")
    monkeypatch.setattr(memory.machine, "describe_platform", lambda: others)
    assert memory.ready(["one", "two"]) == frozenset()


@pytest.mark.usefixtures("own_cache")
def test_experiments_that_finish_at_once_are_all_remembered() -> None:
    """Concurrent processes lose no entry of each other."""
    names = [f"experiment-{number}" for number in range(40)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(memory.remember, names))
    assert memory.ready(names) == frozenset(names)


@pytest.mark.usefixtures("own_cache")
def test_the_real_processes_compile_and_keep(monkeypatch: pytest.MonkeyPatch) -> None:
    """With an empty cache each called function is compiled; a second time there is nothing to do."""
    made = ForkServer("pftrack.doctor.compiling")
    share(made, monkeypatch)
    first, second = (Warming(["sine"], processes=1, compile_case=compile_little).wait() for _ in range(2))
    names = {"pftrack.core.numerics.elementary.exponentials", "pftrack.core.numerics.elementary.logarithms"}
    assert first.seconds.keys() == names
    assert first.total == second.total > first.done >= len(names)
    assert first.done == second.done
    assert not second.seconds
    made.close()
