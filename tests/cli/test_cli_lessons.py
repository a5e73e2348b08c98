"""`pftrack lessons`: what it lists, checks, draws and exports, and what it refuses."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from pftrack.teaching.lessons import LESSONS, Figure
from pftrack.teaching.lessons.course import probability
from pftrack.teaching.lessons.lesson import Demonstration, Outcome, Scenario
from tests.cli.commands import Call, refused


def test_list_has_every_lesson_with_its_checks(call: Call) -> None:
    """Id, number, title and the names of the checks, in the order of the course; as a table too."""
    status, out, _ = call("lessons", "list", "--json")
    assert status == 0
    assert json.loads(out)[: len(LESSONS)] == [
        {"id": it.id, "number": it.number, "title": it.title, "checks": [check.name for check in it.checks]}
        for it in LESSONS.values()
    ]
    status, out, _ = call("lessons", "list")
    assert status == 0
    assert all(name in out for name in LESSONS)


def test_check_computes_what_is_claimed(call: Call) -> None:
    """Each check of the lessons that are named, by id or number, with its figures; status 0 as all pass."""
    status, out, _ = call("lessons", "check", "probability", "2", "--json")
    assert status == 0
    found = json.loads(out)
    lessons = LESSONS["probability"], LESSONS["joint"]
    assert [(row["lesson"], row["check"]) for row in found] == [
        (it.id, each.name) for it in lessons for each in it.checks
    ]
    counted = next(row for row in found if row["check"] == "counting")
    assert counted == {
        "lesson": "probability",
        "check": "counting",
        "ours": pytest.approx(0.2861, abs=0.0106),
        "exact": pytest.approx(0.2861, abs=1e-4),
        "tolerance": 0.0106,
        "status": "pass",
    }
    assert "counting" in call("lessons", "check", "probability")[1]


def test_a_check_that_fails_is_told(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    """The others are computed all the same; exit status 1, and how many failed."""
    first, *others = LESSONS["probability"].checks
    wrong = replace(first, run=lambda: Outcome(2.0, 1.0, 0.5))
    monkeypatch.setitem(LESSONS.made, "probability", replace(LESSONS["probability"], checks=(wrong, *others)))
    status, out, err = call("lessons", "check", "1", "--json")
    assert status == 1
    assert [row["status"] for row in json.loads(out)] == ["fail", *["pass"] * len(others)]
    assert f"1 of {1 + len(others)} checks" in err


def test_figure_writes_data_and_tells_numbers(call: Call, tmp_path: Path) -> None:
    """The file has the figure as the pages get it; values and seed are those that were given."""
    place = tmp_path / "figure.json"
    given = "--set", "count=50", "--set", "bin_width=0.1", "--seed", 3
    status, out, _ = call("lessons", "figure", "1", *given, "--out", place, "--json")
    assert status == 0
    told, data = json.loads(out), json.loads(place.read_text(encoding="utf-8"))
    body = LESSONS["probability"].body
    assert isinstance(body, Demonstration)
    parameters = probability.ProbabilityParameters(count=50, bin_width=0.1)
    shown = body.show(parameters, 3)
    assert data["figure"] == shown.figure.model_dump(mode="json")
    Figure.model_validate(data["figure"])
    assert [number["value"] for number in data["numbers"]] == [number.value for number in shown.numbers]
    assert (told["seed"], told["parameters"]) == (3, parameters.model_dump())
    assert told["numbers"] == data["numbers"]


@pytest.mark.parametrize(("name", "begins"), [("a.png", b"\x89PNG"), ("a.SVG", b"<?xml")])
def test_figure_draws_pictures(call: Call, tmp_path: Path, name: str, begins: bytes) -> None:
    """The suffix says what is written; the numbers are printed with what is exact."""
    status, out, err = call("lessons", "figure", "probability", "--out", tmp_path / name)
    assert status == 0
    assert (tmp_path / name).read_bytes().startswith(begins)
    assert "Area of the histogram" in out
    assert "0.2861" in out
    assert f"written to {tmp_path / name}" in err


def test_export_writes_a_notebook_with_the_values_given(call: Call, tmp_path: Path) -> None:
    """Values and seed stand in its cells."""
    place = tmp_path / "lesson.ipynb"
    assert call("lessons", "export", "bayes", "--set", "mode=distance", "--seed", 9, "--notebook", place)[0] == 0
    book = json.loads(place.read_text(encoding="utf-8"))
    source = "".join("".join(cell["source"]) for cell in book["cells"])
    assert "'mode': 'distance'" in source
    assert "seed = 9" in source


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (("check", "nothing"), ("lesson must be one of 1 probability", "3 bayes", "got 'nothing'")),
        (("figure", "99", "--out", "a.png"), ("lesson must be one of ", "got '99'")),
        (("figure", "1", "--out", "a.gif"), (".png or .svg or .pdf or .json", "a.gif")),
        (("figure", "1", "--out", "a"), ("expected a file", "'a'")),
        (("figure", "1", "--out", "a.png", "--set", "count"), ("name=value", "'count'")),
        (
            ("figure", "1", "--out", "a.png", "--set", "count=many"),
            ("count must be a whole number between 10 and 20000",),
        ),
        (("figure", "1", "--out", "a.png", "--set", "count=5"), ("count must be", "between 10 and 20000", "got 5")),
        (("figure", "1", "--out", "a.png", "--set", "low=nan"), ("low must be a finite number between -5 and 5 m",)),
        (("figure", "1", "--out", "a.png", "--set", "n=5"), ("n must be one of bin_width, count",)),
        (("figure", "3", "--out", "a.png", "--set", "mode=x"), ("one of position, distance", "'x'")),
        (("figure", "1", "--out", "a.png", "--seed", "-1"), ("--seed must be a whole number",)),
        (("figure", "1"), ("--out",)),
        (("export", "1", "--notebook", "a.txt"), ("expected a file .ipynb", "a.txt")),
        (("export", "nothing", "--notebook", "a.ipynb"), ("lesson must be one of ", "got 'nothing'")),
        ((), ("command",)),
        (("nothing",), ("nothing",)),
    ],
)
def test_wrong_use_is_refused(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], parts: tuple[str, ...]
) -> None:
    """One line that says what was wrong and what is allowed; nothing is written."""
    monkeypatch.chdir(tmp_path)
    refused(call("lessons", *arguments), 2, *parts)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("place", ["missing/a.png", "folder.png"])
def test_what_cannot_be_written_is_refused(call: Call, tmp_path: Path, place: str) -> None:
    """A folder that does not exist, or one in the place of the file."""
    (tmp_path / "folder.png").mkdir()
    refused(call("lessons", "figure", "1", "--out", tmp_path / place), 1, place, "cannot be written")


def test_a_run_has_no_figure(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A lesson that shows a run says which, and how to draw that."""
    run = Scenario(experiment="sine", tracker="kalman")
    monkeypatch.setitem(LESSONS.made, "probability", replace(LESSONS["probability"], body=run))
    refused(call("lessons", "figure", "1", "--out", tmp_path / "a.png"), 2, "shows a run", "`pftrack run sine`")


