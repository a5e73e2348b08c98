"""A record keeps results as they come, and a second call goes on with what is left."""

from pathlib import Path

import pytest

from pftrack.reproduce import RESULTS, finding, is_older, reproduce
from pftrack.reproduce.finding import Finding, Form, Record, Statement, read_record
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

        monkeypatch.setattr(f"{RESULTS[name].module}.{RESULTS[name].function}", compute)

    unknown = Statement(result="a", source="here", reference=1.0, tolerance=0.1, ground="stated", known="why")  # type: ignore[arg-type]
    made_up(NAMES[0], unknown.judge(float("nan")))
    made_up(NAMES[1], Statement(result="b", source="here", least=1.0).judge(1.0))
    return told


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "record.json"


def test_a_second_call_continues(computed: list[tuple[str, bool]], path: Path) -> None:
    """What is in the file is not computed again; the rest is, and all findings are returned."""
    reproduce(NAMES[:1], full=True, record=Record(path, "one"))
    found = reproduce(NAMES, full=True, record=Record(path, "two"))
    assert sorted(computed) == sorted((name, True) for name in NAMES)
    assert [each.result for each in found[:2]] == ["a", "b"]
    kept = read_record(path)
    assert {name: entry.revision for name, entry in kept.items()} == {NAMES[0]: "one", NAMES[1]: "two"}
    # Findings are the same after they were written and read, also one without a number.
    assert [one.as_dict() for name in NAMES for one in kept[name].findings] == [one.as_dict() for one in found[:2]]


def test_a_full_result_takes_the_place_of_a_quick_one(computed: list[tuple[str, bool]], path: Path) -> None:
    """A quick result is computed again in full, and a full one is enough where a quick one is asked for."""
    for full in (False, True, False):
        reproduce(NAMES[:1], full=full, record=Record(path, "one"))
    assert computed == [(NAMES[0], False), (NAMES[0], True)]
    assert read_record(path)[NAMES[0]].form == "full"


@pytest.mark.parametrize(
    ("before", "asked", "again"), [("full", True, True), ("quick", False, True), ("full", False, False)]
)
def test_what_older_sources_gave_is_computed_again(
    before: Form, asked: bool, again: bool, computed: list[tuple[str, bool]], path: Path
) -> None:
    """It is older than the code until then; a full one stays where a quick one is asked for."""
    kept, (name, _) = Record(path, "one"), NAMES
    kept.keep(name, before, [], sources="of another day", pieces=1, seconds=0.0)
    assert is_older(name, read_record(kept.path)[name])
    reproduce([name], full=asked, record=kept)
    assert computed == [(name, asked)] * again
    assert is_older(name, read_record(kept.path)[name]) is not again


@pytest.mark.parametrize("text", ["", '{"results": {"a": {"form": 1}}}'])
def test_another_file_is_refused(text: str, path: Path) -> None:
    """A file that does not hold a record is not written over."""
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match="is not a record of reproduced results"):
        Record(path, "one")
    assert path.read_text(encoding="utf-8") == text


def test_a_result_depends_on_what_it_imports() -> None:
    """Its tracker, its experiment and data beside the code are among its sources, those of other studies are not."""
    every = finding.list_sources(RESULTS["fish"].module)
    found = {path.relative_to(finding.ROOT / "pftrack").as_posix() for path in every}
    wanted = {"reproduce/fish.py", "reproduce/fish.yaml", "experiments/fish/model.py", "experiments/fish/learned.json"}
    assert wanted <= found
    assert [name for name in found if name.startswith(("reproduce/hand", "experiments/ball/"))] == []


def test_a_change_anywhere_below_changes_the_hash(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A study has another hash when the code of a module that it imports by way of another has changed.

    A module beside them does not count, nor do docstrings and comments.
    """
    monkeypatch.setattr(finding, "ROOT", tmp_path)
    (folder := tmp_path / "pftrack").mkdir()
    texts = {"study": "from pftrack import middle", "middle": "import pftrack.below", "below": "", "beside": ""}
    hashes = []
    for changed in ({}, {"beside": "ANYTHING = 1", "below": '"""New."""\n\n# words\n'}, {"below": "ANYTHING = 1"}):
        for name, text in {**texts, **changed}.items():
            (folder / f"{name}.py").write_text(text, encoding="utf-8")
        for kept in (finding.hash_sources, finding._read_source, finding._path_of):
            kept.cache_clear()
        hashes.append(finding.hash_sources("pftrack.study"))
    assert hashes[0] == hashes[1] != hashes[2]
