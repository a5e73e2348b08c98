"""`explain`: why the target of a saved run was lost, in sentences, with the numbers that they are said from."""

from pathlib import Path
from typing import Annotated

import typer

from pftrack.cli.compiling import compiling
from pftrack.cli.filters import Trust
from pftrack.cli.listing import Json
from pftrack.cli.output import emit, whole

__all__ = ["register"]


def register(app: typer.Typer) -> None:
    """Add the command of this module."""
    app.command()(explain)


def explain(
    file: Annotated[Path, typer.Argument(help="A saved run or a recording of beliefs, FILE.pft.")],
    frame: Annotated[
        str | None, typer.Option(metavar="N", help="The frame to ask about; the first lasting loss if not given.")
    ] = None,
    video: Annotated[Path | None, typer.Option(help="Where the run's video is now, if it was moved.")] = None,
    trust: Trust = False,
    json: Json = False,
) -> None:
    """Say why the target of a run was lost, since when, and what shows it."""
    from pftrack.api import load

    with compiling():
        run = load(file, recording=video, trust=trust)
        explanation = run.explain(None if frame is None else whole("--frame", frame, 0, run.computed))
    if json:
        emit(explanation.as_dict())
        return
    for line in explanation.lines:
        typer.echo(line)
