"""Consoles that know few letters: what they cannot show becomes a question mark, and no command ends by it."""

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
    """The calls for help of all commands."""
    below = getattr(command, "list_commands", lambda _: ())(None)
    for name in below:
        yield from helps(command.get_command(None, name), *before, name)
    if not below:
        yield [*before, "--help"]


@pytest.mark.parametrize("encoding", ["cp1252", "ascii"])
def test_every_command_speaks_to_a_console_of_few_letters(encoding: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Help of all commands, lists and experiments print whatever letters they have; JSON stays whole."""
    written = BytesIO()
    for name, stream in (("stdout", written), ("stderr", BytesIO())):
        monkeypatch.setattr(sys, name, TextIOWrapper(stream, encoding=encoding))
    calls = [["show", "head"], ["show", "head", "--json"]]
    if encoding == "ascii":  # whose letters the others have
        lists = [["list"], ["lessons", "list"], ["failures", "list"], ["exercise", "list"]]
        calls = [*helps(get_command(app)), *lists, *(["show", name] for name in EXPERIMENTS), *calls]
        assert len(calls) > 40
    for arguments in calls:
        with pytest.raises(SystemExit) as ended:
            main(arguments)
        assert ended.value.code == 0, arguments
    sys.stdout.flush()
    assert "°" in str(json.loads(written.getvalue().splitlines()[-1]))
