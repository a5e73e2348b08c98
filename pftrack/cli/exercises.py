"""`exercise`: filters that a student writes, checked while they are written, and a folder of them graded."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pftrack.cli.checks import compiling
from pftrack.cli.listing import Json
from pftrack.cli.output import (
    FAILED,
    CommandError,
    Jobs,
    emit,
    note,
    progress,
    read_jobs,
    suffix_of,
    table,
    whole,
    wrong_use,
)

if TYPE_CHECKING:
    from pftrack.teaching.exercises.grading import Report
    from pftrack.teaching.exercises.submission import Exercise


Folder = Annotated[
    Path | None,
    typer.Option("--exercises", metavar="DIR", help="A folder with exercises of your own, in addition to the others."),
]
Seed = Annotated[str, typer.Option(metavar="SEED", help="The first seed of draws and scenes.")]

group = typer.Typer(help="Exercises: write a filter, and have it checked.", no_args_is_help=True)


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.add_typer(group, name="exercise")


@group.command("list")
def list_(folder: Folder = None, json: Json = False) -> None:
    """List the exercises with what is checked of each."""
    exercises = _exercises(folder).values()
    if json:
        emit([_about(each) for each in exercises])
        return
    rows = [(each.id, each.title, each.experiment, ", ".join(each.functions), f"{each.points:g}") for each in exercises]
    table("", ("name", "title", "experiment", "to write", "points"), rows)


@group.command()
def start(
    exercise: Annotated[str, typer.Argument(metavar="ID", help="An exercise's name, as `exercise list` prints it.")],
    file: Annotated[
        Path | None,
        typer.Argument(metavar="[FILE.py]", help="Where to; named after the exercise if not given."),
    ] = None,
    hints: Annotated[bool, typer.Option("--hints", help="Print the hints as well, and write nothing.")] = False,
    folder: Folder = None,
) -> None:
    """Print what is asked, and write the file to begin with; one that is there is left alone."""
    from pftrack.experiments.own.extension import name_of

    found = _exercise(exercise, _exercises(folder))
    values = ", ".join(f"{name} = {value}" for name, value in found.values.items())
    typer.echo(f"{found.title}\n\n{found.text}\n\nChecked on {found.experiment}{f' with {values}' if values else ''}.")
    if hints:
        typer.echo("\n" + "\n".join(f"{number}. {hint}" for number, hint in enumerate(found.hints, 1)))
        return
    path = file or Path(f"{found.id.replace('-', '_')}.py")
    try:
        name_of(path)
        with path.open("x", encoding="utf-8") as opened:
            opened.write(found.skeleton)
    except ValueError as error:
        raise wrong_use(str(error)) from None
    except FileExistsError:
        raise CommandError(f"{path} is there already; name another file") from None
    except OSError as error:
        raise CommandError(f"{path} cannot be written: {error.strerror}") from None
    note(f"pftrack: wrote {path}; check it with: pftrack exercise check {path}, watch it with: pftrack serve {path}")


@group.command()
def check(
    file: Annotated[Path, typer.Argument(metavar="FILE.py", help="Your solution; it is executed.")],
    exercise: Annotated[
        str | None, typer.Option(metavar="ID", help="The exercise; the one that the file names if not given.")
    ] = None,
    seed: Seed = "0",
    folder: Folder = None,
    json: Json = False,
) -> None:
    """Say for each property whether it holds, with numbers and the seed that shows it; status 1 if one does not.

    With --json the report has the form of Gradescope's results.json.
    """
    from pftrack.core.numerics.random import LARGEST_SEED
    from pftrack.experiments.own.extension import name_of
    from pftrack.teaching.exercises import exercise_named_in
    from pftrack.teaching.exercises.grading import check as check_file
    from pftrack.teaching.exercises.grading import results

    first = whole("--seed", seed, 0, LARGEST_SEED - 10_000)
    exercises = _exercises(folder)
    try:
        name_of(file)
        named = exercise or exercise_named_in(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise CommandError(f"{file} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise CommandError(f"{file} is no text") from None
    except ValueError as error:
        raise wrong_use(str(error)) from None
    if named is None:
        raise wrong_use(f"{file} has no line EXERCISE = ..., by which it says what it answers; name it with --exercise")
    wanted = _exercise(named, exercises)
    with compiling(), progress("checks") as tick:
        report = check_file(wanted, file, seed=first, told=tick)
    if json:
        emit(results(report))
    else:
        _tell(report)
    if not report.passed:
        failed = sum(not each.verdict.holds for each in report.findings)
        note(f"pftrack: {failed} of {len(report.findings)} properties do not hold")
        raise typer.Exit(FAILED)


@group.command()
def grade(
    submissions: Annotated[
        Path,
        typer.Argument(metavar="DIR", help="A folder with a file of each student, or a folder with one file each."),
    ],
    exercise: Annotated[
        str | None, typer.Option(metavar="ID", help="The exercise of all; the one that each names if not given.")
    ] = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE.csv", help="Write the table there as well.")] = None,
    seconds: Annotated[str, typer.Option(metavar="SECONDS", help="Processor time that each may take.")] = "120",
    memory: Annotated[str, typer.Option(metavar="MIB", help="Memory that each may take, MiB.")] = "1024",
    jobs: Jobs = None,
    seed: Seed = "0",
    folder: Folder = None,
    json: Json = False,
) -> None:
    """Check all submissions in a folder, each in a confined process without a network, and print a table of points."""
    from dataclasses import replace

    from pftrack.core.files import csv_text, write_whole
    from pftrack.core.numerics.random import LARGEST_SEED
    from pftrack.process import MEBIBYTE
    from pftrack.teaching.exercises.grading import BUDGET, submissions_in, table_of
    from pftrack.teaching.exercises.grading import grade as grade_files

    first = whole("--seed", seed, 0, LARGEST_SEED - 10_000)
    allowed = float(whole("--seconds", seconds, 1, 86_400))
    processes = read_jobs(jobs)
    most = whole("--memory", memory, 64, 1_048_576) * MEBIBYTE
    budget = replace(BUDGET, cpu_seconds=allowed, silence_s=allowed, memory_bytes=most)
    exercises = _exercises(folder)
    if exercise is not None:
        _exercise(exercise, exercises)
    if out is not None:
        suffix_of(out, (".csv",))
    if not submissions.is_dir():
        raise wrong_use(f"expected a folder of submissions, got {submissions}")
    files = submissions_in(submissions)
    if not files:
        raise CommandError(f"there is no file FILE.py in {submissions}")
    graded: dict[str, dict[str, Any]] = {}
    with compiling(), progress("submissions") as tick:
        tick(0, len(files))
        for name, found in grade_files(files, exercises, exercise=exercise, seed=first, budget=budget, jobs=processes):
            graded[name] = found
            tick(len(graded), len(files))
    graded = {name: graded[name] for name in files}  # in their order, not in that in which they came
    columns, rows = table_of(graded)
    if out is not None:
        write_whole(out, csv_text((columns, *rows)).encode())
    if json:
        emit(graded)
    else:
        table("", columns, rows)
    if any(found["extra_data"].get("network") for found in graded.values()):
        note("pftrack: this system lets no process give up the network, so the submissions had it")


def _tell(report: "Report") -> None:
    rows = [
        ("holds" if each.verdict.holds else "FAILS", each.title, f"{each.points:g} of {each.check.points:g}")
        for each in report.findings
    ]
    table(f"{report.exercise.title}, {report.file}", ("", "property", "points"), rows)
    typer.echo("")
    for each in report.findings:
        seed = "" if each.verdict.seed is None else f" (seed {each.verdict.seed})"
        typer.echo(f"{'holds' if each.verdict.holds else 'FAILS'}  {each.check.property}{seed}: {each.verdict.words}")
    typer.echo(f"\n{report.points:g} of {report.exercise.points:g} points")


def _exercises(folder: Path | None) -> "Mapping[str, Exercise]":
    """Return all exercises; what is wrong with files is told, and the others stay."""
    from pftrack.teaching.exercises import read_exercises

    if folder is not None and not folder.is_dir():
        raise wrong_use(f"--exercises expected a folder, got {folder}")
    found = read_exercises(*([] if folder is None else [folder]))
    for problem in found.problems:
        note(f"pftrack: {problem.sentence}")
    return found.exercises


def _exercise(name: str, known: "Mapping[str, Exercise]") -> "Exercise":
    if name not in known:
        raise wrong_use(f"an exercise must be one of {', '.join(known)}, got {name!r}")
    return known[name]


def _about(exercise: "Exercise") -> dict[str, object]:
    return {
        "id": exercise.id,
        "title": exercise.title,
        "experiment": exercise.experiment,
        "functions": exercise.functions,
        "points": exercise.points,
        "checks": [{"property": each.property, "points": each.points} for each in exercise.checks],
        "origin": exercise.origin,
    }
