import numpy as np

from pftrack.reproduce.structure import prism_tracks
from pftrack.vision.structure.factorization import factorize, shape_error
from pftrack.vision.structure.recursive import accumulate, empty, principal_shape


def test_it_is_the_factorization_of_all_frames() -> None:
    """Frame by frame it comes to the singular values and, up to an affine map, the shape of all frames at once."""
    tracks = prism_tracks(3, frames=30).tracks
    known = empty(14)
    for positions in tracks.positions:
        known = accumulate(known, positions)
    found, whole = principal_shape(known), factorize(tracks)
    assert found is not None
    shape, strengths = found
    np.testing.assert_allclose(strengths, whole.strengths, rtol=1e-9, atol=1e-4)
    assert shape_error(shape, whole.shape) < 1e-8
    assert known.frames == 30


def test_a_single_view_has_no_depth() -> None:
    """Nothing is made of one frame, nor of the same frame twice."""
    positions = prism_tracks(3, frames=2).true_px[0]
    once = accumulate(empty(14), positions)
    assert principal_shape(once) is None
    assert principal_shape(accumulate(once, positions)) is None
