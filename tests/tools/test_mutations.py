"""Faults that the tests should catch are real ones: each changes the code, and only the code."""

import ast

from tools.mutations import ROOT, draw, faults_of

PYTHON = '''def mean(values: list[float]) -> float:
    """Return 1 + 1."""
    if not values and True:
        print("ø", 0.5)
    return sum(values) / len(values)
'''
SCRIPT = 'const f = (x) => x > 1 && x !== "a && b"; // 2\n'


def test_each_operator_number_condition_and_call_is_a_fault() -> None:
    """Comments, docstrings and texts have none."""
    found = {fault.after for fault in faults_of("a.py", PYTHON)}
    assert found == {"*", "or", "False", "(not (not values and True))", "(0.5 + 1)", "pass"}
    assert {fault.before for fault in faults_of("a.js", SCRIPT)} == {" > ", "&&", "!==", "1"}


def test_faults_are_drawn_again_alike_and_can_be_put_in() -> None:
    """Python with a fault in it is still Python."""
    faults = draw(12, seed=1)
    assert faults == draw(12, seed=1)
    for fault in faults:
        text = (ROOT / fault.file).read_text(encoding="utf-8")
        changed = fault.applied(text)
        assert changed != text
        if fault.file.endswith(".py"):
            ast.parse(changed)
