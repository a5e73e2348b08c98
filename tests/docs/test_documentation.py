"""The documentation runs, and its links lead somewhere."""

import re
from pathlib import Path

import pytest

from pftrack.sources.limits import DEFAULT_LIMITS, check_pixels
from tests.pooling import fork_server, shared_fork_server

__all__ = ["fork_server", "shared_fork_server"]

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]


SLOW = ROOT / "docs" / "how-to" / "why.md"
"""It computes hundreds of runs to compare rates; tests/analysis holds what it calls on fewer."""


@pytest.mark.parametrize(
    "page",
    [pytest.param(page, marks=pytest.mark.slow) if page == SLOW else page for page in PAGES],
    ids=lambda page: str(page.relative_to(ROOT)),
)
def test_python_blocks_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every block of Python in a page runs unchanged, in a folder where it may write."""
    monkeypatch.chdir(tmp_path)
    for block in re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL):
        exec(compile(block, page.name, "exec"), {})  # noqa: S102 - our own documentation


NO_PROSE = re.compile(r"```.*?```|`[^`]*`|\$\$.*?\$\$|\$[^$]+\$|\]\([^)]*\)|<!--.*?-->", re.DOTALL)
RAW = re.compile(r"\b(?:[A-Za-z]|alpha|gamma|lambda|mu|sigma|tau|theta)_(?:\w{1,4}\b|\{)")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_limits_and_formulas(page: Path) -> None:
    """Links to files of the project find them, and named limits and sizes of pictures are accepted.

    Anything with a subscript is a formula or code; elsewhere its _ would be shown.
    """
    text = page.read_text()
    links = [target for target in re.findall(r"\]\(([^)#]+)\)", text) if "://" not in target]
    assert [target for target in links if not (page.parent / target).exists()] == []
    for width, height in re.findall(r"(\d[\d,]*) x (\d[\d,]*) px", text):
        check_pixels(int(width.replace(",", "")), int(height.replace(",", "")), DEFAULT_LIMITS, "the picture has")
    assert set(re.findall(r"more than ([\d,]+) pixels are refused", text)) <= {f"{DEFAULT_LIMITS.pixels:,}"}
    assert RAW.findall(NO_PROSE.sub("", text)) == []


def test_the_blocks_of_the_example_are_its_own_code() -> None:
    """Every quoted block of the page on extending is in the example."""
    example = ROOT / "examples" / "own_experiment"
    code = [file.read_text() for file in [example / "pyproject.toml", *example.rglob("*.py")]]
    blocks = re.findall(r"```(?:py|toml)\n(.*?)```", (ROOT / "docs" / "how-to" / "extending.md").read_text(), re.DOTALL)
    assert len(blocks) > 8
    for block in blocks:
        assert any(block in text for text in code), block


def test_the_ways_through_the_program_are_short() -> None:
    """A slider, a frame, an upload and a lesson take at most twelve steps, and every named file exists."""
    text = (ROOT / "docs" / "explanation" / "architecture.md").read_text()
    ways = re.findall(r"^### The way of [^\n]+\n(.*?)(?=^##)", text, re.DOTALL | re.MULTILINE)
    assert len(ways) == 4
    homes = ROOT, ROOT / "pftrack", ROOT / "server" / "pftrack_server", ROOT / "frontend_static"
    for way in ways:
        steps = len(re.findall(r"^\d+\. ", way, re.MULTILINE))
        assert 5 <= steps <= 12
        named = re.findall(r"`([\w/]+(?:\.py|\.js|/))`", way)
        assert len(named) > steps / 2
        assert [name for name in named if not any((home / name).exists() for home in homes)] == []
