"""The registry finds lessons by id and by number, and imports none before it is asked for."""

import subprocess
import sys

import pytest

from pftrack.core.refusal import RefusedError
from pftrack.teaching.lessons import LESSONS, find


def test_numbers_are_the_order_of_the_course() -> None:
    """A lesson has the id under which it is listed, and numbers rise along the list."""
    assert [lesson.id for lesson in LESSONS.values()] == list(LESSONS)
    numbers = [lesson.number for lesson in LESSONS.values()]
    assert numbers == sorted(set(numbers))
    assert all(1 <= number <= 12 for number in numbers)


@pytest.mark.parametrize("name", LESSONS)
def test_a_lesson_is_found_by_id_and_number(name: str) -> None:
    """Both lead to the same lesson."""
    assert find(name) is LESSONS[name]
    assert find(str(LESSONS[name].number)) is LESSONS[name]


@pytest.mark.parametrize("wanted", ["", "nothing", "0", "99", "-1", "1.5", "Probability"])
def test_an_unknown_lesson_is_refused_with_those_that_there_are(wanted: str) -> None:
    """The sentence quotes what was asked for and lists numbers and ids."""
    with pytest.raises(RefusedError) as caught:
        find(wanted)
    sentence = caught.value.args[0]
    assert repr(wanted) in sentence
    assert all(f"{lesson.number} {name}" in sentence for name, lesson in LESSONS.items())


def test_listing_ids_imports_no_lesson() -> None:
    """The ids are known without any lesson's module."""
    code = "import sys; from pftrack.teaching.lessons import LESSONS; list(LESSONS); print(*sys.modules)"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert "pftrack.teaching.lessons" in told
    assert "pftrack.teaching.lessons.course" not in told
