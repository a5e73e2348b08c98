"""The sources of a result are its study, all that it imports, and the experiments that it names."""

from pathlib import Path

import pytest

from pftrack.reproduce import RESULTS, sources


def names_of(result: str) -> set[str]:
    found = sources.list_sources(RESULTS[result].__module__)
    return {path.relative_to(sources.ROOT).as_posix() for path in found}


@pytest.mark.parametrize(
    ("result", "inside", "outside"),
    [
        (
            "occlusion",
            ("reproduce/ball/study", "experiments/ball/model", "experiments/ball/experiment"),
            "experiments/hand",
        ),
        ("hand", ("reproduce/hand", "experiments/hand/likelihood", "experiments/hand/experiment"), "experiments/ball"),
        ("diagnosis", ("analysis/diagnosis/weights", "experiments/ball/experiment"), "teaching"),
    ],
)
def test_a_result_depends_on_what_it_imports(result: str, inside: tuple[str, ...], outside: str) -> None:
    """Its tracker and its experiment are among its sources, those of other studies are not."""
    found = names_of(result)
    assert {f"pftrack/{name}.py" for name in inside} <= found
    assert [name for name in found if name.startswith(f"pftrack/{outside}/")] == []


def test_data_beside_the_code_count() -> None:
    """What a tracker has learned beforehand is among the sources."""
    assert "pftrack/experiments/fish/learned.json" in names_of("fish")


def test_a_change_anywhere_below_changes_the_hash(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A study has another hash when a module that it imports by way of another does; one beside them does not count."""
    monkeypatch.setattr(sources, "ROOT", tmp_path)
    folder = tmp_path / "pftrack"
    folder.mkdir()
    texts = {"study": "from pftrack import middle", "middle": "import pftrack.below", "below": "", "beside": ""}
    for name, text in texts.items():
        (folder / f"{name}.py").write_text(text, encoding="utf-8")
    hashes = []
    for changed in ("", "beside", "below"):
        if changed:
            (folder / f"{changed}.py").write_text("ANYTHING = 1", encoding="utf-8")
        sources.hash_sources.cache_clear()
        hashes.append(sources.hash_sources("pftrack.study"))
    assert hashes[0] == hashes[1] != hashes[2]
