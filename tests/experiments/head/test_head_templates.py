"""Sizes of the templates of a face's features."""

import numpy as np

from pftrack.experiments.head.appearance import SIZES_PX, template_sizes
from pftrack.vision.face import FEATURES


def test_sizes_are_those_of_the_table_and_scale_with_the_face() -> None:
    """At 108 px between the eyes the sizes are those of table 4.1; on a face half as large, half of them."""
    assert np.array_equal(template_sizes(FEATURES, 108), list(SIZES_PX.values()))
    assert template_sizes(["nose", "lmou"], 54).tolist() == [[32, 20], [12, 12]]
    assert template_sizes(["nose", "lmou"], 108, 0.5).tolist() == [[32, 20], [12, 12]]
    assert template_sizes(["nose"], 1).tolist() == [[6, 6]]
