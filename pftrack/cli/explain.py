"""`explain`: why the target of a saved run was lost, and what would have saved it, in sentences with their numbers."""

from pathlib import Path
from typing import Annotated

import typer

from pftrack.cli.compiling import compiling
from pftrack.cli.filters import Trust
from pftrack.cli.listing import Json
from pftrack.cli.output import emit, progress, whole

__all__ = ["register"]

MOST_SEEDS = 1000


def register(app: typer.Typer) -> None:
    """Add the command of this module."""
    app.command()(explain)


def explain(
    file: Annotated[Path, typer.Argument(help="A saved run or a recording of beliefs, FILE.pft.")],
    frame: Annotated[
        str | None, typer.Option(metavar="N", help="The frame to ask about; the first lasting loss if not given.")
    ] = None,
    seeds: Annotated[
        str, typer.Option(metavar="N", help="With how many seeds to try each change that might have saved it; 0: none.")
    ] = "20",
    video: Annotated[Path | None, typer.Option(help="Where the run's video is now, if it was moved.")] = None,
    trust: Trust = False,
    json: Json = False,
) -> None:
    """Say why the target of a run was lost, since when, what shows it, and what would have saved it."""
    from pftrack.api import load
    from pftrack.explanation import explain as explain_run

    with compiling():
        run = load(file, recording=video, trust=trust)
        asked = None if frame is None else whole("--frame", frame, 0, run.computed)
        with progress("runs") as tick:
            explanation = explain_run(run, asked, seeds=whole("--seeds", seeds, 0, MOST_SEEDS), on_step=tick)
    if json:
        emit(explanation.as_dict())
        return
    for line in explanation.lines:
        typer.echo(line)
