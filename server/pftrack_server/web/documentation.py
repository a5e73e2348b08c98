"""The documentation without its site: the Markdown of `docs/` as HTML, with links below `help/`.

It also makes the reference of the REST interface from the server's own description.
"""

import json
import posixpath
from functools import lru_cache
from html import escape
from typing import Any
from urllib.parse import urlsplit

from markdown_it import MarkdownIt
from markdown_it.token import Token
from mdit_py_plugins.anchors import anchors_plugin

from pftrack_server.core.frontend import DOCS
from pftrack_server.core.markdown import with_formulas

HEADING_LEVELS = 4
"""Deepest level of headings that links can lead to."""
ABOUT = (
    '<p class="note"><a href="help/">Contents</a>. This is the text of the documentation; '
    "<code>make docs</code> adds search, pictures and the references to Python, REST and the command line.</p>\n"
)
STREAMS = (
    '<p>The machine-readable form: <a href="openapi.json">openapi.json</a>. '
    "A session's stream of messages is the websocket <code>api/v1/sessions/{session}/stream</code>, a sweep's is "
    "<code>api/v1/sweeps/{sweep}/stream?x=&amp;y=</code>.</p>\n"
)


def html_of(page: str) -> str | None:
    """Return a page such as `how-to/server.html` as HTML for a page at the base; None if there is no such page."""
    source = {path.relative_to(DOCS).with_suffix(".html").as_posix(): path for path in DOCS.rglob("*.md")}.get(page)
    if source is None:
        return None
    tokens = _reader().parse(source.read_text(encoding="utf-8"))
    for token in (inner for each in tokens for inner in each.children or ()):
        _lead_on(token, page)
    return ABOUT + str(_reader().renderer.render(tokens, _reader().options, {}))


def _lead_on(token: Token, page: str) -> None:
    """Make a link or picture point below `help/`; a link out of the documentation becomes text."""
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


def reference(schema: dict[str, Any]) -> str:
    """Return the reference of the REST interface as HTML for a page at the base, from its OpenAPI description."""
    operations = "".join(
        _operation(method, path, operation)
        for path, methods in schema["paths"].items()
        for method, operation in methods.items()
    )
    shapes = "".join(
        f'<details id="{escape(name)}"><summary><code>{escape(name)}</code></summary>{_json(shape)}</details>'
        for name, shape in schema["components"]["schemas"].items()
    )
    about = escape(schema["info"]["description"])
    return f"<h1>REST interface</h1>\n<p>{about}</p>\n{STREAMS}{operations}\n<h2>Shapes</h2>\n{shapes}"


def _operation(method: str, path: str, operation: dict[str, Any]) -> str:
    """Return one operation as HTML: its description, parameters and result."""
    taken = {
        "parameters": operation.get("parameters", []),
        "body": operation.get("requestBody", {}).get("content", {}),
        "answers": {status: answer.get("content", {}) for status, answer in operation["responses"].items()},
    }
    return (
        f"<details><summary><code>{method.upper()} {escape(path)}</code> {escape(operation['description'])}</summary>"
        f"{_json({name: value for name, value in taken.items() if value})}</details>"
    )


def _json(value: object) -> str:
    return f"<pre>{escape(json.dumps(value, indent=2))}</pre>"
