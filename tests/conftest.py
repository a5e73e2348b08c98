"""What all tests share: one browser a process, since Playwright cannot be started twice in one."""

import gc
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

# The first example compiles kernels, and time is measured in benchmarks/, never here.
settings.register_profile("suite", deadline=None)
settings.load_profile("suite")

# A shell has what it starts in the background ignore interrupts, and children inherit that; some tests interrupt them.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# The shell is the same engine without a desktop's windows, which cost a second of processor time for each page.
CHROMIUM = next(
    (path for path in map(Path, ("/usr/bin/chromium-headless-shell", "/usr/bin/chromium")) if path.exists()),
    Path("/usr/bin/chromium"),
)
FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--enable-unsafe-swiftshader",
]


def pytest_collection_finish() -> None:
    """Leave what was collected alone: each full garbage collection would look through thousands of tests."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def compiled() -> None:
    """Compile once what servers would compile for themselves, each anew."""
    from pftrack.experiments import EXPERIMENTS
    from pftrack.warming import Warming, ready

    failed = Warming(EXPERIMENTS.own.keys() - ready(EXPERIMENTS.own), low_priority=False).wait().failed
    assert not failed, failed


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=str(CHROMIUM), args=FLAGS)
        yield browser
        browser.close()
