"""Code lines are counted without comments and docstrings, and may not rise."""

from collections import Counter

from tools.code_lines import code_lines, risen

PYTHON = '''"""A module."""

# A comment.
X = 1
"""What it is."""


def double(x):
    """Return twice x.

    Twice.
    """
    return (
        2 * x  # why
    )
'''
SCRIPT = """/** A function
 * of x.
 */
// A comment
export const double = (x) => {

  return 2 * x; // why
};
"""


def test_only_code_is_counted_and_a_larger_folder_is_reported() -> None:
    """Blank lines, comments and docstrings are free; so is a smaller folder, and a new one has the limit 0."""
    assert code_lines("a.py", PYTHON) == 5
    assert code_lines("a.js", SCRIPT) == 3
    found = risen(Counter({"pftrack/a": 11, "pftrack/b": 9, "pftrack/new": 1}), {"pftrack/a": 10, "pftrack/b": 10})
    assert [sentence[: sentence.index(",")] for sentence in found] == [
        "pftrack/a has 11 code lines",
        "pftrack/new has 1 code lines",
    ]
