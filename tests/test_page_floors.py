"""The floors of the pages: a folder imports those below it, and nothing of its own floor or above."""

import re
from collections.abc import Iterator
from pathlib import Path

PAGES = (Path(__file__).parents[1] / "frontend_static").resolve()
FLOORS = (
    {"follow", "gallery", "failures", "lectures", "work"},
    {"compare", "glossary", "help", "learn", "references", "sweep", "upload"},
    {"session"},
    {"lecturer"},
    {"shared"},
    {"vendor"},
)
"""From the top: each page with what is its own, the session that others embed, a lecturer's class, what all share, and
what other people have written."""
IMPORT = re.compile(r"""(?:\bfrom|\bimport)\s*\(?\s*["'](\.[^"']+)["']""")


def imports() -> list[tuple[str, str]]:
    """Pairs of a script and a script that it imports, as paths from the pages' folder."""
    pairs = ((path, name) for path in PAGES.rglob("*.js") for name in IMPORT.findall(path.read_text(encoding="utf-8")))
    return [
        (str(path.relative_to(PAGES)), str((path.parent / name).resolve().relative_to(PAGES))) for path, name in pairs
    ]


def test_every_folder_has_its_floor() -> None:
    """No folder of the pages is without a floor, and no floor names one that is gone."""
    assert {path.name for path in PAGES.iterdir() if path.is_dir()} == set().union(*FLOORS)


def test_folders_import_only_what_lies_below() -> None:
    """So there is no circle among them, and a reader of one needs to know only those below."""
    floor = {folder: number for number, folders in enumerate(FLOORS) for folder in folders}
    pairs = [(one, other, one.split("/")[0], other.split("/")[0]) for one, other in imports()]
    assert len(pairs) > 100
    climbs = [pair for pair in pairs if pair[2] != pair[3] and floor[pair[2]] >= floor[pair[3]]]
    assert climbs == []


def test_no_script_imports_that_of_a_page() -> None:
    """It would run there, and look for parts that the other page does not have."""
    pages = [path.read_text(encoding="utf-8") for path in PAGES.rglob("*.html")]
    entries = {entry for page in pages for entry in re.findall(r'type="module" src="static/([^"]+)"', page)}
    assert len(entries) > 10
    assert [(one, other) for one, other in imports() if other in entries] == []


# Addresses in pages are relative.

COMMENT = re.compile(r"/\*.*?\*/|<!--.*?-->|^\s*//.*?$", re.DOTALL | re.MULTILINE)
QUOTED = re.compile(r"""["'`]/(?=[\w$?#"'`])[^"'`\n]*|\burl\(\s*["']?/(?!/)[^)]*""")
"""What begins with a slash, as a text of a script, an attribute or a style has it."""
SEPARATOR = re.compile(r"""\.(?:split|join|replaceAll|replace|includes|endsWith|lastIndexOf)\([^()]*["'`]/["'`]""")
"""A slash alone that separates parts of a text is not an address."""


def absolute_addresses(text: str) -> Iterator[str]:
    """Return the texts in a page, a script or a style that begin with a slash."""
    bare = SEPARATOR.sub("", COMMENT.sub("", text))
    return (found.group() for found in QUOTED.finditer(bare))


def test_no_address_of_the_pages_is_absolute() -> None:
    """Below a base path it would lead out of the server, and in a class out of the class."""
    files = [path for kind in ("html", "js", "css") for path in PAGES.rglob(f"*.{kind}") if "vendor" not in path.parts]
    found = {str(path.relative_to(PAGES)): [*absolute_addresses(path.read_text(encoding="utf-8"))] for path in files}
    assert {name: addresses for name, addresses in found.items() if addresses} == {}


def test_absolute_addresses_are_found() -> None:
    """The search finds one in each kind of file; comments, slashes that part names and relative addresses pass."""
    absolute = (
        *('<a href="/">Start</a>', '<script src="/static/a.js"></script>', "location.assign('/work');"),
        *("const page = `/session/${id}`;", 'fetch("/api/v1/runs")', "div { background: url(/static/a.svg) }"),
    )
    relative = (
        *('const [name] = path.split("/");', '/** Such as "/session/1f". */', '// as in "/session/1f"\n'),
        *('<a href="./">Start</a>', "`session/${id}`", "[...path] // 1\n"),
    )
    assert [len([*absolute_addresses(text)]) for text in (*absolute, *relative)] == [1] * 6 + [0] * 6
