"""Entry points: objects that other packages, or higher layers, provide under a name, looked up on demand.

So a run can be shown, exported and served without importing those layers.
"""

from importlib.metadata import EntryPoint, entry_points
from typing import Any

from pftrack.core.refusal import ConflictError

PRESENTERS = "pftrack.presenters"
"""Group of the functions that show or write a run or a comparison."""


def find(group: str, name: str) -> EntryPoint | None:
    """Return the entry point of a group that has this name, or None."""
    return next(iter(entry_points(group=group, name=name)), None)


def load(group: str, name: str) -> Any:  # noqa: ANN401 - whatever a package provides
    """Return what is provided under a name.

    Raises:
        ConflictError: No package provides it.
    """
    found = find(group, name)
    if found is None:
        raise ConflictError(f"no package is installed that provides {name!r} of {group}; pftrack's own does")
    return found.load()
