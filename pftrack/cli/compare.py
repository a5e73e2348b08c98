"""`compare`: two to four runs beside each other, what differs between them, and what came of each."""

from pathlib import Path
from typing import Annotated

import typer

from pftrack.cli.checks import compiling
from pftrack.cli.filters import Trust
from pftrack.cli.listing import Json
from pftrack.cli.output import emit, table


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.command()(compare)


def compare(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Saved runs, .pft, or recipes, .json.")],
    trust: Trust = False,
    json: Json = False,
) -> None:
    """Compare two to four runs on the frames that they have in common."""
    from pftrack.api import compare as compared
    from pftrack.api import load

    with compiling():
        found = compared(*(load(file, trust=trust) for file in files))
    if json:
        emit(found.as_dict())
        return
    table("What differs", ("", *found.names), [(it.title, *map(str, it.values)) for it in found.settings])
    rows = [_row(outcome.as_dict()) for outcome in found.outcomes]
    typer.echo("")
    table("What came of it", ("", *found.names), [(name, *(row.get(name, "") for row in rows)) for name in rows[0]])
    apart = found.first_difference
    if apart is not None:
        typer.echo(f"\nTheir estimates are the same before frame {apart} of the {found.frames} that are compared.")


def _row(outcome: dict[str, object]) -> dict[str, str]:
    plain = {name: value for name, value in outcome.items() if isinstance(value, (bool, int, float, str))}
    return {name.replace("_", " "): _format_value(value) for name, value in plain.items()}


def _format_value(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
