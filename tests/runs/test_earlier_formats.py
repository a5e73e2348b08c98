"""Runs that earlier versions saved: they open, and compute to the numbers that were saved with them.

Since runs come to the same bits on every processor with AVX2, sums have an order of their own, which changed the last
digits once. Templates are correlated in single precision, of which that is the seventh digit.
"""

from pathlib import Path

import numpy as np
import pytest

from pftrack.runs.record import load, read_saved
from pftrack.runs.reproduction import difference
from pftrack.sources.sequence import open_sequence

RUNS = Path(__file__).parents[1] / "data" / "format_1" / "runs"
TOLERANCE = {"head-found": 1e-5, "head-video": 1e-5}
"""In the experiment's unit; 1e-9 for all others."""


@pytest.mark.parametrize("path", sorted(RUNS.glob("*.pft")), ids=lambda path: path.stem)
def test_runs_of_format_1(path: Path) -> None:
    """A run of each kind of source, with a timeline, a box, points, truth or a large seed, gives the saved numbers."""
    saved = read_saved(path)
    again = load(path, open_sequence=lambda footage: open_sequence(RUNS / footage.name))
    again.seek(saved.record.computed - 1)
    found = np.array([row.estimate for row in again.diagnostics])
    assert np.abs(found - saved.estimates).max() < TOLERANCE.get(path.stem, 1e-9)
    apart = difference(again, saved)
    assert apart is not None, "the last digits are those of version 0.2 again; compare hashes"
    assert "computed by an earlier version" in apart.sentence
