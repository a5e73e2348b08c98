import numpy as np
import pytest
from scipy import ndimage

from pftrack.experiments.linkage.sets.cells import label_components


@pytest.mark.parametrize("sizes", [(30,), (9, 11), (6, 7, 8), (5, 6, 7, 4)])
def test_runs_of_any_grid_are_those_of_scipy(sizes: tuple[int, ...]) -> None:
    """Neighbours touch at least at a corner, in any dimension."""
    rng = np.random.default_rng(0)
    for share in (0.02, 0.05, 0.3, 1.0):
        feasible = rng.random(sizes) < share
        wanted, count = ndimage.label(feasible, np.ones((3,) * len(sizes)))
        labels, found = label_components(feasible.ravel(), np.array(sizes))
        assert found == count
        assert np.array_equal(labels.reshape(sizes) + 1, wanted)
