"""Mutations change the code, and only the code."""

from tools.mutations import faults_of

PYTHON = '''def mean(values: list[float]) -> float:
    """Return 1 + 1."""
    if not values and True:
        print("ø", 0.5)
    return sum(values) / len(values)
'''
SCRIPT = 'const f = (x) => x > 1 && x !== "a && b"; // 2\n'


def test_only_code_has_faults() -> None:
    """Each operator, number, condition and call has a fault; comments, docstrings and texts have none."""
    found = {fault.after for fault in faults_of("a.py", PYTHON)}
    assert found == {"*", "or", "False", "(not (not values and True))", "(0.5 + 1)", "pass"}
    assert {fault.before for fault in faults_of("a.js", SCRIPT)} == {" > ", "&&", "!==", "1"}
