"""`compare`, `explain` and `fit`: what differs between runs, why a target was lost, and which noises fit a run."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pftrack.cli.checks import compiling
from pftrack.cli.exports import wanted_exports, write_exports
from pftrack.cli.filters import Trust
from pftrack.cli.footage import Moved
from pftrack.cli.listing import Json
from pftrack.cli.output import emit, note, progress, suffix_of, table, whole, wrong_use

if TYPE_CHECKING:
    from pftrack.analysis.fitting.found import Fit, Score


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.command()(compare)
    app.command()(explain)
    app.command()(fit)


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


MOST_SEEDS = 1000


def explain(
    file: Annotated[Path, typer.Argument(help="A saved run or a recording of beliefs, FILE.pft.")],
    frame: Annotated[
        str | None, typer.Option(metavar="N", help="The frame to ask about; the first lasting loss if not given.")
    ] = None,
    seeds: Annotated[
        str, typer.Option(metavar="N", help="With how many seeds to try each change that might have saved it; 0: none.")
    ] = "20",
    video: Moved = None,
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


def fit(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A saved run, .pft, or a recipe, .json.")],
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="NAME...", help="Numbers to fit; all noises and sharpnesses if not given."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Where to save the run with what was found, .pft."),
    ] = None,
    trust: Trust = False,
    json: Json = False,
) -> None:
    """Fit numbers of a run's tracker to its first half, and judge them by its second."""
    from pftrack.analysis.fitting.found import fit as fit_numbers
    from pftrack.api import load, run
    from pftrack.core.model.recipe import Change

    if out is not None:
        suffix_of(out, (".pft",))
    with compiling():
        made = load(file, trust=trust)
    with progress("Runs") as tick:
        found = fit_numbers(made, names or (), on_step=tick)
    if out is not None and found.kept:
        # What was set later on would take the place of what was found.
        later = (
            Change(it.frame, {name: value for name, value in it.values.items() if name not in found.values})
            for it in made.recipe.timeline
        )
        timeline = (*(it for it in later if it.values), Change(0, found.values))
        run(made.recipe.model_copy(update={"timeline": timeline}), tracker=found.tracker).save(out)
    if json:
        emit(found.as_dict())
        return
    _show(found)
    if out is not None and not found.kept:
        note(f"{out} was not written.")


def _show(found: "Fit") -> None:
    numbers = [
        (it.declared.name, f"{it.before:g}", f"{it.after:g}", it.declared.unit, "at its bound" if it.at_bound else "")
        for it in found.numbers
    ]
    table("", ("name", "before", "after", "", ""), numbers)
    typer.echo("")
    halves = [
        (f"{half.first} to {half.last}", used, when, f"{score.mean:.4g}", *_shares(score), *_squares(score))
        for half, used in zip(found.halves, ("used", "not used"), strict=True)
        for when, score in (("before", half.before), ("after", half.after))
    ]
    heads = ("frames", "", "", "log evidence a frame", "truth in 50 % band", "in 95 % band", "NEES", "NIS")
    table("", heads, halves)
    limits = found.halves[1].after.consistency.nis_limits
    between = "" if limits is None else f", NIS of the second half between {limits[0]:.2f} and {limits[1]:.2f}"
    note(f"NEES is about 1 if the tracker is as sure as it may be{between}.")
    typer.echo(f"\n{' '.join(filter(None, (found.procedure, found.verdict, found.caution)))}")


def _squares(score: "Score") -> tuple[str, str]:
    first, second = ("" if it is None else f"{it:.3g}" for it in (score.consistency.nees, score.consistency.nis))
    return first, second


def _shares(score: "Score") -> tuple[str, str]:
    shares = [score.coverage.get(promised) for promised in (0.5, 0.95)]
    first, second = ("" if share is None else f"{100 * share:.0f} %" for share in shares)
    return first, second
