import json
import subprocess
import sys

import pytest

HEAVY = {
    *("numpy", "numba", "llvmlite", "cv2", "av", "PIL", "scipy", "matplotlib", "pyarrow", "psutil"),
    *("fastapi", "starlette", "uvicorn", "viser", "sqlalchemy", "structlog", "distributed"),
}
MOST = 470
"""Modules altogether: typer and rich, and the standard library below them, and our own of commands."""

PROGRAM = """
import json, sys
from contextlib import suppress
from pftrack.cli import main
for arguments in sys.argv[1:]:
    with suppress(SystemExit):
        main(arguments.split())
print("\\n" + json.dumps(sorted(sys.modules)))
"""


@pytest.mark.parametrize("calls", [["--help"], ["run --help", "lessons --help", "serve --help", "nothing"]])
def test_help_loads_no_library(calls: list[str]) -> None:
    """What computes is imported by the command that needs it, so that help is there at once."""
    done = subprocess.run([sys.executable, "-c", PROGRAM, *calls], capture_output=True, text=True, check=True)
    loaded = json.loads(done.stdout.splitlines()[-1])
    roots = {name.partition(".")[0] for name in loaded}
    # typer reads options by pydantic; the list of commands has none.
    assert roots & (HEAVY | ({"pydantic"} if calls == ["--help"] else set())) == set()
    assert len(loaded) < MOST
