"""`explain`: why the target of a saved run was lost, and what would have saved it, in sentences with their numbers."""

from pathlib import Path
from typing import Annotated

import typer

from pftrack.cli.checks import compiling
from pftrack.cli.exports import wanted_exports, write_exports
from pftrack.cli.filters import Trust
from pftrack.cli.listing import Json
from pftrack.cli.output import emit, progress, whole, wrong_use

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
    html: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the run with all of it as an HTML page, too.")
    ] = None,
) -> None:
    """Say why the target of a run was lost, since when, what shows it, and what would have saved it."""
    from pftrack.analysis.explanation import explain as explain_run
    from pftrack.api import load

    if html is not None and html.suffix.lower() != ".html":
        raise wrong_use(f"--html must name a file that ends in .html, got {html.name}")
    with compiling():
        run = load(file, recording=video, trust=trust)
        asked = None if frame is None else whole("--frame", frame, 0, run.computed)
        page = wanted_exports(run.experiment, [] if html is None else [html])
        with progress("runs") as tick:
            explanation = explain_run(run, asked, seeds=whole("--seeds", seeds, 0, MOST_SEEDS), on_step=tick)
    if explanation.what_if is not None:
        run.explained = explanation
    write_exports(page, run)
    if json:
        emit(explanation.as_dict())
        return
    for line in explanation.lines:
        typer.echo(line)
