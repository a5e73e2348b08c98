"""`lessons` and `exercise`: the course listed, checked, drawn and exported; students' filters checked and graded."""

import json as json_format
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pftrack.cli import output

if TYPE_CHECKING:
    from pftrack.core.model.parameters import Parameters
    from pftrack.teaching.exercises.grading import Report
    from pftrack.teaching.exercises.submission import Exercise
    from pftrack.teaching.lessons.document import Problem
    from pftrack.teaching.lessons.lesson import Demonstration, Lesson


Named = Annotated[str, typer.Argument(metavar="ID", help="A lesson's id or number, as `lessons list` prints them.")]
Seed = Annotated[str | None, typer.Option(metavar="SEED", help="Random seed (default: the lesson's).")]
Lessons = Annotated[
    Path | None,
    typer.Option("--lessons", metavar="DIR", help="A folder with lecturers' lessons, in addition to the others."),
]
Exercises = Annotated[
    Path | None,
    typer.Option("--exercises", metavar="DIR", help="A folder with exercises of your own, in addition to the others."),
]
FirstSeed = Annotated[str, typer.Option("--seed", metavar="SEED", help="First random seed.")]

lesson_group = typer.Typer(help="Lessons: list, check, draw and export them.", no_args_is_help=False)
exercise_group = typer.Typer(help="Exercises: write a filter, and have it checked.", no_args_is_help=True)


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.add_typer(exercise_group, name="exercise")
    app.add_typer(lesson_group, name="lessons")


@lesson_group.command("list")
def list_lessons(folder: Lessons = None, json: output.Json = False) -> None:
    """List the lessons with the checks that they claim."""
    claims = [(it, [check.name for check in it.checks]) for it in _lessons(folder).values()]
    rows = [(it.number or "", it.id, it.title, ", ".join(names)) for it, names in claims]
    output.tell(
        [{**_lesson_json(it), "checks": names} for it, names in claims],
        ("", "name", "title", "checks"),
        rows,
        json=json,
    )


@lesson_group.command("check")
def check_lessons(
    ids: Annotated[list[str] | None, typer.Argument(metavar="[ID]...", help="Which lessons; all if none.")] = None,
    folder: Lessons = None,
    json: output.Json = False,
) -> None:
    """Check the lessons' claims against exact values."""
    known = _lessons(folder)
    claims = [(lesson, claim) for lesson in [_lesson(name, known) for name in ids or known] for claim in lesson.checks]
    found: list[dict[str, Any]] = []
    with output.compiling(), output.progress("checks") as tick:
        tick(0, len(claims))
        for lesson, claim in claims:
            outcome = claim.run()
            numbers = output.picked(outcome, "ours", "exact", "tolerance")
            status = "pass" if outcome.passed else "fail"
            found.append({"lesson": lesson.id, "check": claim.name, **numbers, "status": status})
            if outcome.words:
                output.note(f"pftrack: {lesson.id}, {claim.name}: {outcome.words}")
            tick(len(found), len(claims))
    output.tell(found, tuple(found[0]) if found else (), [tuple(row.values()) for row in found], json=json)
    failed = [row for row in found if row["status"] == "fail"]
    if failed:
        output.note(f"pftrack: {len(failed)} of {len(found)} checks lie outside their tolerances")
        raise typer.Exit(output.FAILED)


@lesson_group.command()
def figure(
    lesson: Named,
    out: Annotated[Path, typer.Option(metavar="FILE", help="A picture, .png, .svg or .pdf, or the data, .json.")],
    assignments: output.Assignments = None,
    seed: Seed = None,
    folder: Lessons = None,
    json: output.Json = False,
) -> None:
    """Draw the figure of a lesson, and print its numbers."""
    from pftrack.core.files import write_whole
    from pftrack.core.model.parameters import flat
    from pftrack.output.figures.style import SUFFIXES
    from pftrack.teaching.lessons.traces import encode

    found = _lesson(lesson, _lessons(folder))
    body = _demonstration(found)
    parameters, number = _values(body, assignments, seed)
    suffix = output.suffix_of(out, (*SUFFIXES, ".json"))
    with output.compiling():
        shown = body.show(parameters, number)
    numbers = [output.picked(number, "title", "value", "exact", "tolerance", "unit") for number in shown.numbers]
    told = {**_lesson_json(found), "parameters": flat(parameters), "seed": number, "numbers": numbers}
    if suffix == ".json":
        data = {**told, "figure": shown.figure.model_dump(mode="json")}
        content = (json_format.dumps(data, ensure_ascii=False, allow_nan=False) + "\n").encode()
    else:
        content = encode(shown.figure, suffix)
    write_whole(out, content)
    rows = [(it.title, f"{it.value:.{it.digits}g}", it.exact, it.tolerance, it.unit) for it in shown.numbers]
    output.tell({**told, "file": str(out)}, ("number", "value", "exact", "within", "unit"), rows, json=json)
    if not json:
        output.note(f"pftrack: written to {out}")


