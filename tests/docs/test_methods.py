"""Pages on methods: what they name exists, their formulas can be read, and sources are cited by author everywhere."""

import re
from pathlib import Path

import pytest

from pftrack_server.core.markdown import paragraphs

ROOT = Path(__file__).parents[2]
METHODS = ROOT / "docs" / "methods"
PAGES = sorted(METHODS.glob("*.md"))

ROOMS = ("pftrack", "server", "frontend_static", "docs", "tests", "benchmarks", "examples", "tools", "docker")
ENDINGS = {".css", ".html", ".js", ".md", ".py", ".toml"}
GENERATED = {"node_modules", "__pycache__", "data"}

NUMBERED = re.compile(r"\b(?:document|spec|specification)s?,? (?:section )?\d", re.IGNORECASE)
UNNAMED = re.compile(r"\bthe (?:source )?(?:document|specification)\b", re.IGNORECASE)
MEANT = {"frontend_static/shared/theme.js": "the page's document"}
"""Files where the words mean something else."""


def sources() -> list[Path]:
    """Every file in which a person reads prose or comments."""
    files = [path for room in ROOMS for path in sorted((ROOT / room).rglob("*")) if path.suffix in ENDINGS]
    return [path for path in files if not GENERATED.intersection(path.relative_to(ROOT).parts)]


def prose(path: Path) -> str:
    """The text of a file with lines joined, and without what begins a line of a comment."""
    return re.sub(r"\s*\n\s*(?:#|//|\*)?\s*", " ", path.read_text("utf-8"))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_files_and_formulas_of_a_page(page: Path) -> None:
    """A page names the modules that it describes, which exist, and the reader of lessons can read every formula."""
    named = set(re.findall(r"`((?:pftrack|server|frontend_static|docs|tests)/[^`\s]+)`", page.read_text("utf-8")))
    assert named or page.name == "index.md"
    assert [name for name in sorted(named) if not (ROOT / name).exists()] == []
    html = paragraphs(page.read_text("utf-8"))
    assert re.findall(r'<code class="unread"[^>]*>(.*?)</code>', html) == []
    assert "$" not in re.sub(r"<(pre|code)>.*?</\1>", "", html, flags=re.DOTALL)


def test_sources_are_cited_by_author_and_year() -> None:
    """No text cites a paper by a number or without its name; the search finds such words across the ends of lines."""
    hits = "Document 1, ch. 3", "specification 10.3", "specification, section 5", "specs 6"
    assert all(NUMBERED.search(hit) for hit in hits)
    assert not NUMBERED.search("Bando 2007, ch. 3 section 2.1")
    assert UNNAMED.search("as the document has it")
    found = []
    for path in sources():
        name, text = str(path.relative_to(ROOT)), prose(path)
        found += [(name, hit.group()) for hit in NUMBERED.finditer(text)]
        if name not in MEANT:
            found += [(name, hit.group()) for hit in UNNAMED.finditer(text)]
    assert [hit for hit in found if hit[0] != "tests/docs/test_methods.py"] == []
