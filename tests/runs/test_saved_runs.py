"""Runs that were saved long ago: computed again from their recipes, they come to the same bits."""

from pathlib import Path

import pytest

from pftrack.experiments import EXPERIMENTS
from pftrack.runs.record import read
from pftrack.runs.reproduction import load

RUNS = Path(__file__).parents[1] / "data" / "runs"


def test_every_experiment_has_one() -> None:
    """Whoever changes a number of any experiment by accident is told."""
    assert {path.stem for path in RUNS.glob("*.pft")} == set(EXPERIMENTS)


@pytest.mark.parametrize("path", sorted(RUNS.glob("*.pft")), ids=lambda path: path.stem)
def test_it_comes_to_the_same_hash(path: Path) -> None:
    """The recipe alone gives the estimates of every frame again."""
    saved = read(path)
    again = load(path)
    again.seek(saved.computed - 1)
    assert again.estimates_sha256 == saved.estimates_sha256
