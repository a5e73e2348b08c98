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
from pftrack.cli import main
try:
    main(sys.argv[1:])
except SystemExit:
    print("\\n" + json.dumps(sorted(sys.modules)))
"""


@pytest.mark.parametrize(
    "arguments", [["--help"], ["run", "--help"], ["lessons", "--help"], ["serve", "--help"], ["nothing"]]
)
def test_help_loads_no_library(arguments: list[str]) -> None:
    """What computes is imported by the command that needs it, so that help is there at once."""
    done = subprocess.run([sys.executable, "-c", PROGRAM, *arguments], capture_output=True, text=True, check=True)
    loaded = json.loads(done.stdout.rpartition("\n[")[2].join(["[", ""]))
    roots = {name.partition(".")[0] for name in loaded}
    # typer reads options by pydantic; the list of commands has none.
    assert roots & (HEAVY | ({"pydantic"} if arguments == ["--help"] else set())) == set()
    assert len(loaded) < MOST
