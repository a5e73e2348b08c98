"""`fit`: noises and sharpnesses of a saved run's tracker, fitted to what it has seen."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pftrack.cli.checks import compiling
from pftrack.cli.filters import Trust
from pftrack.cli.listing import Json
from pftrack.cli.output import emit, note, progress, suffix_of, table

if TYPE_CHECKING:
    from pftrack.analysis.fitting.found import Fit
    from pftrack.analysis.fitting.trials import Score


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.command()(fit)


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
