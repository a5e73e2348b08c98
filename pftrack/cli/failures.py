"""`failures`: the gallery of failures, one of its runs in words and numbers, and both of its runs as a figure."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pftrack.cli.checks import compiling
from pftrack.cli.listing import Json
from pftrack.cli.output import emit, note, suffix_of, table, whole, wrong_use

if TYPE_CHECKING:
    from pftrack.analysis.failures import Entry, FailureRun, Measured


Named = Annotated[str, typer.Argument(metavar="ID", help="A failure's name or number, as `failures list` prints it.")]

group = typer.Typer(help="Named failures, each with what shows it and what cures it.", no_args_is_help=True)


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.add_typer(group, name="failures")


@group.command("list")
def list_(json: Json = False) -> None:
    """List the failures, by their numbers."""
    from pftrack.analysis.failures import gallery
    from pftrack.core.model.preset import KINDS
    from pftrack.experiments import EXPERIMENTS

    entries = gallery(EXPERIMENTS)
    if json:
        emit([_about(entry) for entry in entries])
        return
    rows = [(str(it.number), it.failure.id, it.experiment.id, KINDS[it.failure.kind]) for it in entries]
    table("", ("number", "name", "experiment", "kind"), rows)


@group.command()
def run(
    failure: Named,
    cured: Annotated[bool, typer.Option("--cured", help="Take the cure.")] = False,
    seed: Annotated[
        str | None, typer.Option(metavar="SEED", help="Another than the failure's own, to see whether it fails there.")
    ] = None,
    json: Json = False,
) -> None:
    """Compute the run of a failure, or the cured one, and say what is measured in it."""
    from pftrack.analysis.failures import measure, run_failure
    from pftrack.core.model.series import to_json
    from pftrack.core.numerics.random import LARGEST_SEED

    found = _entry(failure)
    chosen = None if seed is None else whole("--seed", seed, 0, LARGEST_SEED)
    with compiling():
        runs = [run_failure(found, cured=it, seed=chosen) for it in (False, True)]
    done, measured = runs[cured], measure(*runs)
    if json:
        numbers = done.sign.numbers if done.sign else {}
        emit(
            {
                **_about(found),
                "cured": cured,
                "recipe": done.recipe.model_dump(mode="json", exclude={"footage"}),
                "shown": done.shown,
                "finding": done.finding,
                "numbers": {name: to_json(number) for name, number in numbers.items()},
                "measured": [
                    {"title": it.title, "unit": it.unit, "failing": to_json(it.failing), "cured": to_json(it.cured)}
                    for it in measured
                ],
                "lost_frames": [row.frame for row in done.rows if row.is_lost],
                "why": done.diagnosis.sentence,
            }
        )
        return
    _tell(found, done, cured=cured)
    if measured:
        typer.echo(f"\nFrom frame {runs[0].diagnosis.frame} on")
        table("", ("", "fails", "cured"), [(_what(it), _digits(it.failing), _digits(it.cured)) for it in measured])
    typer.echo(f"\n{'The run that fails' if cured else 'With its cure'}: {_command(found, cured=not cured)}")


@group.command()
def figure(
    failure: Named,
    out: Annotated[Path, typer.Option(metavar="FILE", help="A picture, .png, .svg or .pdf.")],
) -> None:
    """Draw the errors of the run that fails and of the cured one, in one column of a journal's page."""
    from pftrack.analysis.failures import run_failure
    from pftrack.core.files import write_whole
    from pftrack.output.figures.picture import SUFFIXES, encode_as
    from pftrack.output.figures.style import draw_failure

    found = _entry(failure)
    suffix = suffix_of(out, tuple(SUFFIXES))
    with compiling():
        failing, cured = ([row.error for row in run_failure(found, cured=it).rows] for it in (False, True))
    title, frame = found.failure.title, found.failure.frame
    drawn = draw_failure(failing, cured, title=title, unit=found.experiment.unit, frame=frame)
    write_whole(out, encode_as(drawn, suffix, f"{title}: the errors of the run that fails and of the cured one"))
    note(f"pftrack: written to {out}")


def _entry(name: str) -> "Entry":
    from pftrack.analysis.failures import entry
    from pftrack.experiments import EXPERIMENTS

    try:
        return entry(EXPERIMENTS, name)
    except LookupError as error:
        raise wrong_use(str(error.args[0])) from None


def _tell(entry: "Entry", done: "FailureRun", *, cured: bool) -> None:
    failure = entry.failure
    how = f"{entry.experiment.title}, {entry.experiment.trackers[done.recipe.tracker or ''].title}"
    typer.echo(f"{entry.number}  {failure.title}{', cured' if cured else ''}\n{how}, seed {done.recipe.seed}\n")
    typer.echo(failure.cure.text if cured else failure.diagnosis)
    typer.echo(f"\nIt {'fails' if done.shown else 'does not fail'} in this way.")
    if done.diagnosis.lost:
        typer.echo(done.diagnosis.sentence)
    typer.echo(done.finding)


def _what(it: "Measured") -> str:
    return f"{it.title}, {it.unit}" if it.unit else it.title


def _digits(number: float) -> str:
    return f"{number:.3g}" if math.isfinite(number) else ""


def _command(entry: "Entry", *, cured: bool) -> str:
    return f"pftrack failures run {entry.failure.id}" + (" --cured" if cured else "")


def _about(entry: "Entry") -> dict[str, object]:
    failure = entry.failure
    return {
        "number": entry.number,
        "id": failure.id,
        "title": failure.title,
        "kind": failure.kind,
        "cause": failure.cause,
        "experiment": entry.experiment.id,
        "tracker": failure.tracker,
        "seed": failure.seed,
        "frame": failure.frame,
        "diagnosis": failure.diagnosis,
        "cure": failure.cure.text,
    }
