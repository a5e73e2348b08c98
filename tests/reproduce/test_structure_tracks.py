"""The tracks of the prism and of the face."""

import numpy as np
import pytest

from pftrack.reproduce.structure import CENTRES, head_tracks, prism_tracks
from pftrack.vision.structure.factorization import factorize, shape_error
from pftrack.vision.structure.variational import fit


def test_the_prism_hides_as_specified() -> None:
    """Corners are seen in 0.836 of the frames, centres in 0.455, and in no frame all fourteen points are."""
    seen = prism_tracks(0).visible
    assert seen.shape == (360, 14)
    assert seen[:, : CENTRES.start].mean() == pytest.approx(0.836, abs=0.01)
    assert seen[:, CENTRES].mean() == pytest.approx(0.455, abs=0.01)
    assert not seen.all(axis=1).any()


def test_hidden_points_are_noisy_and_known_to_be() -> None:
    """The noise has the reported variances, of 1 px for what is seen and 50 px for what is not."""
    prism = prism_tracks(3)
    apart = prism.tracks.positions - prism.true_px
    assert apart[prism.visible].std() == pytest.approx(1.0, rel=0.05)
    assert apart[~prism.visible].std() == pytest.approx(50.0, rel=0.05)
    assert set(np.unique(prism.tracks.variances)) == {1.0, 2500.0}
    assert np.array_equal(prism_tracks(3).tracks.positions, prism.tracks.positions)
    assert not np.array_equal(prism_tracks(4).tracks.positions, prism.tracks.positions)


def test_the_prism_is_recovered_by_weights_alone() -> None:
    """The variational error is near 0.0156 and that of equal weights near 0.2."""
    errors = []
    for seed in range(5):
        prism = prism_tracks(seed)
        errors.append([shape_error(it(prism.tracks).shape, prism.shape_mm) for it in (fit, factorize)])
    ours, equal = np.mean(errors, axis=0)
    assert ours == pytest.approx(0.0156, abs=0.003)
    assert equal == pytest.approx(0.204, abs=0.03)


def test_the_face_is_noisier_where_it_looks_otherwise() -> None:
    """The deviation is 1 px in the frontal frame and up to 10 px, and the truth is the picture's, from its middle."""
    face = head_tracks(99, 0, frames=60)
    sd = np.sqrt(face.tracks.variances)
    assert sd.shape == (60, 11, 2)
    assert np.allclose(sd[0], 1.0)
    assert 1.3 < sd.max() <= 10.0 + 1e-9
    noise = (face.tracks.positions - face.true_px) / sd
    assert noise.std() == pytest.approx(1.0, rel=0.05)
    assert np.abs(face.true_px).max() < 320.0
    eyes = face.true_px[0, 1] - face.true_px[0, 2]
    assert np.hypot(*eyes) == pytest.approx(108.0, rel=0.1)
