"""What all tests share: one browser a process, since Playwright cannot be started twice in one."""

import fcntl
import gc
import inspect
import os
import signal
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from tests.apart import run

ROOT = Path(__file__).parents[1]

# The first example compiles kernels, and time is measured in benchmarks/, never here.
settings.register_profile("suite", deadline=None, max_examples=25)  # others each time
settings.register_profile("thorough", deadline=None)

# A shell has what it starts in the background ignore interrupts, and children inherit that; some tests interrupt them.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

BASE = os.environ.setdefault("PFTRACK_BASE_PATH", "/@/space%20word").rstrip("/")
"""Where the tests' servers are, but for those that say otherwise: a path as awkward as one may be, or what is set."""

UNMEASURED = {"COVERAGE_PROCESS_CONFIG": ""}
"""Environment of a process whose modules or files a test counts: coverage would add its own."""

SLOW_S = 1800
"""Time for one of the tests that `make test` leaves out."""

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
    # That of a test's own nginx. Told page by page, the browser asks again for each connection, and gives up at times.
    "--ignore-certificate-errors",
    "--use-fake-device-for-media-stream",  # a camera, which every page that may ask is given
    "--use-fake-ui-for-media-stream",
    "--js-flags=--single-threaded",  # what optimises pages that live a second takes more than it saves
    "--renderer-process-limit=1",  # a page of a site that is open already needs no new process
]

FEW_PIXELS = """
const get = URLSearchParams.prototype.get;
URLSearchParams.prototype.get = function (name) { return name === 'fixedDpr' ? '0.25' : get.call(this, name); };
"""
"""Has viser draw a quarter of the width and height, as its address may ask for: in software every pixel is paid for."""

FRUGAL = f"""(() => {{{FEW_PIXELS}}})();
(() => {{
    const draw = window.requestAnimationFrame.bind(window), cancel = window.cancelAnimationFrame.bind(window);
    const begun = new Map();  // what waits: its timer first, then its picture
    let last = 0;
    window.requestAnimationFrame = (callback) => {{
        const id = (last += 1);
        const done = (time) => (begun.delete(id), callback(time));
        const timer = setTimeout(() => begun.set(id, {{ picture: draw(done) }}), 100);
        begun.set(id, {{ timer }});
        return id;
    }};
    window.cancelAnimationFrame = (id) => {{
        const {{ timer, picture }} = begun.get(id) ?? {{}};
        clearTimeout(timer);
        if (picture !== undefined) cancel(picture);
        begun.delete(id);
    }};
}})();"""
"""Beside that, has a page draw some ten pictures a second, as a slow machine does: each is paid for."""


def pytest_configure(config: pytest.Config) -> None:
    """Try more examples where slow tests are run as well."""
    settings.load_profile("suite" if "not slow" in config.option.markexpr else "thorough")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Leave what is collected alone: each full garbage collection would look through thousands of tests."""
    gc.disable()
    try:
        with one_first():
            return (yield)
    finally:
        gc.collect()
        gc.freeze()
        gc.enable()


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Give slow tests time on a slow machine too: compiling everything anew takes minutes of processor time."""
    for item in items:
        if item.get_closest_marker("slow"):
            item.add_marker(pytest.mark.timeout(SLOW_S), append=False)


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """Run a test that is a coroutine in a loop of its own."""
    if not inspect.iscoroutinefunction(pyfuncitem.obj):
        return None
    run(pyfuncitem.obj(**{name: pyfuncitem.funcargs[name] for name in inspect.signature(pyfuncitem.obj).parameters}))
    return True


@contextmanager
def one_first() -> Iterator[None]:
    """Have one process of a test run go through the context alone, and then the others together.

    What the first one compiles to bytecode, tests with their assertions above all, the others read.
    """
    file = os.open(__file__, os.O_RDONLY)
    try:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            fcntl.flock(file, fcntl.LOCK_SH)
        yield
    finally:
        os.close(file)


@pytest.fixture(scope="session")
def compiled() -> None:
    """Compile once what servers would compile for themselves; of several processes one does while the others wait."""
    from pftrack.doctor.memory import ready
    from pftrack.doctor.warming import Warming
    from pftrack.experiments import EXPERIMENTS

    with one_at_a_time():
        failed = Warming(EXPERIMENTS.own.keys() - ready(EXPERIMENTS.own), low_priority=False).wait().failed
        assert not failed, failed


@contextmanager
def one_at_a_time() -> Iterator[None]:
    """Keep the other processes of a test run out as long as the context lasts."""
    folder = os.open(ROOT / "tests", os.O_RDONLY)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        yield
    finally:
        os.close(folder)


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=str(CHROMIUM), args=FLAGS)
        yield browser
        browser.close()
