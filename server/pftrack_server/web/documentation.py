"""The documentation without its site: the Markdown of `docs/` as HTML, with links that lead on below `help/`."""

import posixpath
from functools import lru_cache
from pathlib import Path
from urllib.parse import urlsplit

from markdown_it import MarkdownIt
from markdown_it.token import Token
from mdit_py_plugins.anchors import anchors_plugin

from pftrack_server.core.frontend import DOCS
from pftrack_server.lessons.text import with_formulas

HEADING_LEVELS = 4
"""Those that links lead to."""
ABOUT = (
    '<p class="note"><a href="help/">Contents</a>. This is the text of the documentation; '
    "<code>make docs</code> adds search, pictures and the references to Python, REST and the command line.</p>\n"
)


def html_of(page: str) -> str | None:
    """Return a page such as `how-to/server.html` as HTML for a page at the base; None if there is no such page."""
    source = {_address(path): path for path in DOCS.rglob("*.md")}.get(page)
    if source is None:
        return None
    tokens = _reader().parse(source.read_text(encoding="utf-8"))
    for token in (inner for each in tokens for inner in each.children or ()):
        _lead_on(token, page)
    return ABOUT + str(_reader().renderer.render(tokens, _reader().options, {}))


def _address(path: Path) -> str:
    return path.relative_to(DOCS).with_suffix(".html").as_posix()


def _lead_on(token: Token, page: str) -> None:
    """Have a link or picture of a page lead below `help/`; a link that leads out of the documentation is only text."""
    for name in ("href", "src"):
        link = urlsplit(str(token.attrGet(name) or ""))
        if link.scheme or not (link.path or link.fragment):
            continue
        path = posixpath.normpath(posixpath.join(posixpath.dirname(page), link.path)) if link.path else page
        if path.startswith("../"):
            del token.attrs[name]
        else:
            path = path.removesuffix(".md") + ".html" if path.endswith(".md") else path
            token.attrSet(name, link._replace(path=f"help/{path}").geturl())


@lru_cache(1)
def _reader() -> MarkdownIt:
    return with_formulas(MarkdownIt("commonmark").enable("table").use(anchors_plugin, max_level=HEADING_LEVELS))
