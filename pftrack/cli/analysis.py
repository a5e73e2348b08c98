"""`compare`, `explain`, `fit` and `failures`: differences of runs, causes of losses, and fitted noises."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pftrack.cli import output
from pftrack.cli.experiments import Trust
from pftrack.cli.exports import wanted_exports, write_exports
from pftrack.cli.footage import Moved

if TYPE_CHECKING:
    from pftrack.analysis.failures import Entry, FailureRun, Measured
    from pftrack.analysis.fitting import Fit, Score


Named = Annotated[str, typer.Argument(metavar="ID", help="A failure's name or number, as `failures list` prints it.")]

failure_group = typer.Typer(help="Named failures and their cures: list, run and draw them.", no_args_is_help=True)


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    for command in (compare, explain, fit):
        app.command()(command)
    app.add_typer(failure_group, name="failures")


def compare(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Saved runs, .pft, or recipes, .json.")],
    trust: Trust = False,
    json: output.Json = False,
) -> None:
    """Compare two to four runs on the frames that they have in common."""
    from pftrack.api import compare as compared
    from pftrack.api import load

    with output.compiling():
        found = compared(*(load(file, trust=trust) for file in files))
    if json:
        output.emit(found.as_dict())
        return
    output.table("What differs", ("", *found.names), [(it.title, *map(str, it.values)) for it in found.settings])
    rows = [_row(outcome.as_dict()) for outcome in found.outcomes]
    typer.echo("")
    output.table("Results", ("", *found.names), [(name, *(row.get(name, "") for row in rows)) for name in rows[0]])
    apart = found.first_difference
    if apart is not None:
        typer.echo(f"\nTheir estimates first differ in frame {apart}; {found.frames} frames are compared.")


def _row(outcome: dict[str, object]) -> dict[str, str]:
    plain = {name: value for name, value in outcome.items() if isinstance(value, (bool, int, float, str))}
    return {name.replace("_", " "): output.cell(value) for name, value in plain.items()}


MOST_SEEDS = 1000


def explain(
    file: Annotated[Path, typer.Argument(help="A saved run or a recording of beliefs, FILE.pft.")],
    frame: Annotated[
        str | None, typer.Option(metavar="N", help="The frame to ask about (default: the first lasting loss).")
    ] = None,
    seeds: Annotated[
        str, typer.Option(metavar="N", help="Seeds for each change that might have saved the run; 0 tries none.")
    ] = "20",
    video: Moved = None,
    trust: Trust = False,
    json: output.Json = False,
    html: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Also write the run and its explanation as an HTML page.")
    ] = None,
) -> None:
    """Explain why and when a run lost its target, with evidence, and list changes that would have saved it."""
    from pftrack.analysis.explanation import explain as explain_run
    from pftrack.api import load

    if html is not None and html.suffix.lower() != ".html":
        raise output.wrong_use(f"--html must name a file that ends in .html, got {html.name}")
    with output.compiling():
        run = load(file, recording=video, trust=trust)
        asked = None if frame is None else output.whole("--frame", frame, 0, run.computed)
        page = wanted_exports(run.experiment, [] if html is None else [html])
        with output.progress("runs") as tick:
            explanation = explain_run(run, asked, seeds=output.whole("--seeds", seeds, 0, MOST_SEEDS), on_step=tick)
    if explanation.what_if is not None:
        run.explained = explanation
    write_exports(page, run)
    if json:
        output.emit(explanation.as_dict())
        return
    for line in explanation.lines:
        typer.echo(line)


def fit(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A saved run, .pft, or a recipe, .json.")],
    names: Annotated[
        list[str] | None,
        typer.Argument(metavar="NAME...", help="Parameters to fit (default: all noises and sharpnesses)."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Save the run with the fitted parameters, FILE.pft."),
    ] = None,
    trust: Trust = False,
    json: output.Json = False,
) -> None:
    """Fit tracker parameters on the first half of a run, and validate them on the second."""
    from pftrack.analysis.fitting import fit as fit_numbers
    from pftrack.api import load, run
    from pftrack.core.model.recipe import Change

    if out is not None:
        output.suffix_of(out, (".pft",))
    with output.compiling():
        made = load(file, trust=trust)
    with output.progress("Runs") as tick:
        found = fit_numbers(made, names or (), on_step=tick)
    if out is not None and found.kept:
        # Values set later would override the fitted ones.
        later = (
            Change(it.frame, {name: value for name, value in it.values.items() if name not in found.values})
            for it in made.recipe.timeline
        )
        timeline = (*(it for it in later if it.values), Change(0, found.values))
        run(made.recipe.model_copy(update={"timeline": timeline}), tracker=found.tracker).save(out)
    if json:
        output.emit(found.as_dict())
        return
    _show(found)
    if out is not None and not found.kept:
        output.note(f"{out} was not written.")


def _show(found: "Fit") -> None:
    numbers = [
        (it.name, f"{it.before:g}", f"{it.after:g}", it.unit, "at its bound" if it.at_bound else "")
        for it in found.numbers
    ]
    output.table("", ("name", "before", "after", "", ""), numbers)
    typer.echo("")
    halves = [
        (f"{half.first} to {half.last}", used, when, f"{score.log_evidence:.4g}", *_shares(score), *_squares(score))
        for half, used in zip(found.halves, ("used", "not used"), strict=True)
        for when, score in (("before", half.before), ("after", half.after))
    ]
    heads = ("frames", "", "", "log evidence a frame", "truth in 50 % band", "in 95 % band", "NEES", "NIS")
    output.table("", heads, halves)
    limits = found.halves[1].after.nis_limits
    between = "" if limits is None else f", NIS of the second half between {limits[0]:.2f} and {limits[1]:.2f}"
    output.note(f"NEES is about 1 for a consistent tracker{between}.")
    typer.echo(f"\n{' '.join(filter(None, (found.procedure, found.verdict, found.caution)))}")


def _squares(score: "Score") -> tuple[str, str]:
    first, second = ("" if it is None else f"{it:.3g}" for it in (score.nees, score.nis))
    return first, second


def _shares(score: "Score") -> tuple[str, str]:
    shares = [score.coverage.get(promised) for promised in ("50", "95")]
    first, second = ("" if share is None else f"{100 * share:.0f} %" for share in shares)
    return first, second


@failure_group.command("list")
def list_(json: output.Json = False) -> None:
    """List the failures, by their numbers."""
    from pftrack.analysis.failures import gallery
    from pftrack.core.model.preset import KINDS
    from pftrack.experiments import EXPERIMENTS

    entries = gallery(EXPERIMENTS)
    rows = [(it.number, it.failure.id, it.experiment.id, KINDS[it.failure.kind]) for it in entries]
    output.tell([_entry_json(entry) for entry in entries], ("number", "name", "experiment", "kind"), rows, json=json)


@failure_group.command()
def run(
    failure: Named,
    cured: Annotated[bool, typer.Option("--cured", help="Run with the cure.")] = False,
    seed: Annotated[str | None, typer.Option(metavar="SEED", help="Random seed (default: the failure's own).")] = None,
    json: output.Json = False,
) -> None:
    """Run a failure, or its cure, and print the measured evidence."""
    from pftrack.analysis.failures import measure, run_failure
    from pftrack.core.model.series import to_json

    found = _entry(failure)
    chosen = output.read_seed(seed)
    with output.compiling():
        runs = [run_failure(found, cured=it, seed=chosen) for it in (False, True)]
    done, measured = runs[cured], measure(*runs)
    if json:
        numbers = done.sign.numbers if done.sign else {}
        output.emit(
            {
                **_entry_json(found),
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
    _tell_failure(found, done, cured=cured)
    if measured:
        typer.echo(f"\nFrom frame {runs[0].diagnosis.frame} on")
        output.table(
            "", ("", "fails", "cured"), [(_what(it), _digits(it.failing), _digits(it.cured)) for it in measured]
        )
    typer.echo(f"\n{'The run that fails' if cured else 'With its cure'}: {_command(found, cured=not cured)}")


@failure_group.command()
def figure(
    failure: Named,
    out: Annotated[Path, typer.Option(metavar="FILE", help="A picture, .png, .svg or .pdf.")],
) -> None:
    """Draw the errors of the run that fails and of the cured one, in one column of a journal's page."""
    from pftrack.analysis.failures import run_failure
    from pftrack.core.files import write_whole
    from pftrack.output.figures.style import SUFFIXES, draw_failure, encode_as

    found = _entry(failure)
    suffix = output.suffix_of(out, tuple(SUFFIXES))
    with output.compiling():
        failing, cured = ([row.error for row in run_failure(found, cured=it).rows] for it in (False, True))
    title, frame = found.failure.title, found.failure.frame
    drawn = draw_failure(failing, cured, title=title, unit=found.experiment.judge.unit, frame=frame)
    write_whole(out, encode_as(drawn, suffix, f"{title}: the errors of the run that fails and of the cured one"))
    output.note(f"pftrack: written to {out}")


