"""The documentation runs, and its links lead somewhere."""

import re
from pathlib import Path

import pytest

from pftrack.sources.limits import DEFAULT_LIMITS, check_pixels

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_python_blocks_run(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every block of Python in a page runs as it stands, and may write where it is run."""
    monkeypatch.chdir(tmp_path)
    for block in re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL):
        exec(compile(block, page.name, "exec"), {})  # noqa: S102 - our own documentation


NO_PROSE = re.compile(r"```.*?```|`[^`]*`|\$\$.*?\$\$|\$[^$]+\$|\]\([^)]*\)|<!--.*?-->", re.DOTALL)
RAW = re.compile(r"\b(?:[A-Za-z]|alpha|gamma|lambda|mu|sigma|tau|theta)_(?:\w{1,4}\b|\{)")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_what_a_page_names_is_so(page: Path) -> None:
    """Every link to a file of the project finds it, and no limit and no picture's size is named that is refused.

    What has a subscript is written as a formula, which the pages set, or as code; elsewhere its _ would be shown.
    """
    text = page.read_text()
    links = [target for target in re.findall(r"\]\(([^)#]+)\)", text) if "://" not in target]
    assert [target for target in links if not (page.parent / target).exists()] == []
    for width, height in re.findall(r"(\d[\d,]*) x (\d[\d,]*) px", text):
        check_pixels(int(width.replace(",", "")), int(height.replace(",", "")), DEFAULT_LIMITS, "the picture has")
    assert set(re.findall(r"more than ([\d,]+) pixels are refused", text)) <= {f"{DEFAULT_LIMITS.pixels:,}"}
    assert RAW.findall(NO_PROSE.sub("", text)) == []


def test_the_blocks_of_the_example_are_its_own_code() -> None:
    """What the page on extending quotes stands in the example, and the blocks come in the order of the steps."""
    example = ROOT / "examples" / "own_experiment"
    code = [file.read_text() for file in [example / "pyproject.toml", *example.rglob("*.py")]]
    blocks = re.findall(r"```(?:py|toml)\n(.*?)```", (ROOT / "docs" / "how-to" / "extending.md").read_text(), re.DOTALL)
    assert len(blocks) > 8
    for block in blocks:
        assert any(block in text for text in code), block


def ways() -> dict[str, list[str]]:
    """The steps of each way through the program that the page on the architecture describes."""
    text = (ROOT / "docs" / "explanation" / "architecture.md").read_text()
    sections = re.findall(r"^### The way of ([^\n]+)\n(.*?)(?=^##)", text, re.DOTALL | re.MULTILINE)
    step = re.compile(r"^\d+\. (.*?)(?=^\d+\. |\Z)", re.DOTALL | re.MULTILINE)
    return {name: step.findall(steps) for name, steps in sections}


@pytest.mark.parametrize("way", ["a slider", "a frame", "an upload", "a lesson's slider"])
def test_a_way_is_short_and_leads_through_files_that_exist(way: str) -> None:
    """A slider, a frame, an upload and a lesson take at most twelve steps, and every file that these name is there."""
    steps = ways()[way]
    assert 5 <= len(steps) <= 12
    assert len(ways()) == 4
    homes = ROOT, ROOT / "pftrack", ROOT / "server" / "pftrack_server", ROOT / "frontend_static"
    named = [name for step in steps for name in re.findall(r"`([\w/]+(?:\.py|\.js|/))`", step)]
    assert len(named) > len(steps) / 2
    assert [name for name in named if not any((home / name).exists() for home in homes)] == []
