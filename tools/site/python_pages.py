"""The reference of the Python interface: a page for each public package, with the names in its `__all__`."""

from __future__ import annotations  # importing this needs no Sphinx

import importlib
import inspect
import pkgutil
import re
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx

__all__ = ["CONTENTS", "INTERNAL", "ROOMS", "setup"]

ROOMS = (
    "pftrack",
    "pftrack.runs.comparison",
    "pftrack.sweep",
    "pftrack.analysis.failures",
    "pftrack.teaching.lessons",
    "pftrack.output.figures",
    "pftrack.output.displays",
    "pftrack.output.exports",
    "pftrack.experiments",
    "pftrack.testing",
    "pftrack.core.model",
    "pftrack.runs",
    "pftrack.analysis.diagnosis",
    "pftrack.analysis.counterfactuals",
    "pftrack.analysis.explanation",
    "pftrack.experiments.shared.loss_probability",
    "pftrack.analysis.fitting",
    "pftrack.analysis.evaluation",
    "pftrack.experiments.own",
    "pftrack.filters",
    "pftrack.filters.resampling",
    "pftrack.filters.particles",
    "pftrack.filters.dynamics",
    "pftrack.vision.likelihoods",
    "pftrack.filters.learning",
    "pftrack.sources",
    "pftrack.vision.face",
    "pftrack.vision.rendering",
    "pftrack.core.numerics",
    "pftrack.vision.structure",
    "pftrack.experiments.linkage.sets",
    "pftrack.reproduce",
)
"""The public packages of the library."""

INTERNAL = frozenset(
    {
        "pftrack.analysis",
        "pftrack.core",
        "pftrack.doctor",
        "pftrack.output",
        "pftrack.teaching",
        "pftrack.vision",
        "pftrack.cli",
        "pftrack.teaching.exercises",
        "pftrack.vision.model_files",
        "pftrack.process",
        "pftrack.experiments.shared",
    }
)
"""Internal packages: commands, wiring of experiments, child processes, and the cache of compiled code."""

CONTENTS = "## Packages\n\n```{toctree}\n:maxdepth: 1\n\n" + "\n".join(f"api/{room}" for room in ROOMS) + "\n```"

CODE = re.compile(r"(`+[^`]*`+)|\|")

INNER = {"pftrack.teaching.lessons", "pftrack.reproduce", "pftrack.experiments"}
"""Packages whose modules are found by a registry and never imported by users: only the package is public."""


def _modules(room: str) -> list[ModuleType]:
    """Return a package and its modules with public names."""
    package = importlib.import_module(room)
    found = [package]
    if hasattr(package, "__path__") and room not in INNER | {"pftrack"}:
        names = (each.name for each in pkgutil.iter_modules(package.__path__, f"{room}."))
        found += [importlib.import_module(name) for name in names if not name.rpartition(".")[2].startswith("_")]
    return found


def _write(app: Sphinx) -> None:
    folder = Path(app.srcdir) / "reference" / "api"
    folder.mkdir(exist_ok=True)
    seen: dict[int, str] = {}
    pages = {f"{room}.rst": _page(room, seen) for room in ROOMS}
    for old in folder.glob("*.rst"):
        if old.name not in pages:
            old.unlink()
    for name, text in pages.items():
        path = folder / name
        if not path.exists() or path.read_text("utf-8") != text:
            path.write_text(text, "utf-8")


def _page(room: str, seen: dict[int, str]) -> str:
    parts = [_title(f"``{room}``", "=")]
    for module in _modules(room):
        names = [name for name in _public(module) if not isinstance(getattr(module, name), ModuleType)]
        if module.__name__ != room and not names:
            continue
        if module.__name__ != room:
            parts.append(_title(f"``{module.__name__}``", "-"))
        parts.append(f".. automodule:: {module.__name__}\n   :no-members:\n   :no-index:")
        parts += [_entry(module, name, seen) for name in names if not name.startswith("__")]
    return "\n\n".join(parts) + "\n"


def _public(module: ModuleType) -> Sequence[str]:
    """Return a module's `__all__`, or, for a filter without one, the functions and classes that it defines."""
    if hasattr(module, "__all__") or not module.__name__.startswith("pftrack.filters."):
        return getattr(module, "__all__", ())
    return [
        name
        for name, thing in vars(module).items()
        if not name.startswith("_") and callable(thing) and getattr(thing, "__module__", "") == module.__name__
    ]


def _title(text: str, line: str) -> str:
    return f"{text}\n{line * len(text)}"


def _entry(module: ModuleType, name: str, seen: dict[int, str]) -> str:
    thing = getattr(module, name)
    whole = f"{module.__name__}.{name}"
    lasting = isinstance(thing, type) or callable(thing)
    if lasting and id(thing) in seen:
        return f"``{name}`` is :py:obj:`{seen[id(thing)]}`."
    if lasting:
        seen[id(thing)] = whole
    if isinstance(thing, type):
        return f".. autoclass:: {whole}\n   :members:\n   :exclude-members: model_config, model_post_init"
    return f".. {'autofunction' if callable(thing) and hasattr(thing, '__code__') else 'autodata'}:: {whole}"


def _mend(_app: Sphinx, _what: str, _name: str, thing: object, _options: object, lines: list[str]) -> None:
    """Adapt a docstring to Sphinx where its markup differs from Markdown."""
    own = inspect.isroutine(thing) or isinstance(thing, type | ModuleType | property)
    words = type(thing).__doc__
    if not own and isinstance(words, str) and "\n".join(lines).strip()[-40:] == words.strip()[-40:]:
        lines.clear()  # a constant without a docstring would show that of its type
    lines[:] = _without_bars(_with_code(lines))


def _with_code(lines: list[str]) -> list[str]:
    """Return lines in which indented blocks after an empty line are marked as code."""
    found: list[str] = []
    for before, line in zip(["x", *lines], lines, strict=False):
        first = not before and line.startswith("    ")
        if first and not next(each for each in reversed([" ", *found]) if each).startswith((" ", "-", "..")):
            found += ["::", ""]
        found.append(line)
    return found


def _without_bars(lines: list[str]) -> list[str]:
    """Return lines with Markdown tables as tables, and other bars escaped."""
    found: list[str] = []
    for is_table, block in groupby(lines, key=lambda line: line.startswith("|")):
        if is_table:
            head, _, *rows = (line.strip("| ").split(" | ") for line in block)
            found += ["", ".. list-table::", "   :header-rows: 1", ""]
            for row in (head, *rows):
                found += [f"   {'  ' if at else '* '}- {cell}" for at, cell in enumerate(row)]
            found.append("")
        else:
            found += [CODE.sub(lambda hit: hit[1] or r"\|", line) for line in block]
    return found


def setup(app: Sphinx) -> dict[str, bool]:
    """Tell Sphinx."""
    app.connect("builder-inited", _write, priority=100)
    app.connect("autodoc-process-docstring", _mend, priority=400)
    return {"parallel_read_safe": True}
