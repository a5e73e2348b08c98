"""Runs that earlier versions saved: they open, and compute to the numbers that were saved with them."""

from pathlib import Path

import pytest

from pftrack.runs.record import load, read
from pftrack.sources.sequence import open_sequence

RUNS = Path(__file__).parents[1] / "data" / "format_1" / "runs"


@pytest.mark.parametrize("path", sorted(RUNS.glob("*.pft")), ids=lambda path: path.stem)
def test_runs_of_format_1(path: Path) -> None:
    """A run of each kind of source, with a timeline, a box, points, truth or a large seed, gives the saved numbers."""
    saved = read(path)
    again = load(path, open_sequence=lambda footage: open_sequence(RUNS / footage.name))
    again.seek(saved.computed - 1)
    assert again.estimates_sha256 == saved.estimates_sha256
