"""Consoles that know few letters: what they cannot show becomes a question mark, and no command ends by it."""

import json
import os
import subprocess
import sys

import pytest

from pftrack.experiments import EXPERIMENTS

SCRIPT = """
import json, sys
from pftrack.cli.app import app, main
from typer.main import get_command

def names(command, before=()):
    below = getattr(command, "list_commands", lambda _: ())(None)
    return [name for it in below for name in names(command.get_command(None, it), (*before, it))] or [before]

for arguments in [*((*name, "--help") for name in names(get_command(app))), *json.loads(sys.argv[1])]:
    try:
        main(arguments)
    except SystemExit as ended:
        if ended.code:
            raise SystemExit(f"{arguments} ended with {ended.code}")
"""

HEAD = ("show", "head"), ("show", "head", "--json")
LISTED = ("list",), ("lessons", "list"), ("failures", "list"), ("exercise", "list")
CALLS = {"cp1252": HEAD, "ascii": (*LISTED, *(("show", name) for name in EXPERIMENTS), *HEAD)}


@pytest.mark.parametrize(("encoding", "calls"), CALLS.items(), ids=CALLS)
def test_every_command_speaks_to_a_console_of_few_letters(encoding: str, calls: tuple[tuple[str, ...], ...]) -> None:
    """Help of all commands, lists and experiments print whatever letters they have; JSON stays whole."""
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, json.dumps(calls)],
        env={**os.environ, "PYTHONIOENCODING": encoding},
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr.decode()
    assert "°" in str(json.loads(done.stdout.splitlines()[-1]))
