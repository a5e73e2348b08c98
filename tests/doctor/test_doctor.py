"""The doctor finds what is missing, and compiles by processes of their own."""

import os
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.numerics.compiled import compiled
from pftrack.core.numerics.elementary import exponentials, logarithms
from pftrack.doctor import checks as doctor
from pftrack.doctor import compiling, memory
from pftrack.doctor.checks import Check, examine
from pftrack.doctor.warming import Progress, Schedule, Warming
from pftrack.experiments.shared.sampling import loop_with
from pftrack.process import report


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
    """Nothing can be kept below a file."""
    (tmp_path / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "cache"))


def test_an_old_or_missing_library_is_broken(monkeypatch: pytest.MonkeyPatch) -> None:
    """The message names what is installed and what is needed; 4.9 is older than 4.12, and 2.0 is 2."""
    for version, numbers in {"4.14.0.94": (4, 14, 0, 94), "2.0": (2,), "1.2.0rc1": (1, 2), "0": ()}.items():
        assert doctor._numbers(version) == numbers
    needs = ["numpy>=99", "rich>=1,<2", "pftrack-nowhere>=1", "absent>=1; extra == 'bench'"]
    monkeypatch.setattr(doctor.metadata, "requires", lambda _name: needs)
    status, text = doctor._libraries()
    assert (status, "absent" in text) == ("broken", False)
    for words in (">=99 is needed", ">=1 and <2 is needed", "pftrack-nowhere is missing"):
        assert words in text


@pytest.mark.usefixtures("quick")
def test_a_port_in_use_is_a_warning() -> None:
    """Another port can be chosen, so it is not broken."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        check = found(examine(port=taken.getsockname()[1]), "port")
    assert (check.status, "--port" in check.found) == ("warning", True)


@pytest.mark.usefixtures("quick")
def test_the_data_folder_comes_from_the_argument_or_the_environment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A folder that does not exist yet is fine where it can be made; below a file it cannot."""
    monkeypatch.setenv("PFTRACK_DATA_DIR", str(tmp_path / "new" / "data"))
    assert str(tmp_path / "new" / "data") in found(examine(), "data folder").found
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "file").touch()
    check = found(examine(data_dir=tmp_path / "file" / "data"), "data folder")
    assert (check.status, "--data-dir" in check.found) == ("broken", True)


@pytest.mark.usefixtures("quick")
def test_a_check_that_fails_itself_is_broken(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever goes wrong in a check is reported as its finding, in one line."""

    def fail() -> tuple[doctor.Status, str]:
        raise ImportError("libsomething.so is missing\nand more")

    monkeypatch.setattr(doctor, "_codecs", fail)
    assert found(examine(), "video") == Check("video", "broken", "ImportError: libsomething.so is missing")


@pytest.mark.usefixtures("no_cache")
def test_without_a_place_for_compiled_code_there_is_a_warning() -> None:
    """The doctor warns that each start compiles again if nothing can be kept; that is not an error."""
    check = doctor._compilation(everything=False)
    assert (check.status, "NUMBA_CACHE_DIR" in check.found) == ("warning", True)
    memory.remember("one")
    assert memory.ready(["one"]) == frozenset()


def test_what_was_compiled_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """`doctor --warm --json` says of each function how long it took, the slowest first; one that fails is broken."""
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
    """Neither a preset nor a choice made live waits for the compiler."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    script = LIVE.format(folder=str(tmp_path))
    done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.strip()) == (0, ""), done.stderr


