"""`lessons`: the lessons of the course listed, checked, drawn and exported."""

import json as json_format
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pftrack.cli.checks import compiling
from pftrack.cli.listing import Assignments, Json
from pftrack.cli.output import FAILED, assign, emit, note, progress, suffix_of, table, value_of, whole, wrong_use

if TYPE_CHECKING:
    from pftrack.core.model.parameters import Parameters
    from pftrack.teaching.lessons.lesson import Demonstration, Lesson, Number, Shown


Named = Annotated[str, typer.Argument(metavar="ID", help="A lesson's id or number, as `lessons list` prints them.")]
Seed = Annotated[str | None, typer.Option(metavar="SEED", help="Of the draws; the lesson's own if not given.")]

Folder = Annotated[
    Path | None,
    typer.Option("--lessons", metavar="DIR", help="A folder with lecturers' lessons, in addition to the others."),
]

group = typer.Typer(help="Lessons: list, check, draw and export them.", no_args_is_help=False)


def register(app: typer.Typer) -> None:
    """Add the commands of this module."""
    app.add_typer(group, name="lessons")


@group.command("list")
def list_(folder: Folder = None, json: Json = False) -> None:
    """List the lessons with the checks that they claim."""
    lessons = _lessons(folder).values()
    if json:
        emit([{**_about(it), "checks": [check.name for check in it.checks]} for it in lessons])
        return
    rows = [(str(it.number or ""), it.id, it.title, ", ".join(check.name for check in it.checks)) for it in lessons]
    table("", ("", "name", "title", "checks"), rows)


@group.command()
def check(
    ids: Annotated[list[str] | None, typer.Argument(metavar="[ID]...", help="Which lessons; all if none.")] = None,
    folder: Folder = None,
    json: Json = False,
) -> None:
    """Compute what lessons claim, and compare it with what is exact."""
    known = _lessons(folder)
    lessons = [_lesson(name, known) for name in ids or known]
    claims = [(lesson, claim) for lesson in lessons for claim in lesson.checks]
    found: list[dict[str, Any]] = []
    with compiling(), progress("checks") as tick:
        tick(0, len(claims))
        for lesson, claim in claims:
            outcome = claim.run()
            found.append(
                {
                    "lesson": lesson.id,
                    "check": claim.name,
                    "ours": outcome.ours,
                    "exact": outcome.exact,
                    "tolerance": outcome.tolerance,
                    "status": "pass" if outcome.passed else "fail",
                }
            )
            if outcome.words:
                note(f"pftrack: {lesson.id}, {claim.name}: {outcome.words}")
            tick(len(found), len(claims))
    if json:
        emit(found)
    else:
        table("", tuple(found[0]) if found else (), [[_cell(cell) for cell in row.values()] for row in found])
    failed = [row for row in found if row["status"] == "fail"]
    if failed:
        note(f"pftrack: {len(failed)} of {len(found)} checks lie outside their tolerances")
        raise typer.Exit(FAILED)


@group.command()
def figure(
    lesson: Named,
    out: Annotated[Path, typer.Option(metavar="FILE", help="A picture, .png, .svg or .pdf, or the data, .json.")],
    assignments: Assignments = None,
    seed: Seed = None,
    folder: Folder = None,
    json: Json = False,
) -> None:
    """Draw the figure of a lesson, and print its numbers."""
    from pftrack.core.files import write_whole
    from pftrack.core.model.parameters import flat
    from pftrack.output.figures.picture import SUFFIXES
    from pftrack.teaching.lessons.traces import encode

    found = _lesson(lesson, _lessons(folder))
    body = _demonstration(found)
    parameters, number = _values(body, assignments), _seed(body, seed)
    suffix = suffix_of(out, (*SUFFIXES, ".json"))
    with compiling():
        shown = body.show(parameters, number)
    told = {**_about(found), "parameters": flat(parameters), "seed": number, "numbers": _numbers(shown)}
    if suffix == ".json":
        data = {**told, "figure": shown.figure.model_dump(mode="json")}
        content = (json_format.dumps(data, ensure_ascii=False, allow_nan=False) + "\n").encode()
    else:
        content = encode(shown.figure, suffix)
    write_whole(out, content)
    if json:
        emit({**told, "file": str(out)})
        return
    table("", ("number", "value", "exact", "within", "unit"), [_row(it) for it in shown.numbers])
    note(f"pftrack: written to {out}")


