"""The doctor finds what is missing or broken and says what to do."""

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from pftrack.doctor import checks as doctor
from pftrack.doctor.checks import Check, examine
from pftrack.doctor.warming import Progress


def found(checks: list[Check], name: str) -> Check:
    return next(check for check in checks if check.name == name)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the check that runs trackers."""
    monkeypatch.setattr(doctor, "_compilation", lambda *, everything: ("ok", f"everything: {everything}"))


@pytest.mark.parametrize(
    ("version", "numbers"), [("4.14.0.94", (4, 14, 0, 94)), ("2.0", (2,)), ("1.2.0rc1", (1, 2)), ("0", ())]
)
def test_versions_compare_as_numbers(version: str, numbers: tuple[int, ...]) -> None:
    """4.9 is older than 4.12, and 2.0 is 2."""
    assert doctor._numbers(version) == numbers


def test_an_old_or_missing_library_is_broken(monkeypatch: pytest.MonkeyPatch) -> None:
    """The message names what is installed and what is needed."""
    needs = ["numpy>=99", "rich>=1,<2", "pftrack-nowhere>=1", "absent>=1; extra == 'bench'"]
    monkeypatch.setattr(doctor.metadata, "requires", lambda _name: needs)
    status, text = doctor._libraries()
    assert status == "broken"
    assert ">=99 is needed" in text
    assert ">=1 and <2 is needed" in text
    assert "pftrack-nowhere is missing" in text
    assert "absent" not in text


@pytest.mark.usefixtures("quick")
def test_a_port_in_use_is_a_warning() -> None:
    """Another port can be chosen, so it is not broken."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        check = found(examine(port=taken.getsockname()[1]), "port")
    assert check.status == "warning"
    assert "--port" in check.found


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
    assert check.status == "broken"
    assert "--data-dir" in check.found


@pytest.mark.usefixtures("quick")
def test_a_check_that_fails_itself_is_broken(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever goes wrong in a check is reported as its finding, in one line."""

    def fail() -> tuple[doctor.Status, str]:
        raise ImportError("libsomething.so is missing\nand more")

    monkeypatch.setattr(doctor, "_codecs", fail)
    assert found(examine(), "video") == Check("video", "broken", "ImportError: libsomething.so is missing")


def test_without_a_place_for_compiled_code_there_is_a_warning(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Compiling anew at each start works, but it is worth saying."""
    (tmp_path / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "cache"))
    check = doctor._compilation(everything=False)
    assert check.status == "warning"
    assert "NUMBA_CACHE_DIR" in check.found


DONE = Progress(seconds={"a": 1.0, "b": 2.5}, elapsed_s=2.0, finished=True)


def test_what_was_compiled_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """`doctor --warm --json` says of each function how long it took, the slowest first; one that fails is broken."""
    monkeypatch.setattr("pftrack.doctor.warming.Warming.__init__", lambda self, names, **_: None)
    monkeypatch.setattr(
        "pftrack.doctor.warming.Warming.wait",
        lambda self: DONE,
    )
    check = doctor._compilation(everything=True)
    assert check.found.startswith("2 functions compiled now, in 2 s; kept in ")
    assert list(check.as_dict()["seconds"].items()) == [("b", 2.5), ("a", 1.0)]
    monkeypatch.setattr(
        "pftrack.doctor.warming.Warming.wait", lambda self: Progress(failed={"sine": "no"}, finished=True)
    )
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
    assert status == "warning"
    assert text.startswith("none of chromium-headless-shell, chromium, ")
    shell = tmp_path / "chromium-headless-shell"
    shell.touch(0o755)
    assert doctor._browser() == ("ok", str(shell))
