"""Comments in a page that the site replaces by the content that they name.

A comment is a line of its own: `<!-- picture session: A session -->`. Pictures, films and live pages are made by
`tools.pictures` from the product; if they were not made, the page omits them.
"""

from __future__ import annotations  # importing this needs no Sphinx

import re
from collections.abc import Callable
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from tools.site import command_line, glossary, python_pages, rest

if TYPE_CHECKING:
    from sphinx.application import Sphinx

__all__ = ["NAMED", "setup"]

ROOT = Path(__file__).parents[2]
NAMED = re.compile(r"^<!-- (picture|film|live|reference|file) ([\w./-]+)(?:: (.*?))? -->$", re.MULTILINE | re.DOTALL)
OUTSIDE = {"CONTRIBUTING.md": "explanation/contributing", "CHANGELOG.md": "reference/changelog"}
"""Files next to `docs/`, and the pages that show them."""


def _media(app: Sphinx, name: str) -> bool:
    return (Path(app.config.media_folder) / "media" / name).is_file()


def _picture(app: Sphinx, top: str, name: str, words: str) -> str:
    if not _media(app, f"{name}.png"):
        return ""
    source = f"{top}media/{name}.png"
    return (
        f'<figure class="shown"><a href="{source}"><img src="{source}" alt="{words}" loading="lazy"></a>'
        f"<figcaption>{words}</figcaption></figure>"
    )


def _film(app: Sphinx, top: str, name: str, words: str) -> str:
    if not _media(app, f"{name}.mp4"):
        return ""
    poster = f' poster="{top}media/{name}.png"' if _media(app, f"{name}.png") else ""
    return (
        f'<figure class="shown"><video src="{top}media/{name}.mp4"{poster} controls muted loop playsinline '
        f'preload="none" aria-label="{words}"></video><figcaption>{words}</figcaption></figure>'
    )


def _live(app: Sphinx, top: str, name: str, words: str) -> str:
    if not _media(app, f"{name}.html"):
        return ""
    source = f"{top}media/{name}.html"
    return (
        f'<figure class="shown live"><iframe src="{source}" title="{words}" loading="lazy"></iframe>'
        f'<figcaption>{words} <a href="{source}">On a page of its own</a></figcaption></figure>'
    )


SHOWN: dict[str, Callable[[Sphinx, str, str, str], str]] = {"picture": _picture, "film": _film, "live": _live}
REFERENCES: dict[str, Callable[[], str]] = {
    "command-line": command_line.markdown,
    "python": lambda: python_pages.CONTENTS,
    "rest": rest.markdown,
    "glossary": glossary.markdown,
}


def _file(page: str, name: str) -> str:
    """Return a file next to `docs/`, without its title, for the page that shows it."""
    text = (ROOT / name).read_text("utf-8").partition("\n")[2]
    return re.sub(r"\]\(docs/", f"]({'../' * page.count('/')}", text)


def _insert(app: Sphinx, page: str, source: list[str]) -> None:
    top = "../" * page.count("/")

    def inserted(found: re.Match[str]) -> str:
        kind, name, words = found.groups(default="")
        if kind in SHOWN:
            return SHOWN[kind](app, top, name, escape(" ".join(words.split())))
        return _file(page, name) if kind == "file" else REFERENCES[name]()

    text = NAMED.sub(inserted, source[0])
    for name, shown in OUTSIDE.items():
        text = re.sub(rf"\]\((?:\.\./)+{re.escape(name)}\)", f"]({top}{shown}.md)", text)
    source[0] = text


def setup(app: Sphinx) -> dict[str, bool]:
    """Tell Sphinx."""
    app.add_config_value("media_folder", "", "html", str)
    app.connect("source-read", _insert, priority=400)
    return {"parallel_read_safe": True}
