"""The documentation as a site: every page is listed, no link is broken, and nothing comes from other hosts."""

import re
import subprocess
import sys
from collections.abc import Iterator
from html import unescape
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from tools.pictures.live import LIVE
from tools.pictures.shots import FILMS, PICTURES
from tools.site import rest
from tools.site.contents import entries
from tools.site.inserts import NAMED, OUTSIDE
from tools.site.python_pages import INTERNAL, ROOMS

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))


def listed(index: Path) -> Iterator[Path]:
    """The pages below an index, and below the indexes that it lists."""
    for entry in entries(index.read_text("utf-8")):
        page = (index.parent / f"{entry}.md").resolve()
        yield page
        if page.name == "index.md":
            yield from listed(page)


def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as code hosts and the site make them."""
    text = re.sub(r"```.*?```", "", page.read_text("utf-8"), flags=re.DOTALL)
    headings = (re.sub(r"\[(.*?)\]\(.*?\)|`", r"\1", it).lower() for it in re.findall(r"^#+ (.+)$", text, re.MULTILINE))
    return {re.sub(r"[^\w\- ]", "", heading).strip().replace(" ", "-") for heading in headings}


def test_every_page_is_in_a_table_of_contents() -> None:
    """Every page is listed in an index, once."""
    found = [DOCS / "index.md", *listed(DOCS / "index.md")]
    assert sorted(found) == PAGES


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(DOCS)))
def test_anchors_exist(page: Path) -> None:
    """A link to a part of a page names one of its headings."""
    for target, anchor in re.findall(r"\]\(([^)#\s]*\.md|)#([^)\s]+)\)", page.read_text("utf-8")):
        assert anchor in anchors((page.parent / target) if target else page), f"{target}#{anchor}"


def test_every_picture_that_a_page_names_is_made() -> None:
    """Pictures, films and live pages have their makers, and every made one is shown."""
    named: dict[str, set[str]] = {"picture": set(), "film": set(), "live": set(), "reference": set(), "file": set()}
    for page in PAGES:
        for kind, name, words in NAMED.findall(page.read_text("utf-8")):
            named[kind].add(name)
            assert words or kind in {"reference", "file"}, f"{page.name} shows {name} without words"
    assert named["picture"] == PICTURES.keys()
    assert named["film"] == FILMS.keys()
    assert named["live"] == LIVE.keys()
    assert named["reference"] == {"command-line", "glossary", "python", "rest"}
    assert named["file"] == OUTSIDE.keys()


class _Links:
    """Addresses that a page loads, addresses that it links to, and its anchors."""

    def __init__(self, page: Path) -> None:
        tags = re.findall(r"<[a-z][^>]*>", page.read_text("utf-8"))

        def values(names: str, *elements: str) -> list[str]:
            some = [tag for tag in tags if not elements or tag.startswith(elements)]
            return [unescape(it) for tag in some for it in re.findall(rf'\s(?:{names})="([^"]*)"', tag)]

        self.loaded = [*values("src|poster"), *values("href", "<link")]
        self.linked = values("href", "<a ")
        self.anchors = set(values("id|name"))


def test_the_references_are_complete() -> None:
    """Every package is described or internal; every address has one kind, and every kind a title."""
    packages = {f"pftrack.{each.parent.name}" for each in (ROOT / "pftrack").glob("*/__init__.py")}
    assert packages <= {*ROOMS, *INTERNAL}
    assert not INTERNAL & {*ROOMS}
    tags = [it["tags"] for methods in rest.description()["paths"].values() for it in methods.values()]
    assert all(len(each) == 1 for each in tags)
    assert {tag for each in tags for tag in each} == {*rest.WORDS}


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, without pictures."""
    pytest.importorskip("sphinx")
    place = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "tools.site", "--pictures", "none", "--out", str(place)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return place


@pytest.mark.slow
def test_every_link_of_the_site_leads_somewhere(built: Path) -> None:
    """Each relative link finds a file, and each anchor its place; none is absolute, as the site lies below any path."""
    pages = {page.resolve(): _Links(page) for page in built.rglob("*.html") if "media" not in page.parts}
    assert len(pages) > 70
    broken = []
    for page, links in pages.items():
        for link in (*links.linked, *links.loaded):
            parts = urlsplit(link)
            if parts.scheme:
                continue
            target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            known = pages.get(target)
            found = target.is_file() and (
                not parts.fragment or known is None or unquote(parts.fragment) in known.anchors
            )
            if link.startswith("/") or not found:
                broken.append(f"{page.relative_to(built.resolve())}: {link}")
    assert broken == []


@pytest.mark.slow
def test_the_site_asks_no_other_host(built: Path) -> None:
    """Scripts, styles, fonts and pictures come with the site, and no page has a script in it."""
    for page in built.rglob("*.html"):
        if "media" in page.parts:
            continue
        text = page.read_text("utf-8")
        links = _Links(page)
        assert [link for link in links.loaded if "//" in link] == [], page
        assert re.findall(r"<script(?![^>]*\bsrc=)", text) == [], page
    for style in built.rglob("*.css"):
        assert re.findall(r"url\(\s*[\"']?(?:https?:)?//|@import", style.read_text("utf-8")) == [], style


@pytest.mark.slow
def test_the_references_are_whole(built: Path) -> None:
    """Every command, every address and every public name of `pftrack` has its place."""
    import pftrack
    from tools.site import command_line

    commands = re.sub(r"<[^>]+>", "", (built / "reference" / "command-line.html").read_text("utf-8"))
    assert [name for name, _ in command_line.commands() if f"{name}¶" not in commands] == []
    addresses = (built / "reference" / "rest.html").read_text("utf-8")
    assert all(path in addresses for path in rest.description()["paths"])
    names = _Links(built / "reference" / "api" / "pftrack.html").anchors
    assert {f"pftrack.{name}" for name in pftrack.__all__ if not name.startswith("__")} <= names
    assert "<math" in (built / "methods" / "filters.html").read_text("utf-8")
