"""Runs as pages of their own, written by `run.export("run.html")` with fixed seeds."""

from collections.abc import Callable
from pathlib import Path

import pftrack
from pftrack_server.work.page import write_page

__all__ = ["LIVE", "write"]

LIVE: dict[str, Callable[[], pftrack.Run]] = {
    "ball": lambda: pftrack.run("ball", tracker="condensation", seed=7, frames=60),
    "face": lambda: pftrack.run("head", preset="growing", seed=0, frames=90),
    "hand": lambda: pftrack.run("hand", preset="occlusion", seed=0),
}
"""The pages by name."""


def write(name: str, folder: Path) -> None:
    """Compute a run and write its page."""
    for _ in write_page(LIVE[name](), folder / f"{name}.html"):
        pass
