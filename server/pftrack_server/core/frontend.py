"""The files of the pages: where they are, and what their scripts consist of.

They are inside the package where it is installed, beside its folder in a checkout.
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
"""The beginning of a line that imports a module, and the module."""


@lru_cache
def modules_of(*scripts: str) -> tuple[str, ...]:
    """Return the modules that scripts consist of, each before what it imports, as paths from the pages' folder."""
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
    """Return the path of a module that another one imports by a relative path."""
    return normpath(f"{module}/../{other}")
