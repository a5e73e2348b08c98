"""Viewers: what shows a run in three dimensions, from another package, found when somebody asks for it.

The library draws runs as pictures and films; it knows no browser. A package that shows them otherwise says so by entry
points of the group `pftrack.viewers`: `page` writes a run as an HTML page that needs no server, `show` opens its scene
on this machine. pftrack's own server provides both.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Protocol, cast

from pftrack.core.entry_points import load
from pftrack.core.model.export import ExportError
from pftrack.runs.run import Run

__all__ = ["GROUP", "Shown", "show", "write_page"]

GROUP = "pftrack.viewers"


class Shown(Protocol):
    """A run that is being shown in a browser."""

    @property
    def address(self) -> str:
        """Where a browser of this machine finds it."""

    @property
    def run(self) -> Run:
        """What is shown: the run that was given, or the branch that was made of it by turning a parameter."""

    def go(self, frame: int) -> None:
        """Show a frame; one that has not been computed yet is computed, with all before it."""

    def follow(self, run: Run) -> None:
        """Show a longer run in the place of this one, at its newest frame unless an earlier one is being looked at."""

    def wait(self) -> None:
        """Wait until it is closed, or somebody interrupts."""

    def close(self) -> None:
        """Stop showing it; a second call does nothing."""


def write_page(run: Run, path: Path, _plot: str | None = None) -> Iterator[tuple[int, int]]:
    """Write a run, as far as it has been computed, as an HTML page that needs neither server nor network.

    Args:
        run: It is moved to each of its frames.
        path: Where to.

    Yields:
        How many frames are done, of how many.

    Raises:
        ExportError: No viewer is installed that can do that.
        OSError: The file cannot be written.
    """
    try:
        write = load(GROUP, "page")
    except LookupError as error:
        raise ExportError(str(error)) from None
    yield from write(run, path)


def show(run: Run, *, port: int = 0, browser: bool | None = None) -> Shown:
    """Open the scene of a run on this machine.

    Args:
        run: What is shown; it is not changed. A parameter that is turned beside the scene makes a branch of it.
        port: Where to listen, of this machine alone; any that is free if 0.
        browser: Whether to open the scene in a browser; if not given, unless it is shown in a notebook.

    Raises:
        LookupError: No viewer is installed that can do that.
        OSError: The port is taken.
    """
    return cast("Shown", load(GROUP, "show")(run, port=port, browser=browser))