def test_every_browser_that_the_tests_can_use_is_found(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The shell without windows as well; where there is none, the doctor says what was looked for."""
    monkeypatch.setenv("PATH", str(tmp_path))
    status, text = doctor._browser()
    assert (status, text.startswith("none of chromium-headless-shell, chromium, ")) == ("warning", True)
    shell = tmp_path / "chromium-headless-shell"
    shell.touch(0o755)
    assert doctor._browser() == ("ok", str(shell))


# Compiling by processes of their own, tried on functions that only pretend.


@compiled
def silent(image_rgb: NDArray[np.uint8], states: NDArray[np.float64], packed: tuple[float, ...]) -> NDArray[np.float64]:
    """Return the log likelihoods (N,) of a likelihood that says nothing."""
    return np.zeros(states.shape[0])


def pretend(name: str, number: int) -> list[str]:
    """Compile nothing, but tell as if it were so."""
    if number == 0:
        report({"begun": name, "cases": 2, "total": 6})
    if name == "dies" and number == 1:
        os._exit(3)
    if name == "broken":
        raise ValueError("no")
    function = f"{name}.{'ab'[number]}"
    report({"function": function, "seconds": 0.5})
    return [function]


def pause(name: str, number: int) -> list[str]:
    """Be at it for longer than anybody waits."""
    time.sleep(600)
    return pretend(name, number)


def compile_little(name: str, number: int) -> list[str]:
    """Compile what the sums of elementary functions need, as if a case of the experiment called no more."""
    compiling.run_case = lambda *_: logarithms(exponentials(np.ones(3)))  # type: ignore[assignment]
    return compiling.compile_case(name, number)


@pytest.mark.usefixtures("own_cache")
def test_progress_comes_with_every_function() -> None:
    """Functions add up, experiments get ready one by one, and in the end each case was compiled once."""
    told: list[Progress] = []
    done = Warming(["one", "two", "three"], processes=2, told=told.append, compile_case=pretend).wait()
    assert (done.finished, done.sentence) == (True, "compiled")
    assert (done.done, done.total, done.ready) == (6, 6, {"one", "two", "three"})
    assert done.seconds == {f"{name}.{part}": 0.5 for name in done.ready for part in "ab"}
    counts = [progress.done for progress in told]
    assert counts == sorted(counts)
    assert any(progress.ready and not progress.finished for progress in told)
    assert memory.ready(["two", "four"]) == {"two"}


@pytest.mark.usefixtures("own_cache")
@pytest.mark.parametrize(
    ("bad", "reason", "processes"), [("broken", "ValueError: no", 1), ("dies", "ended with status 3", 2)]
)
def test_one_that_does_not_run_keeps_no_other(bad: str, reason: str, processes: int) -> None:
    """An experiment that raises, or ends its process, is told with the reason, and the others get ready."""
    done = Warming([bad, "one"], processes=processes, compile_case=pretend).wait()
    assert (done.finished, reason in done.failed[bad]) == (True, True)
    assert done.ready == memory.ready([bad, "one"]) == {"one"}


def test_every_experiment_is_begun_and_then_a_process_stays_with_its_own() -> None:
    """First what experiments are by default, then the own cases from the front, then others' from the end."""
    schedule = Schedule(["short", "long", "tiny"])
    assert [schedule.take(None), schedule.take(None)] == [("short", 0), ("long", 0)]
    schedule.on_begin("short", 2)
    schedule.on_begin("long", 3)
    assert schedule.take("short") == ("tiny", 0)
    schedule.on_begin("tiny", 1)
    assert schedule.done("tiny")
    assert not schedule.done("short")
    assert schedule.take("short") == ("short", 1)
    assert schedule.done("short")
    assert schedule.take("short") == ("long", 2)
    assert not schedule.done("long")
    assert schedule.take("long") == ("long", 1)
    assert not schedule.done("long")
    assert schedule.done("long")
    assert not schedule
    schedule.on_begin("tiny", 4)
    assert schedule
    schedule.give_up("tiny")
    assert schedule.take("long") is None


def test_what_somebody_waits_for_comes_first() -> None:
    """Before the own cases of a process, and before other experiments, begun or not."""
    schedule = Schedule(["first", "second", "third"])
    assert schedule.take(None) == ("first", 0)
    schedule.on_begin("first", 3)
    schedule.prefer("third")
    assert schedule.take("first") == ("third", 0)
    assert schedule.take("first") == ("second", 0)  # how many cases the third has is not known yet
    schedule.on_begin("third", 2)
    assert [schedule.take("first"), schedule.take("first")] == [("third", 1), ("first", 1)]


def slow_down(name: str, number: int) -> list[str]:
    """Tell of functions each of which takes twice as long as the one before."""
    report({"begun": name, "cases": 1, "total": 20})
    for k in range(12):
        report({"function": f"f{k}", "seconds": 2.0**k})
    return [f"f{k}" for k in range(12)]


@pytest.mark.usefixtures("own_cache")
def test_the_time_left_never_rises() -> None:
    """It is the processor time of a function so far, for those that are left, and stays where that would rise."""
    told: list[Progress] = []
    Warming(["one"], processes=1, told=told.append, compile_case=slow_down).wait()
    left = [progress.left_s for progress in told if progress.left_s is not None]
    assert left[0] == pytest.approx((2**5 - 1) / 5 * 15)  # of five functions, for fifteen
    assert left == sorted(left, reverse=True)


@pytest.mark.usefixtures("own_cache")
def test_it_ends_when_asked() -> None:
    """Stopping ends a process, however long it would take, replaces it by no other, and leaves nobody waiting."""
    warming = Warming(["one", "two", "three"], processes=1, compile_case=pause)
    warming.stop()
    done = warming.wait()
    assert not done.finished
    assert done.failed.keys() <= {"one"}


@pytest.mark.parametrize(
    ("progress", "sentence"),
    [
        (Progress(), "compiling, only once"),
        (Progress(14, 41, elapsed_s=1.0), "compiling, 14 of 41 functions, only once"),
        (Progress(14, 41, left_s=40.5), "compiling, 14 of 41 functions, about 40 s on an idle machine, only once"),
        (Progress(finished=True), "compiled"),
    ],
)
def test_progress_in_words(progress: Progress, sentence: str) -> None:
    """It says how many functions of how many, about how long it takes as soon as that is known, and that it is once."""
    assert progress.sentence == sentence


@pytest.mark.usefixtures("own_cache")
def test_what_is_ready_is_remembered(monkeypatch: pytest.MonkeyPatch) -> None:
    """A finished experiment is ready in the next process, until anything that compiled code depends on changes.

    A process that has compiled more than others finds what these remember.
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
def test_processes_that_finish_at_once_are_all_remembered() -> None:
    """Two processes that compile forget nothing of each other, whenever they read and write."""
    names = [f"experiment-{number}" for number in range(40)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(memory.remember, names))
    assert memory.ready(names) == frozenset(names)


@pytest.mark.usefixtures("own_cache")
def test_the_real_processes_compile_and_keep() -> None:
    """In an empty cache what is called is compiled function by function; a second time there is nothing to do."""
    first, second = (Warming(["sine"], processes=1, compile_case=compile_little).wait() for _ in range(2))
    names = {"pftrack.core.numerics.elementary.exponentials", "pftrack.core.numerics.elementary.logarithms"}
    assert first.seconds.keys() == names
    assert first.total == second.total > first.done >= len(names)
    assert first.done == second.done
    assert not second.seconds


@pytest.mark.slow
@pytest.mark.usefixtures("own_cache")
def test_a_whole_experiment_is_compiled_and_kept() -> None:
    """The same with all that an experiment calls."""
    first, second = (Warming(["sine"], low_priority=False).wait() for _ in range(2))
    assert len(first.seconds) > 5
    assert not second.seconds
    assert first.ready == second.ready == memory.ready(["sine"])


def test_an_idle_process_helps_the_fullest_from_its_end() -> None:
    """It takes the last case of the begun experiment with the most cases left, and its own cases in order."""
    schedule = Schedule(["short", "long"])
    for name, count in (("short", 3), ("long", 5)):
        assert schedule.take(None) == (name, 0)
        schedule.on_begin(name, count)
    assert schedule.take(None) == ("long", 4)
    assert schedule.take("short") == ("short", 1)
