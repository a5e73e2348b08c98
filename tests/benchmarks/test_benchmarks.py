"""Every benchmark runs: its smallest form gives a table of figures; only an idle machine gives their values."""

import json
import math
import os
import runpy
import subprocess
import sys
from collections.abc import Iterator

import cv2
import pytest

from pftrack.analysis import counterfactuals
from tests.installing import ROOT
from tests.pooling import fork_server, shared_fork_server

__all__ = ["fork_server", "shared_fork_server"]

pytestmark = pytest.mark.slow  # nothing of the product depends on them

FOLDER = ROOT / "benchmarks"
SCRIPTS = sorted(path.stem for path in FOLDER.glob("[a-z]*.py"))
OF_SERVERS = ["follow", "lessons", "memory", "session", "sight", "slider", "start"]
"""They start a server, and most of them a browser, which takes many seconds of processor time."""


@pytest.fixture
def _as_alone(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Restore at the end what a script changes for its whole process."""
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
        monkeypatch.setenv(name, os.environ.get(name, "1"))
    monkeypatch.syspath_prepend(FOLDER)
    every = counterfactuals.alternatives  # what-if tries a few of them
    monkeypatch.setattr(counterfactuals, "alternatives", lambda *given, **allow: every(*given, **allow)[:3])
    threads = cv2.getNumThreads()
    yield
    cv2.setNumThreads(threads)


def check(result: dict[str, list[dict[str, object]]]) -> None:
    """A benchmark's figures are numbers; a competitor that is not installed has none."""
    rows = result["rows"]
    assert all(row.keys() == rows[0].keys() for row in rows)
    figures = [figure for row in rows for figure in row.values() if isinstance(figure, float)]
    assert figures
    assert all(map(math.isfinite, figures))


@pytest.mark.usefixtures("_as_alone")
@pytest.mark.parametrize("name", [name for name in SCRIPTS if name not in OF_SERVERS])
def test_benchmark_of_the_library(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In this process, which has loaded everything, the smallest form of each prints one table."""
    if name == "suitability" and not (ROOT / ".." / "shared" / "data").exists():
        pytest.skip("the sample clips are not beside this checkout")
    monkeypatch.setattr(sys, "argv", [name, "--smallest", "--json"])
    runpy.run_path(str(FOLDER / f"{name}.py"), run_name="__main__")
    check(json.loads(capsys.readouterr().out))


def test_benchmarks_of_a_server(compiled: None) -> None:
    """Their smallest forms find the parts of the pages that they measure."""
    command = [sys.executable, "-m", "tests.benchmarks.together", *OF_SERVERS]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    results = json.loads(done.stdout)
    assert list(results) == OF_SERVERS
    for result in results.values():
        check(result)
