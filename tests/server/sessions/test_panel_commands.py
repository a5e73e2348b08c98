"""Panel commands: what waits goes together, and whatever goes wrong is told."""

import asyncio
from typing import Any

import pytest

from pftrack.sources.limits import SourceError
from pftrack_server.sessions.panel_commands import PanelCommands
from pftrack_server.sessions.worker.commands import ChangeValues, Command
from tests.apart import run


def test_what_waits_goes_together() -> None:
    """While another command is under way the newest value of each parameter waits."""
    sent: list[Command] = []

    async def act() -> None:
        door = asyncio.Lock()

        async def carry_out(command: Command) -> None:
            sent.append(command)

        commands = PanelCommands(door, carry_out, lambda detail: None)
        async with door:
            for number in range(3):
                commands.ask({"kind": "change", "values": {"n": number}})
            commands.ask({"kind": "change", "values": {"m": 1}})
            await asyncio.sleep(0)
        await asyncio.sleep(0.01)

    run(act())
    assert sent == [ChangeValues(values={"n": 2, "m": 1})]


@pytest.mark.parametrize(
    ("body", "error", "said"),
    [
        ({}, SourceError("picture 7 cannot be read"), "picture 7 cannot be read"),
        ({}, OSError(5, "input/output error", "/somewhere/secret"), "could not read or write"),
        ({}, RuntimeError("a mistake"), "failed unexpectedly"),
        ({"seed": "seven"}, AssertionError("never carried out"), "seed: "),
        ({"kind": "fly"}, AssertionError("never carried out"), "kind: "),
    ],
)
def test_whatever_goes_wrong_is_told(body: dict[str, Any], error: Exception, said: str) -> None:
    """Nobody waits for the answer: without this the control would stay where it was put, and nobody would know why."""
    told: list[dict[str, Any]] = []

    async def act() -> None:
        async def refuse(command: Command) -> None:
            del command
            raise error

        commands = PanelCommands(asyncio.Lock(), refuse, told.append)
        commands.ask({"kind": "restart", **body})
        await asyncio.sleep(0.01)

    run(act())
    assert said in told[0]["message"]
    assert "secret" not in told[0]["message"]
