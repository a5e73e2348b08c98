"""Runs as pages of their own: what `run.export("run.html")` writes, with fixed seeds."""

from collections.abc import Callable
from pathlib import Path

import pftrack
from pftrack_server.viewer.standalone.document import document
from pftrack_server.viewer.standalone.recording import record

__all__ = ["LIVE", "write"]

MOST_BYTES = 2_500_000
"""Of a recording: less than an export has, since the site is loaded over a network. Pictures are made coarser."""

LIVE: dict[str, Callable[[], pftrack.Run]] = {
    "ball": lambda: pftrack.run("ball", tracker="condensation", seed=7, frames=60),
    "face": lambda: pftrack.run("head", preset="growing", seed=0, frames=90),
    "hand": lambda: pftrack.run("hand", preset="occlusion", seed=0),
}
"""The pages by name."""


def write(name: str, folder: Path) -> None:
    """Compute a run and write its page."""
    run = LIVE[name]()
    steps = record(run, MOST_BYTES)
    while True:
        try:
            next(steps)
        except StopIteration as done:
            text = document(run, done.value)
            break
    (folder / f"{name}.html").write_text(text, "utf-8")
