"""Mutations change the code, and only the code."""

import ast

from tools.mutations import ROOT, draw, faults_of

PYTHON = '''def mean(values: list[float]) -> float:
    """Return 1 + 1."""
    if not values and True:
        print("ø", 0.5)
    return sum(values) / len(values)
'''
SCRIPT = 'const f = (x) => x > 1 && x !== "a && b"; // 2\n'


def test_faults_are_real_and_drawn_again_alike() -> None:
    """Each operator, number, condition and call has a fault, comments, docstrings and texts have none.

    Python with a fault in it is still Python.
    """
    found = {fault.after for fault in faults_of("a.py", PYTHON)}
    assert found == {"*", "or", "False", "(not (not values and True))", "(0.5 + 1)", "pass"}
    assert {fault.before for fault in faults_of("a.js", SCRIPT)} == {" > ", "&&", "!==", "1"}
    faults = draw(6, seed=1)
    assert faults == draw(6, seed=1)
    for fault in faults:
        text = (ROOT / fault.file).read_text(encoding="utf-8")
        changed = fault.applied(text)
        assert changed != text
        if fault.file.endswith(".py"):
            ast.parse(changed)
