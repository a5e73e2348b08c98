"""The addresses in the pages: relative to that of the server, which may lie below any path."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = ROOT / "frontend_static"
COMMENT = re.compile(r"/\*.*?\*/|<!--.*?-->|^\s*//.*?$", re.DOTALL | re.MULTILINE)
QUOTED = re.compile(r"""["'`]/(?=[\w$?#"'`])[^"'`\n]*|\burl\(\s*["']?/(?!/)[^)]*""")
"""What begins with a slash, as a text of a script, an attribute or a style has it."""
SEPARATOR = re.compile(r"""\.(?:split|join|replaceAll|replace|includes|endsWith|lastIndexOf)\([^()]*["'`]/["'`]""")
"""A slash alone that parts a text is no address."""


def absolute_addresses(text: str) -> Iterator[str]:
    """Return what stands in a page, a script or a style and begins with a slash."""
    bare = SEPARATOR.sub("", COMMENT.sub("", text))
    return (found.group() for found in QUOTED.finditer(bare))


def test_no_address_of_the_pages_is_absolute() -> None:
    """Below a base path it would lead out of the server, and in a class out of the class."""
    files = [path for kind in ("html", "js", "css") for path in PAGES.rglob(f"*.{kind}") if "vendor" not in path.parts]
    found = {str(path.relative_to(PAGES)): [*absolute_addresses(path.read_text(encoding="utf-8"))] for path in files}
    assert {name: addresses for name, addresses in found.items() if addresses} == {}


@pytest.mark.parametrize(
    "text",
    [
        '<a href="/">Start</a>',
        '<script src="/static/a.js"></script>',
        "location.assign('/work');",
        "const page = `/session/${id}`;",
        "const page = `/${id}`;",
        'fetch("/api/v1/runs")',
        "div { background: url(/static/a.svg) }",
    ],
)
def test_an_absolute_address_is_found(text: str) -> None:
    """The search finds one in each kind of file."""
    assert [*absolute_addresses(text)]


@pytest.mark.parametrize(
    "text",
    [
        'const [name] = path.split("/");',
        "names.filter(Boolean).join('/')",
        '/** Such as "/session/1f". */',
        '// as in "/session/1f"\n',
        '<a href="./">Start</a>',
        "`session/${id}`",
        "[...path] // 1\n",
    ],
)
def test_what_is_none_is_passed_over(text: str) -> None:
    """A slash that parts names, a comment and a relative address are no absolute address."""
    assert not [*absolute_addresses(text)]