@lesson_group.command()
def export(
    lesson: Named,
    notebook: Annotated[Path, typer.Option("--notebook", metavar="FILE", help="The notebook, FILE.ipynb.")],
    assignments: output.Assignments = None,
    seed: Seed = None,
    folder: Lessons = None,
) -> None:
    """Write a lesson as a Jupyter notebook, which computes the same numbers."""
    from pftrack.core.files import write_whole
    from pftrack.teaching.lessons.lesson import Scenario
    from pftrack.teaching.lessons.notebook import lesson_notebook

    found = _lesson(lesson, _lessons(folder))
    output.suffix_of(notebook, (".ipynb",))
    if isinstance(found.body, Scenario):
        if assignments or seed is not None:
            raise output.wrong_use(f"the lesson {found.id} shows a run; change the recipe in its notebook instead")
        content = lesson_notebook(found)
    else:
        content = lesson_notebook(found, *_values(found.body, assignments, seed))
    write_whole(notebook, content)
    output.note(f"pftrack: written to {notebook}")


def _folders(option: str, folder: Path | None) -> list[Path]:
    if folder is not None and not folder.is_dir():
        raise output.wrong_use(f"{option} expected a folder, got {folder}")
    return [] if folder is None else [folder]


def _note_problems(problems: "Iterable[Problem]") -> None:
    """Report the problems of files; the other files remain."""
    for problem in problems:
        output.note(f"pftrack: {problem.sentence}")


def _lessons(folder: Path | None) -> "Mapping[str, Lesson]":
    from pftrack.teaching.lessons.library import read_lessons

    library = read_lessons(*_folders("--lessons", folder))
    _note_problems(library.problems)
    return library.lessons


def _lesson(name: str, known: "Mapping[str, Lesson]") -> "Lesson":
    from pftrack.teaching.lessons import find

    with output.refusing():
        return find(name, known)


def _demonstration(lesson: "Lesson") -> "Demonstration":
    from pftrack.teaching.lessons.lesson import Scenario

    if isinstance(lesson.body, Scenario):
        experiment = lesson.body.experiment
        raise output.wrong_use(
            f"the lesson {lesson.id} shows a run of {experiment} and has no figure of its own; "
            f"draw one of the other lessons, or `pftrack run {experiment}`"
        )
    return lesson.body


def _values(body: "Demonstration", assignments: list[str] | None, seed: str | None) -> "tuple[Parameters, int]":
    """Return the parameters and the seed with which a figure is drawn."""
    from pftrack.core.model.parameters import revise

    model = type(body.parameters)
    given = dict(output.assign(assignment) for assignment in assignments or ())
    values = {name: output.value_of(model, name, text) for name, text in given.items()}
    number = output.read_seed(seed)
    return revise(body.parameters, values), body.seed if number is None else number


def _lesson_json(lesson: "Lesson") -> dict[str, object]:
    return output.picked(lesson, "id", "number", "title")


Answered = Annotated[
    str | None, typer.Option("--exercise", metavar="ID", help="The exercise (default: the one that a file names).")
]


@exercise_group.command("list")
def list_exercises(folder: Exercises = None, json: output.Json = False) -> None:
    """List the exercises with the functions to write and the points."""
    found = _exercises(folder).values()
    rows = [(each.id, each.title, each.experiment, ", ".join(each.functions), f"{each.points:g}") for each in found]
    columns = ("name", "title", "experiment", "to write", "points")
    output.tell([_exercise_json(each) for each in found], columns, rows, json=json)


@exercise_group.command()
def start(
    exercise: Annotated[str, typer.Argument(metavar="ID", help="An exercise's name, as `exercise list` prints it.")],
    file: Annotated[
        Path | None,
        typer.Argument(metavar="[FILE.py]", help="File to write (default: named after the exercise)."),
    ] = None,
    hints: Annotated[bool, typer.Option("--hints", help="Print the hints as well, and write nothing.")] = False,
    folder: Exercises = None,
) -> None:
    """Print the task and write a template for its solution; an existing file is left alone."""
    from pftrack.experiments.own.extension import name_of

    found = _exercise(exercise, _exercises(folder))
    values = ", ".join(f"{name} = {value}" for name, value in found.values.items())
    typer.echo(f"{found.title}\n\n{found.text}\n\nChecked on {found.experiment}{f' with {values}' if values else ''}.")
    if hints:
        typer.echo("\n" + "\n".join(f"{number}. {hint}" for number, hint in enumerate(found.hints, 1)))
        return
    path = file or Path(f"{found.id.replace('-', '_')}.py")
    with output.refusing(ValueError):
        name_of(path)
    with output.writing(path), path.open("x", encoding="utf-8") as opened:
        opened.write(found.skeleton)
    output.note(
        f"pftrack: wrote {path}; check it with: pftrack exercise check {path}, watch it with: pftrack serve {path}"
    )