def _entry(name: str) -> "Entry":
    from pftrack.analysis.failures import entry
    from pftrack.experiments import EXPERIMENTS

    with output.refusing():
        return entry(EXPERIMENTS, name)


def _tell_failure(entry: "Entry", done: "FailureRun", *, cured: bool) -> None:
    failure = entry.failure
    how = f"{entry.experiment.title}, {entry.experiment.trackers[done.recipe.tracker or ''].title}"
    typer.echo(f"{entry.number}  {failure.title}{', cured' if cured else ''}\n{how}, seed {done.recipe.seed}\n")
    typer.echo(failure.cure.text if cured else failure.diagnosis)
    typer.echo(f"\nThe run {'shows' if done.shown else 'does not show'} this failure.")
    if done.diagnosis.lost:
        typer.echo(done.diagnosis.sentence)
    typer.echo(done.finding)


def _what(it: "Measured") -> str:
    return f"{it.title}, {it.unit}" if it.unit else it.title


def _digits(number: float) -> str:
    return f"{number:.3g}" if math.isfinite(number) else ""


def _command(entry: "Entry", *, cured: bool) -> str:
    return f"pftrack failures run {entry.failure.id}" + (" --cured" if cured else "")


def _entry_json(entry: "Entry") -> dict[str, object]:
    said = output.picked(entry.failure, "id", "title", "kind", "cause", "tracker", "seed", "frame", "diagnosis")
    return {"number": entry.number, **said, "experiment": entry.experiment.id, "cure": entry.failure.cure.text}
