"""The files of the pages: their folder, and the modules of their scripts.

They are inside the installed package; in a checkout they are next to its folder.
"""

import re
from functools import lru_cache
from pathlib import Path
from posixpath import normpath

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

IMPORT = re.compile(r'^((?:import|(?:import|export)\b[^"\';]*?\bfrom)\s*["\'])(\.[^"\']+)(?=["\'];)', re.MULTILINE)
"""Matches the start of an import line and captures the module."""


@lru_cache
def modules_of(*scripts: str) -> tuple[str, ...]:
    """Return all modules of some scripts, each before its imports, as paths relative to the pages' folder."""
    found: dict[str, None] = {}
    waiting = list(reversed(scripts))
    while waiting:
        module = waiting.pop()
        if module not in found:
            found[module] = None
            imported = IMPORT.findall((FRONTEND / module).read_text(encoding="utf-8"))
            waiting += [beside(module, other) for _, other in reversed(imported)]
    return tuple(found)


def beside(module: str, other: str) -> str:
    """Return the path of a module that another module imports by a relative path."""
    return normpath(f"{module}/../{other}")