@group.command()
def export(
    lesson: Named,
    notebook: Annotated[Path, typer.Option("--notebook", metavar="FILE", help="The notebook, FILE.ipynb.")],
    assignments: Assignments = None,
    seed: Seed = None,
    folder: Folder = None,
) -> None:
    """Write a lesson as a Jupyter notebook, which computes the same numbers."""
    from pftrack.core.files import write_whole
    from pftrack.teaching.lessons.lesson import Scenario
    from pftrack.teaching.lessons.notebook import lesson_notebook

    found = _lesson(lesson, _lessons(folder))
    suffix_of(notebook, (".ipynb",))
    if isinstance(found.body, Scenario):
        if assignments or seed is not None:
            raise wrong_use(f"the lesson {found.id} shows a run; change the recipe in its notebook instead")
        content = lesson_notebook(found)
    else:
        body = _demonstration(found)
        content = lesson_notebook(found, _values(body, assignments), _seed(body, seed))
    write_whole(notebook, content)
    note(f"pftrack: written to {notebook}")


def _lessons(folder: Path | None) -> "Mapping[str, Lesson]":
    """Return all lessons; what is wrong with files of lecturers is told, and the others stay."""
    from pftrack.teaching.lessons.lecturers import read_lessons

    if folder is not None and not folder.is_dir():
        raise wrong_use(f"--lessons expected a folder, got {folder}")
    library = read_lessons(*([] if folder is None else [folder]))
    for problem in library.problems:
        note(f"pftrack: {problem.sentence}")
    return library.lessons


def _lesson(name: str, known: "Mapping[str, Lesson]") -> "Lesson":
    from pftrack.teaching.lessons import find

    try:
        return find(name, known)
    except LookupError as error:
        raise wrong_use(str(error.args[0])) from None


def _demonstration(lesson: "Lesson") -> "Demonstration":
    from pftrack.teaching.lessons.lesson import Demonstration

    if not isinstance(lesson.body, Demonstration):
        raise wrong_use(
            f"the lesson {lesson.id} shows a run of {lesson.body.recipe.experiment} and has no figure of its own; "
            f"draw one of the other lessons, or `pftrack run {lesson.body.recipe.experiment}`"
        )
    return lesson.body


def _values(body: "Demonstration", assignments: list[str] | None) -> "Parameters":
    from pftrack.core.model.parameters import revise

    model = type(body.parameters)
    given = dict(assign(assignment) for assignment in assignments or ())
    return revise(body.parameters, {name: value_of(model, name, text) for name, text in given.items()})


def _seed(body: "Demonstration", seed: str | None) -> int:
    from pftrack.core.numerics.random import LARGEST_SEED

    return body.seed if seed is None else whole("--seed", seed, 0, LARGEST_SEED)


def _about(lesson: "Lesson") -> dict[str, object]:
    return {"id": lesson.id, "number": lesson.number, "title": lesson.title}


def _numbers(shown: "Shown") -> list[dict[str, object]]:
    fields = "title", "value", "exact", "tolerance", "unit"
    return [{field: getattr(number, field) for field in fields} for number in shown.numbers]


def _row(number: "Number") -> tuple[str, ...]:
    shown = f"{number.value:.{number.digits}g}"
    return number.title, shown, _cell(number.exact), _cell(number.tolerance), number.unit


def _cell(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else "" if value is None else str(value)
