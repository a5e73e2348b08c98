"""Where the files of the pages are: inside the package where it is installed, beside its folder in a checkout."""

from pathlib import Path

_PACKAGE = Path(__file__).parents[1]
_CHECKOUT = _PACKAGE.parents[1]


def _place(installed: str, checked_out: str) -> Path:
    inside = _PACKAGE / installed
    return inside if inside.is_dir() else _CHECKOUT / checked_out


FRONTEND = _place("frontend_static", "frontend_static")

HELP = _place("help_site", "build/site")
"""The documentation, where it has been built (`make docs`)."""

DOCS = _CHECKOUT / "docs"
"""The documentation as Markdown, in a checkout."""
