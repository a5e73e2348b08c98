"""Tables of contents: a folder's `index.md` lists its pages as links, and these lists are the site's contents.

So a page is listed once, in a form that is readable without the site.
"""

from __future__ import annotations  # importing this needs no Sphinx

import re
from pathlib import PurePosixPath
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx


__all__ = ["entries", "setup"]

ITEM = re.compile(r"^\s*[-*] .*?\]\(([\w./-]+)\.md\)|^\| \[[^\]]*\]\(([\w./-]+)\.md\)", re.MULTILINE)
"""An item of a list that links to a page, or a row of a table that begins with a link to one."""


def entries(text: str) -> list[str]:
    """Return the pages that an index lists, in its order, relative to it and without their suffix."""
    found = (first or second for first, second in ITEM.findall(text))
    return list(dict.fromkeys(page for page in found if not page.startswith("..")))


def _add(_app: Sphinx, page: str, source: list[str]) -> None:
    """Add the table of contents to the source of an index."""
    if PurePosixPath(page).name == "index" and (pages := entries(source[0])):
        listed = "\n".join(pages)
        source[0] += f"\n\n```{{toctree}}\n:hidden:\n\n{listed}\n```\n"


def setup(app: Sphinx) -> dict[str, bool]:
    """Tell Sphinx."""
    app.connect("source-read", _add)
    return {"parallel_read_safe": True}
