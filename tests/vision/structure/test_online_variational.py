"""Factorization frame by frame: forgetting, the window, and what is published (Bando 2007, ch. 4 section 5.2)."""

import numpy as np
import pytest

from pftrack.vision.structure import variational
from pftrack.vision.structure.factorization import Tracks, shape_error
from pftrack.vision.structure.variational import Settings
from tests.vision.structure.bodies import body, cameras, seen

BODY = body()
SHORT = Settings(window=12)


def test_eta_settles_at_a_half() -> None:
    """With lambda = 0.5 eta is 1, 2/3, 4/7, ... and tends to 0.5, for all points alike."""
    states = variational.run(seen(BODY, cameras(40)), SHORT)
    etas = np.array([state.eta for state in states if state.full])
    assert etas[:3, 0] == pytest.approx([1.0, 2 / 3, 4 / 7])
    assert etas[-1] == pytest.approx(0.5)
    assert [state.common_eta for state in states if state.full] == pytest.approx(etas[:, 0])


def test_the_first_full_window_is_the_batch() -> None:
    """Until the window is full nothing is known; then it is what ten passes over these frames give."""
    tracks = seen(BODY, cameras(14), 1.0, noise=1.0)
    states = variational.run(tracks, SHORT)
    assert [state.full for state in states[9:13]] == [False, False, True, True]
    assert not states[10].shape.any()
    assert states[10].published is None
    assert np.isnan(states[10].free_energy)
    whole = variational.fit(Tracks(tracks.positions[:12], tracks.variances[:12]))
    assert np.array_equal(states[11].shape, whole.shape)
    assert np.allclose(states[11].shape_covariances, whole.shape_covariances)
    assert states[11].free_energy == whole.free_energies[-1]


@pytest.mark.parametrize("forgetting", ["common", "by-information"])
def test_noise_free_tracks_are_recovered(forgetting: variational.Forgetting) -> None:
    """From nearly noise-free tracks the shape is right to 1e-6 in every step."""
    states = variational.run(seen(BODY, cameras(40), 1e-4), Settings(window=20, forgetting=forgetting))
    assert max(shape_error(state.shape, BODY) for state in states if state.full) < 1e-6


def hidden_late(frames: int = 60) -> np.ndarray:
    """One px, but of the last point 30 px from frame 20 on."""
    sd = np.ones((frames, 9))
    sd[20:, 8] = 30.0
    return sd


def test_a_hidden_point_is_not_forgotten_where_information_counts() -> None:
    """Of a point that is hidden longer than the window the common average keeps nothing, its own average all."""
    tracks = seen(BODY, cameras(60), hidden_late(), noise=1.0)
    common, own = (
        variational.run(tracks, Settings(window=20, forgetting=forgetting, memory=0.95))[-1]
        for forgetting in ("common", "by-information")
    )
    assert shape_error(own.shape, BODY) < 0.5 * shape_error(common.shape, BODY)
    assert own.eta[8] < 0.2 * own.eta[0]
    assert common.eta[8] == common.eta[0]


def test_unseen_points_stay_finite() -> None:
    """A point that is not seen in any frame, and a frame in which none is, make nothing infinite."""
    sd = np.where(np.arange(9) == 4, np.inf, np.ones((40, 9)))
    sd[25] = np.inf
    for forgetting in ("common", "by-information"):
        settings = Settings(window=12, forgetting=forgetting)  # type: ignore[arg-type] # one of the two
        state = variational.run(seen(BODY, cameras(40), sd, noise=1.0), settings)[-1]
        assert np.isfinite(state.second).all()
        assert np.isfinite([state.free_energy, state.average_energy, state.best_energy]).all()
        assert state.published is not None


def test_what_is_published_is_the_best_so_far() -> None:
    """The published shape is that of the step with the greatest average free energy."""
    states = [s for s in variational.run(seen(BODY, cameras(40), 1.0, noise=1.0), SHORT) if s.full]
    best = int(np.argmax([state.average_energy for state in states]))
    assert states[-1].best_energy == states[best].average_energy
    assert np.array_equal(states[-1].published, states[best].shape)


def test_bad_input_is_refused() -> None:
    """Too few points, another number of them, NaN and settings without sense are refused with a sentence."""
    with pytest.raises(ValueError, match="at least 4 points, got 3"):
        variational.begin(3)
    state = variational.begin(5)
    with pytest.raises(ValueError, match=r"positions and variances \(5, 2\), got \(4, 2\)"):
        variational.step(state, np.ones((4, 2)), np.ones((4, 2)))
    with pytest.raises(ValueError, match="finite positions"):
        variational.step(state, np.full((5, 2), np.nan), np.ones((5, 2)))
    with pytest.raises(ValueError, match="window of at least 2"):
        Settings(window=1)
    with pytest.raises(ValueError, match="memory of 0 to 1"):
        Settings(memory=1.5)
