import json
import os
import subprocess
import sys

from tests.conftest import UNMEASURED

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
loaded = []
for arguments in sys.argv[1:]:
    with suppress(SystemExit):
        main(arguments.split())
    loaded.append(sorted(sys.modules))
print("\\n" + json.dumps(loaded))
"""
CALLS = "--help", "run --help", "lessons --help", "serve --help", "nothing"


def test_help_loads_no_library() -> None:
    """What computes is imported by the command that needs it, so that help is there at once."""
    call, environment = [sys.executable, "-c", PROGRAM, *CALLS], os.environ | UNMEASURED
    done = subprocess.run(call, capture_output=True, text=True, check=True, env=environment)
    first, *_, last = json.loads(done.stdout.splitlines()[-1])
    # typer reads options by pydantic; the list of commands has none.
    for loaded, heavy in ((first, HEAVY | {"pydantic"}), (last, HEAVY)):
        assert {name.partition(".")[0] for name in loaded} & heavy == set()
        assert len(loaded) < MOST
