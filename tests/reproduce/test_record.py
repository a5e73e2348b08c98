"""A record keeps results as they come, and a second call goes on with what is left."""

import json
from pathlib import Path

import pytest

from pftrack.reproduce import RESULTS, is_older, reproduce
from pftrack.reproduce.finding import PROTOCOL, Finding, Form, Record, claim, compare, read_record
from pftrack.reproduce.pool import Pool

NAMES = ("one-step", "hand-steps")


@pytest.fixture
def computed(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, bool]]:
    """What is computed, result by result; each takes no time, and one has a figure that is none."""
    told: list[tuple[str, bool]] = []

    def made_up(name: str, found: Finding) -> None:
        def compute(_pool: Pool, full: bool) -> list[Finding]:
            told.append((name, full))
            return [found]

        monkeypatch.setitem(RESULTS, name, compute)

    made_up(NAMES[0], compare("a", float("nan"), 1.0, 0.1, "here", ground=PROTOCOL, known="why"))
    made_up(NAMES[1], claim("b", 1.0, holds=True, source="here"))
    return told


def test_a_second_call_goes_on(computed: list[tuple[str, bool]], tmp_path: Path) -> None:
    """What is in the file is not computed again; the rest is, and all findings are returned."""
    path = tmp_path / "record.json"
    reproduce(NAMES[:1], full=True, record=Record(path, "one"))
    found = reproduce(NAMES, full=True, record=Record(path, "two"))
    assert sorted(computed) == sorted((name, True) for name in NAMES)
    assert [each.result for each in found[:2]] == ["a", "b"]
    assert {name: entry.revision for name, entry in read_record(path).items()} == {NAMES[0]: "one", NAMES[1]: "two"}


def test_a_full_result_takes_the_place_of_a_quick_one(computed: list[tuple[str, bool]], tmp_path: Path) -> None:
    """A quick result is computed again in full, and a full one is enough where a quick one is asked for."""
    path = tmp_path / "record.json"
    for full in (False, True, False):
        reproduce(NAMES[:1], full=full, record=Record(path, "one"))
    assert computed == [(NAMES[0], False), (NAMES[0], True)]
    assert read_record(path)[NAMES[0]].form == "full"


def test_a_record_comes_back_as_it_was(computed: list[tuple[str, bool]], tmp_path: Path) -> None:
    """Findings are the same after they were written and read, also one without a number."""
    path = tmp_path / "record.json"
    before = reproduce(NAMES, record=Record(path, "one"))[:2]
    after = [one for name in NAMES for one in read_record(path)[name].findings]
    assert [one.as_dict() for one in after] == [one.as_dict() for one in before]
    assert computed


@pytest.mark.parametrize(
    ("before", "asked", "again"), [("full", True, True), ("quick", False, True), ("full", False, False)]
)
def test_a_result_of_older_sources_is_computed_again(
    before: Form, asked: bool, again: bool, computed: list[tuple[str, bool]], tmp_path: Path
) -> None:
    """It is older than the code until then; a full one stays where a quick one is asked for."""
    record, (name, _) = Record(tmp_path / "record.json", "one"), NAMES
    record.keep(name, before, [], sources="of another day", pieces=1, seconds=0.0)
    assert is_older(name, read_record(record.path)[name])
    reproduce([name], full=asked, record=record)
    assert computed == [(name, asked)] * again
    assert is_older(name, read_record(record.path)[name]) is not again


@pytest.mark.parametrize("text", ["", "[]", '{"results": {"a": {}}}', json.dumps({"results": {"a": {"form": 1}}})])
def test_another_file_is_refused(text: str, tmp_path: Path) -> None:
    """A file that is no record is not written over."""
    path = tmp_path / "record.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match="no record of reproduced results"):
        Record(path, "one")
    assert path.read_text(encoding="utf-8") == text
