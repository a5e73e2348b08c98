import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

HEAD = "from pftrack.core.numerics.compiled import compiled\n"
INNER = HEAD + "@compiled\ndef inner(x):\n    return x + {}\n"
OUTER = HEAD + "from inner import inner\n@compiled\ndef outer(x):\n    return 2 * inner(x)\n"
CALL = "import outer; print(outer.outer(1), sum(outer.outer.stats.cache_misses.values()))"
FORKING = """
import os, sys
import numba, pftrack.core.numerics.compiled
numba.njit(lambda x: x + 1)(1)
for line in sys.stdin:
    if not os.fork():
        exec(line)
        sys.stdout.flush()
        os._exit(0)
    os.wait()
"""


@pytest.fixture(scope="module")
def forking() -> Iterator[subprocess.Popen[str]]:
    """A process that has compiled something, which takes a second at first, and forks for each line that it gets."""
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    environment.pop("NUMBA_CACHE_DIR", None)
    # Bytecode of a file that is written twice in a second would not be renewed.
    with subprocess.Popen(
        [sys.executable, "-Bc", FORKING], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
    ) as process:
        yield process


@pytest.fixture
def call(forking: subprocess.Popen[str], tmp_path: Path) -> Callable[[str], str]:
    """Run a line of Python, with the modules of a folder, in a new fork, and return what it prints."""
    given, said = forking.stdin, forking.stdout

    def call(line: str) -> str:
        given.write(f"sys.path.insert(0, {str(tmp_path)!r}); {line}\n")
        given.flush()
        return said.readline().strip()

    return call


def write_both(folder: Path) -> None:
    (folder / "inner.py").write_text(INNER.format(1))
    (folder / "outer.py").write_text(OUTER)


def test_a_change_in_what_is_called_compiles_the_caller_again(tmp_path: Path, call: Callable[[str], str]) -> None:
    """A compiled function has those inside that it calls, so it is compiled again when their file changes.

    Content counts, so that another checkout of the same files, or a copy of them, keeps what was compiled. Where no
    folder can be written all is compiled each time.
    """
    write_both(tmp_path)
    line = "from numba.core.caching import CacheImpl; CacheImpl._locator_classes = []; "
    assert call(f"{line}import outer; print(outer.outer(1), len(outer.outer.signatures))") == "4 1"
    assert list(tmp_path.rglob("*.nb?")) == []
    assert call(CALL) == "4 1"
    for name in ("inner.py", "outer.py"):
        os.utime(tmp_path / name, (1, 1))
    assert call(CALL) == "4 0"
    (tmp_path / "inner.py").write_text(INNER.format(2))
    assert [call(CALL), call(CALL)] == ["6 1", "6 0"]


RELEASED = (
    "import pftrack.core.numerics.compiled as at; from pathlib import Path; at.PACKAGE = Path({0!r});"
    "at.PRECOMPILED = at.PACKAGE / 'precompiled'; "
)


def test_what_a_release_brings_along_is_used_first(tmp_path: Path, call: Callable[[str], str]) -> None:
    """It is loaded and not written to; what is damaged, or of another source, is compiled here and kept here."""
    place = Path(__file__).parents[2] / "pftrack" / "precompiled"
    assert call("import pftrack.core.numerics.machine as at; print(at.PRECOMPILED)") == str(place)
    write_both(tmp_path)
    released = RELEASED.format(str(tmp_path))
    assert call(CALL) == "4 1"
    kept, brought = tmp_path / "__pycache__", tmp_path / "precompiled"
    brought.mkdir()
    for file in kept.glob("*.nb?"):
        file.rename(brought / file.name)
    brought.chmod(0o555)
    assert call(released + CALL) == "4 0"
    assert call(f"{released}import outer; print(at.count_precompiled(), len(at.FUNCTIONS))") == "2 2"
    assert list(kept.glob("outer.*.nb?")) == []
    (data,) = brought.glob("outer.outer*.nbc")
    data.write_bytes(data.read_bytes()[:100])
    assert [call(released + CALL), call(released + CALL)] == ["4 1", "4 0"]
    (tmp_path / "inner.py").write_text(INNER.format(2))
    assert [call(released + CALL), call(released + CALL)] == ["6 1", "6 0"]
    assert {file.name for file in kept.glob("outer.*.nb?")} == {file.name for file in brought.glob("outer.*")}


TYPED = "from typing import NamedTuple\nclass {0}(NamedTuple):\n    x: int\n@compiled\ndef outer(x):\n    return x.x\n"


def test_a_type_that_was_renamed_compiles_anew(tmp_path: Path, call: Callable[[str], str]) -> None:
    """What was kept of functions of a type that exists no more is not read, but compiled again."""
    for name in ("Before", "After"):
        (tmp_path / "typed.py").write_text(HEAD + TYPED.format(name))
        assert call(f"import typed; print(typed.outer(typed.{name}(3)))") == "3"
