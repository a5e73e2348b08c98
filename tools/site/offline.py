"""Adapt the site to the server's content policy: scripts in separate files, and nothing from another host."""

import re
from pathlib import Path

from sphinx.application import Sphinx
from sphinx.errors import ExtensionError

__all__ = ["setup"]

THEME = re.compile(r"<script>\s*document\.body\.dataset\.theme = [^<]*</script>")
INLINE = re.compile(r"<script(?![^>]*\bsrc=)[^>]*>")


def _mend(app: Sphinx, error: Exception | None) -> None:
    """Move the theme's one script into a file, and refuse a page with another script."""
    if error is not None or app.builder.format != "html":
        return
    root = Path(app.outdir)
    for path in root.rglob("*.html"):
        if "media" in path.relative_to(root).parts:
            continue
        text = path.read_text("utf-8")
        top = "../" * (len(path.relative_to(root).parts) - 1)
        text = THEME.sub(f'<script src="{top}_static/apply_theme.js"></script>', text)
        if found := INLINE.search(text):
            raise ExtensionError(f"{path.name} contains a script, which the server's policy forbids: {found.group()}")
        path.write_text(text, "utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Tell Sphinx."""
    app.connect("build-finished", _mend)
    return {"parallel_read_safe": True}