@exercise_group.command()
def check(
    file: Annotated[Path, typer.Argument(metavar="FILE.py", help="Your solution; it is executed.")],
    exercise: Answered = None,
    seed: FirstSeed = "0",
    folder: Exercises = None,
    json: output.Json = False,
) -> None:
    """Say for each property whether it holds, with numbers and the seed that shows it; status 1 if one does not.

    With --json the report has the form of Gradescope's results.json.
    """
    from pftrack.core.files import read_source
    from pftrack.experiments.own.extension import name_of
    from pftrack.teaching.exercises import exercise_named_in
    from pftrack.teaching.exercises.grading import check as check_file
    from pftrack.teaching.exercises.grading import results

    first, exercises = _first_seed(seed), _exercises(folder)
    with output.refusing(ValueError):
        name_of(file)
    with output.reading(file):
        named = exercise or exercise_named_in(read_source(file))
    if named is None:
        raise output.wrong_use(f"{file} has no line EXERCISE = ..., which names its exercise; name it with --exercise")
    wanted = _exercise(named, exercises)
    with output.compiling(), output.progress("checks") as tick:
        report = check_file(wanted, file, seed=first, told=tick)
    if json:
        output.emit(results(report))
    else:
        _tell(report)
    if not report.passed:
        failed = sum(not each.verdict.holds for each in report.findings)
        output.note(f"pftrack: {failed} of {len(report.findings)} properties do not hold")
        raise typer.Exit(output.FAILED)


@exercise_group.command()
def grade(
    submissions: Annotated[
        Path,
        typer.Argument(metavar="DIR", help="A folder with a file of each student, or a folder with one file each."),
    ],
    exercise: Answered = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE.csv", help="Write the table there as well.")] = None,
    seconds: Annotated[str, typer.Option(metavar="SECONDS", help="Processor time limit for each submission.")] = "120",
    memory: Annotated[str, typer.Option(metavar="MIB", help="Memory limit for each submission, MiB.")] = "1024",
    jobs: output.Jobs = None,
    seed: FirstSeed = "0",
    folder: Exercises = None,
    json: output.Json = False,
) -> None:
    """Check all submissions in a folder, each in a confined process without a network, and print a table of points."""
    from dataclasses import replace

    from pftrack.core.files import csv_text, write_whole
    from pftrack.process import MEBIBYTE
    from pftrack.teaching.exercises.grading import BUDGET, submissions_in, table_of
    from pftrack.teaching.exercises.grading import grade as grade_files

    first, allowed = _first_seed(seed), float(output.whole("--seconds", seconds, 1, 86_400))
    processes = output.read_jobs(jobs)
    most = output.whole("--memory", memory, 64, 1_048_576) * MEBIBYTE
    budget = replace(BUDGET, cpu_seconds=allowed, silence_s=allowed, memory_bytes=most)
    exercises = _exercises(folder)
    if exercise is not None:
        _exercise(exercise, exercises)
    if out is not None:
        output.suffix_of(out, (".csv",))
    if not submissions.is_dir():
        raise output.wrong_use(f"expected a folder of submissions, got {submissions}")
    files = submissions_in(submissions)
    if not files:
        raise output.CommandError(f"the folder {submissions} holds no files that end in .py")
    graded: dict[str, dict[str, Any]] = {}
    with output.compiling(), output.progress("submissions") as tick:
        tick(0, len(files))
        for name, found in grade_files(files, exercises, exercise=exercise, seed=first, budget=budget, jobs=processes):
            graded[name] = found
            tick(len(graded), len(files))
    graded = {name: graded[name] for name in files}  # in their order, not in that in which they came
    columns, rows = table_of(graded)
    if out is not None:
        write_whole(out, csv_text((columns, *rows)).encode())
    output.tell(graded, columns, rows, json=json)
    if any(found["extra_data"].get("network") for found in graded.values()):
        output.note("pftrack: this system cannot isolate processes from the network, so submissions had network access")


def _tell(report: "Report") -> None:
    rows = [
        ("holds" if each.verdict.holds else "FAILS", each.title, f"{each.points:g} of {each.check.points:g}")
        for each in report.findings
    ]
    output.table(f"{report.exercise.title}, {report.file}", ("", "property", "points"), rows)
    typer.echo("")
    for each in report.findings:
        seed = "" if each.verdict.seed is None else f" (seed {each.verdict.seed})"
        typer.echo(f"{'holds' if each.verdict.holds else 'FAILS'}  {each.check.property}{seed}: {each.verdict.words}")
    typer.echo(f"\n{report.points:g} of {report.exercise.points:g} points")


def _first_seed(seed: str) -> int:
    """Read the first of many seeds, which leaves room for the others."""
    from pftrack.core.numerics.random import LARGEST_SEED

    return output.whole("--seed", seed, 0, LARGEST_SEED - 10_000)


def _exercises(folder: Path | None) -> "Mapping[str, Exercise]":
    from pftrack.teaching.exercises import read_exercises

    found = read_exercises(*_folders("--exercises", folder))
    _note_problems(found.problems)
    return found.exercises


def _exercise(name: str, known: "Mapping[str, Exercise]") -> "Exercise":
    if name not in known:
        raise output.wrong_use(f"an exercise must be one of {', '.join(known)}, got {name!r}")
    return known[name]


def _exercise_json(exercise: "Exercise") -> dict[str, object]:
    checks = [output.picked(each, "property", "points") for each in exercise.checks]
    return {**output.picked(exercise, "id", "title", "experiment", "functions", "points", "origin"), "checks": checks}
