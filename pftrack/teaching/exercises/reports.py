"""Reports in the form that graders of courses take: Gradescope's `results.json`, which otter-grader writes as well."""

from collections.abc import Mapping, Sequence
from typing import Any

from pftrack.teaching.exercises.checking import Report

__all__ = ["results", "table_of"]


def results(report: Report) -> dict[str, Any]:
    """Return a report as Gradescope's results: a score, and one test for each property."""
    tests = [
        {
            "number": str(number),
            "name": each.title,
            "score": each.points,
            "max_score": each.check.points,
            "status": "passed" if each.verdict.holds else "failed",
            "output": each.verdict.words,
            "visibility": "visible",
            "extra_data": {
                "property": each.check.property,
                "seed": each.verdict.seed,
                "numbers": dict(each.verdict.numbers),
            },
        }
        for number, each in enumerate(report.findings, 1)
    ]
    held = sum(each.verdict.holds for each in report.findings)
    return {
        "score": report.points,
        "max_score": report.exercise.points,
        "execution_time": round(report.seconds, 1),
        "output": f"{report.exercise.title}: {held} of {len(tests)} properties hold.",
        "visibility": "visible",
        "extra_data": {"exercise": report.exercise.id, "file": report.file},
        "tests": tests,
    }


def table_of(graded: Mapping[str, Mapping[str, Any]]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return a lecturer's table of many results: its columns, and a row for each submission.

    Args:
        graded: Results by submission.
    """
    properties: list[str] = []
    for each in graded.values():
        properties += [name for name in _by_property(each) if name not in properties]
    columns = ("name", "exercise", *properties, "score", "of", "problem")
    return columns, [_row(name, each, properties) for name, each in graded.items()]


def _by_property(found: Mapping[str, Any]) -> dict[str, str]:
    return {test["extra_data"]["property"]: f"{test['score']:g}" for test in found.get("tests", ())}


def _row(name: str, found: Mapping[str, Any], properties: Sequence[str]) -> tuple[str, ...]:
    points = _by_property(found)
    problem = "" if found.get("tests") else str(found.get("output", ""))
    shown = [points.get(each, "") for each in properties]
    exercise = str(found.get("extra_data", {}).get("exercise", ""))
    return name, exercise, *shown, f"{found['score']:g}", f"{found['max_score']:g}", problem
