"""Consoles with a small character set: they show a question mark for other letters, and no command fails."""

import json
import sys
from collections.abc import Iterator
from io import BytesIO, TextIOWrapper
from typing import Any

import pytest
from typer.main import get_command

from pftrack.cli.app import app, main
from pftrack.experiments import EXPERIMENTS


def helps(command: Any, *before: str) -> Iterator[list[str]]:
    """Yield the calls for help of all commands."""
    below = getattr(command, "list_commands", lambda _: ())(None)
    for name in below:
        yield from helps(command.get_command(None, name), *before, name)
    if not below:
        yield [*before, "--help"]


def test_every_command_prints_to_an_ascii_console(monkeypatch: pytest.MonkeyPatch) -> None:
    """Help, lists and experiments are printed with any letters; JSON is complete."""
    written = BytesIO()
    for name, stream in (("stdout", written), ("stderr", BytesIO())):
        monkeypatch.setattr(sys, name, TextIOWrapper(stream, encoding="ascii"))
    lists = [["list"], ["lessons", "list"], ["failures", "list"], ["exercise", "list"]]
    calls = [*helps(get_command(app)), *lists, *(["show", name] for name in EXPERIMENTS), ["show", "head", "--json"]]
    assert len(calls) > 40
    for arguments in calls:
        with pytest.raises(SystemExit) as ended:
            main(arguments)
        assert ended.value.code == 0, arguments
    sys.stdout.flush()
    assert "°" in str(json.loads(written.getvalue().splitlines()[-1]))
