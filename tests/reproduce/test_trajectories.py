"""What is claimed for the simulated track, on few runs, and the figures."""

import numpy as np
import pytest

from pftrack.experiments.trajectories.scene import REFERENCE_PX
from pftrack.filters.trajectories.whole import Method, Settings, follow, likelihood_surface
from pftrack.reproduce import trajectories
from pftrack.reproduce.trajectories import likelihood_figure, track_figure


def test_the_table_within_the_tolerances_for_few_runs() -> None:
    """Eleven runs are enough for the order of the methods; the linear filter has no runs to average."""
    settings: tuple[tuple[Method, float, int], ...] = (("lg", 10.0, 1), ("lng", 1.0, 11), ("nlng", 3.0, 11))
    tracks = {method: (np.repeat(REFERENCE_PX[:, None], count, axis=1), noise) for method, noise, count in settings}
    found = {it: follow(it, track, Settings(noise, 1.0, count=1000)) for it, (track, noise) in tracks.items()}
    sides = "filtered", "smoothed"
    table = {name: dict(zip(sides, trajectories._medians(one), strict=True)) for name, one in found.items()}
    compared = trajectories.REFERENCES.judge_all("error", table["lg"], "lg")
    assert [finding.verdict for finding in compared] == ["reproduced"] * 2
    # Ichimura and Ikoma's own figure for the smoothed linear filter comes out by no reading.
    *first, last = trajectories._orderings(table)
    assert [finding.verdict for finding in first[:4]] == ["reproduced"] * 4
    assert last.verdict == "differs"
    surface = likelihood_surface("lg", REFERENCE_PX, Settings())
    assert trajectories._maximum("lg", surface, (10.0, 1.0)).verdict == "reproduced"
    assert len(track_figure(found).axes) == 3
    assert "best at (10, 1)" in likelihood_figure({"lg": surface}).axes[0].get_title()


@pytest.mark.slow
def test_the_scale_of_outliers_is_read_as_its_root() -> None:
    """Taken literally, the likelihood would have its maximum in the corner of the grid nearly always."""
    pairs = [trajectories._best_pair(trajectories.Trial(seed, 2500.0)) for seed in range(30)]
    assert np.mean([pair == (20, 20) for pair in pairs]) > 0.7


def test_the_search_is_drawn_beside_the_sequence() -> None:
    """The figure is the picture of the sequence, and to its right the world of the search."""
    assert trajectories.search_figure().shape == (432, 540 + 432, 3)