LECTURED = """---
id: halves
title: Two halves
figure: joint
parameters: {correlation: 0.5}
question:
  text: Where is x after a cut at 1.2?
  tolerance: 0.1
  words: The cut moves x by half of z.
answer: Mean of x, given z
tries: [Turn r to 0.]
notice: The cut moves half as far.
---
Nothing more than an example of a lesson that stands beside the course.
"""


@pytest.fixture
def lectured(tmp_path: Path) -> Path:
    """A folder with a lecturer's lesson, and a file that is none."""
    folder = tmp_path / "lessons"
    folder.mkdir()
    (folder / "halves.md").write_text(LECTURED, encoding="utf-8")
    (folder / "broken.md").write_text(LECTURED.replace("id: halves", "id: [1"), encoding="utf-8")
    return folder


def test_lessons_of_a_folder_stand_beside_the_course(call: Call, lectured: Path) -> None:
    """They are listed and checked; a file that is wrong is told of by name and line, and harms no other."""
    status, out, err = call("lessons", "list", "--lessons", lectured, "--json")
    assert status == 0
    listed = json.loads(out)
    assert [it["id"] for it in listed[: len(LESSONS)]] == list(LESSONS)
    assert next(it for it in listed if it["id"] == "halves")["number"] == 0
    assert "broken.md, line" in err
    status, out, _ = call("lessons", "check", "halves", "--lessons", lectured, "--json")
    assert status == 0
    assert {row["lesson"] for row in json.loads(out)} <= {"halves"}


def test_a_lesson_of_a_folder_is_drawn_and_exported(call: Call, lectured: Path, tmp_path: Path) -> None:
    """Its figure has its own values; its notebook carries the file and needs no folder."""
    place = tmp_path / "halves.json"
    assert call("lessons", "figure", "halves", "--lessons", lectured, "--out", place)[0] == 0
    data = json.loads(place.read_text(encoding="utf-8"))
    assert data["parameters"]["correlation"] == 0.5
    assert data["numbers"][0]["value"] == pytest.approx(0.6)
    book = tmp_path / "halves.ipynb"
    assert call("lessons", "export", "halves", "--lessons", lectured, "--notebook", book)[0] == 0
    cells = [cell for cell in json.loads(book.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == "code"]
    known: dict[str, object] = {}
    exec("".join(cells[0]["source"]), known)  # noqa: S102 - it is the code that is tested
    assert getattr(known["lesson"], "title", "") == "Two halves"
    assert str(lectured) not in book.read_text(encoding="utf-8")


def test_a_scenario_is_exported_as_it_is(call: Call, tmp_path: Path) -> None:
    """Its notebook has the recipe that is asked about; values are changed there and not on the command line."""
    book = tmp_path / "colour.ipynb"
    assert call("lessons", "export", 12, "--notebook", book)[0] == 0
    assert "sharpness': 200" in book.read_text(encoding="utf-8").replace('\\"', "'")
    refused(call("lessons", "export", 12, "--seed", 3, "--notebook", book), 2, "shows a run", "recipe in its notebook")


def test_a_check_that_cannot_be_computed_says_why(call: Call, lectured: Path) -> None:
    """The answer of a lecturer's lesson may be none of its choices: the check fails, and the sentence is told."""
    asked = LECTURED.replace("  tolerance: 0.1\n", "  kind: choice\n  choices: {near: It is near, far: It is far}\n")
    answer = "answer: {measure: 'Mean of x, given z', choices: {near: 900, far: 1000}}"
    (lectured / "halves.md").write_text(asked.replace("answer: Mean of x, given z", answer), encoding="utf-8")
    status, out, err = call("lessons", "check", "halves", "--lessons", lectured, "--json")
    assert status == 1
    assert [(row["ours"], row["status"]) for row in json.loads(out)] == [(None, "fail")]
    assert "halves, answer: Mean of x, given z is 0.6, below the lowest number of every choice" in " ".join(err.split())


def test_a_folder_that_is_none_is_refused(call: Call, tmp_path: Path) -> None:
    """By its name."""
    refused(call("lessons", "list", "--lessons", tmp_path / "nowhere"), 2, "--lessons expected a folder", "nowhere")
