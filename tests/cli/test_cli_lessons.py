"""`pftrack lessons`: list, check, draw and export."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from pftrack.teaching.lessons import LESSONS, Figure
from pftrack.teaching.lessons.course import probability
from pftrack.teaching.lessons.lesson import Demonstration, Scenario
from tests.cli.commands import Ask, Call, refused


def test_list_has_every_lesson_with_its_checks(ask: Ask) -> None:
    """It gives id, number, title and the names of the checks, in the order of the course."""
    assert ask("lessons", "list")[: len(LESSONS)] == [
        {"id": it.id, "number": it.number, "title": it.title, "checks": [check.name for check in it.checks]}
        for it in LESSONS.values()
    ]


def test_check_computes_the_claims(call: Call, ask: Ask) -> None:
    """It gives the figures of each check of the named lessons, by id or number."""
    found = ask("lessons", "check", "probability", "2")
    lessons = LESSONS["probability"], LESSONS["joint"]
    names = [(it.id, each.name) for it in lessons for each in it.checks]
    assert [(row["lesson"], row["check"]) for row in found] == names
    counted = next(row for row in found if row["check"] == "counting")
    ours, exact = pytest.approx(0.2861, abs=0.0106), pytest.approx(0.2861, abs=1e-4)
    figures = {"ours": ours, "exact": exact, "tolerance": 0.0106, "status": "pass"}
    assert counted == {"lesson": "probability", "check": "counting", **figures}
    assert "counting" in call("lessons", "check", "probability")[1]


def test_figure_writes_data_and_prints_numbers(ask: Ask, tmp_path: Path) -> None:
    """The file has the figure as the pages get it, with the given values and seed."""
    place = tmp_path / "figure.json"
    given = "--set", "count=50", "--set", "bin_width=0.1", "--seed", 3
    told, data = ask("lessons", "figure", "1", *given, "--out", place), json.loads(place.read_text(encoding="utf-8"))
    body = LESSONS["probability"].body
    assert isinstance(body, Demonstration)
    parameters = probability.ProbabilityParameters(count=50, bin_width=0.1)
    shown = body.show(parameters, 3)
    assert data["figure"] == shown.figure.model_dump(mode="json")
    Figure.model_validate(data["figure"])
    assert [number["value"] for number in data["numbers"]] == [number.value for number in shown.numbers]
    assert (told["seed"], told["parameters"]) == (3, parameters.model_dump())
    assert told["numbers"] == data["numbers"]


def test_figure_draws_pictures(call: Call, tmp_path: Path) -> None:
    """The suffix decides on the format; the numbers are printed with the exact ones."""
    status, out, err = call("lessons", "figure", "probability", "--out", tmp_path / "a.SVG")
    assert (status, "Area of the histogram" in out, "0.2861" in out) == (0, True, True)
    assert (tmp_path / "a.SVG").read_bytes().startswith(b"<?xml")
    assert f"written to {tmp_path / 'a.SVG'}" in err


def test_export_writes_a_notebook_with_the_values_given(call: Call, tmp_path: Path) -> None:
    """Its cells contain values and seed."""
    place = tmp_path / "lesson.ipynb"
    assert call("lessons", "export", "bayes", "--set", "mode=distance", "--seed", 9, "--notebook", place)[0] == 0
    book = json.loads(place.read_text(encoding="utf-8"))
    source = "".join("".join(cell["source"]) for cell in book["cells"])
    assert ("'mode': 'distance'" in source, "seed = 9" in source) == (True, True)


def test_a_run_has_no_figure(call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The refusal names the command that draws the run."""
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
    """Return a folder with a lecturer's lesson and a broken file."""
    folder = tmp_path / "lessons"
    folder.mkdir()
    (folder / "halves.md").write_text(LECTURED, encoding="utf-8")
    (folder / "broken.md").write_text(LECTURED.replace("id: halves", "id: [1"), encoding="utf-8")
    return folder


def test_lessons_of_a_folder_follow_the_course(call: Call, lectured: Path) -> None:
    """They are listed; a broken file is reported by name and line."""
    status, out, err = call("lessons", "list", "--lessons", lectured, "--json")
    assert status == 0
    listed = json.loads(out)
    assert [it["id"] for it in listed[: len(LESSONS)]] == list(LESSONS)
    assert next(it for it in listed if it["id"] == "halves")["number"] == 0
    assert "broken.md, line" in err


def test_a_lesson_of_a_folder_is_drawn_and_exported(call: Call, lectured: Path, tmp_path: Path) -> None:
    """Its figure has its own values; its notebook contains the file and no path."""
    place = tmp_path / "halves.json"
    assert call("lessons", "figure", "halves", "--lessons", lectured, "--out", place)[0] == 0
    data = json.loads(place.read_text(encoding="utf-8"))
    assert data["parameters"]["correlation"] == 0.5
    assert data["numbers"][0]["value"] == pytest.approx(0.6)
    book = tmp_path / "halves.ipynb"
    assert call("lessons", "export", "halves", "--lessons", lectured, "--notebook", book)[0] == 0
    written = book.read_text(encoding="utf-8")
    assert ("Two halves" in written, str(lectured) in written) == (True, False)


def test_a_failed_check_has_a_reason(call: Call, lectured: Path) -> None:
    """The answer of a lecturer's lesson is below all of its choices: status 1, with the reason."""
    asked = LECTURED.replace("  tolerance: 0.1\n", "  kind: choice\n  choices: {near: It is near, far: It is far}\n")
    answer = "answer: {measure: 'Mean of x, given z', choices: {near: 900, far: 1000}}"
    (lectured / "halves.md").write_text(asked.replace("answer: Mean of x, given z", answer), encoding="utf-8")
    status, out, err = call("lessons", "check", "halves", "--lessons", lectured, "--json")
    assert status == 1
    assert [(row["ours"], row["status"]) for row in json.loads(out)] == [(None, "fail")]
    assert "1 of 1 checks lie outside their tolerances" in err
    assert "halves, answer: Mean of x, given z is 0.6, below the lowest number of every choice" in " ".join(err.split())
