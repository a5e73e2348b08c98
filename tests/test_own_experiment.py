"""The example of an experiment from outside, installed beside the project, works on the command line."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from pftrack.cli.app import main
from tests.installing import ROOT, commands, environment, install_project

EXAMPLE = ROOT / "examples" / "own_experiment"
NAME = "turning"


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("installed")
    install_project(place, EXAMPLE)
    return place


def test_it_is_small_and_nobody_names_it() -> None:
    """It has at most 150 lines with its test, and neither library, server nor pages know its names."""
    files = [file for file in EXAMPLE.rglob("*") if file.suffix in {".py", ".toml", ".yaml", ".md"}]
    assert sum(bool(line.strip()) for file in files for line in file.read_text().splitlines()) <= 150
    names = re.compile(rf"pftrack.turning|[\"'`]{NAME}[\"'`]")
    for room in ("pftrack", "server", "frontend_static"):
        for file in (ROOT / room).rglob("*"):
            if file.suffix in {".py", ".js", ".html"}:
                assert not names.search(file.read_text()), file


# Its checks are those of tests/experiments.
@pytest.mark.slow
def test_its_own_tests_pass(place: Path) -> None:
    """Its tests, with all checks of `pftrack.testing`, pass where it is installed."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(EXAMPLE / "test_turning.py")]
    done = subprocess.run(
        command, cwd=place, env=environment(place), capture_output=True, text=True, check=False, timeout=110
    )
    assert done.returncode == 0, done.stdout[-3000:]


def test_every_command_takes_it(place: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It is listed, shown, run and replayed; so is what `pftrack new experiment` writes, and swept over.

    The preset of the new experiment that works holds the dot.
    """
    new = ["new", "experiment", "dots", "--folder", str(tmp_path)]
    for status in (0, 1):  # then it already exists
        with pytest.raises(SystemExit) as ended:
            main(new)
        assert ended.value.code == status
    assert "already exists" in capsys.readouterr().err
    written = (tmp_path / "dots" / "pftrack_dots" / "__init__.py").read_text()
    assert sum(bool(line.strip()) for line in written.splitlines()) <= 70
    install_project(place, tmp_path / "dots")
    saved, swept = str(tmp_path / "a.pft"), str(tmp_path / "a.parquet")
    of_dots = ["--axis", "hidden_frames=0,40", "--trials", "1", "--frames", "80"]
    told = commands(
        place,
        ["list", "--json"],
        ["show", NAME, "--json"],
        ["run", NAME, "--frames", "60", "--out", saved, "--json"],
        ["replay", saved, "--json"],
        ["show", "dots", "--json"],
        ["run", "dots", "--preset", "works", "--json"],
        ["sweep", "dots", *of_dots, "--jobs", "1", "--out", swept, "--json"],
    )
    assert [one.err for one in told if one.status] == []
    listed, shown, run, replayed, dots, works, _ = (json.loads(one.out) for one in told)
    assert NAME in [entry["id"] for entry in listed]
    assert "sharpest_deg" in [entry["name"] for entry in shown["declarations"]]
    assert run["mean_error"] < 3
    assert replayed["estimates_sha256"] == run["estimates_sha256"]
    assert [entry["name"] for entry in dots["declarations"]] == ["sample_count", "step_px", "hidden_frames"]
    assert works["success"]
