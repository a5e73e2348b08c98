"""Adapters, on the libraries themselves: what a filter of theirs holds is what the recording says."""

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

import pftrack
from pftrack.sources.beliefs.recorder import ParticlesCollector, record_filterpy, record_pfilter, record_stone_soup
from tests.sources.films import rows_of

FRAMES, COUNT = 6, 60
MEASURED = np.arange(FRAMES, dtype=float)

pytestmark = [pytest.mark.filterwarnings(f"ignore::{kind}Warning") for kind in ("Deprecation", "Syntax", "User")]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "mine.pft"


def test_particles(path: Path) -> None:
    """A collector says weights and ancestors of every step of `particles`."""
    library = pytest.importorskip("particles", reason="particles is not installed")
    rng = np.random.default_rng(0)

    class Walk(library.FeynmanKac):  # type: ignore[misc]
        def M0(self, N):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202, N802, N803 - the library's names
            return rng.standard_normal(N)

        def M(self, _t, xp):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202, N802
            return xp + 1 + rng.standard_normal(len(xp))

        def logG(self, t, _xp, x):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202, N802
            return -0.5 * (x - MEASURED[t]) ** 2

    with pftrack.record(path, precision="double") as rec:
        smc = library.SMC(fk=Walk(FRAMES), N=COUNT, collect=[ParticlesCollector(rec)], resampling="systematic")
        expected = [(float(smc.W @ smc.X), float(smc.wgts.ESS)) for _ in smc]
    rows = rows_of(path)
    assert np.array([(row.estimate[0], row.number("ess")) for row in rows]) == pytest.approx(np.array(expected))
    assert any(row.number("resampled") for row in rows)


def test_filterpy(path: Path) -> None:
    """Mean and covariance of a Kalman filter of FilterPy are the belief."""
    library = pytest.importorskip("filterpy.kalman", reason="FilterPy is not installed")
    kalman = library.KalmanFilter(dim_x=2, dim_z=1)
    kalman.F, kalman.H = np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    expected = []
    with pftrack.record(path) as rec:
        for t in range(FRAMES):
            kalman.predict()
            kalman.update(MEASURED[t])
            record_filterpy(rec, t, kalman)
            expected.append((kalman.x.ravel().copy(), np.sqrt(np.diag(kalman.P))))
    assert np.array([(row.estimate, row.sigma) for row in rows_of(path)]) == pytest.approx(np.array(expected))


def test_pfilter(path: Path) -> None:
    """Particles of pfilter are said as they were weighed, before it draws them anew."""
    library = pytest.importorskip("pfilter", reason="pfilter is not installed")
    rng = np.random.default_rng(0)
    tracker = library.ParticleFilter(
        prior_fn=lambda n: rng.standard_normal((n, 2)),
        observe_fn=lambda states: states[:, :1],
        dynamics_fn=lambda states: states + 1,
        noise_fn=lambda states: states + rng.standard_normal(states.shape),
        weight_fn=lambda seen, real: library.squared_error(seen, real, sigma=2),
        n_particles=COUNT,
    )
    means = []
    with pftrack.record(path, precision="double") as rec:
        for t in range(FRAMES):
            tracker.update(np.array([MEASURED[t]]))
            record_pfilter(rec, t, tracker)
            means.append(tracker.mean_state.copy())
    assert np.array([row.estimate for row in rows_of(path)]) == pytest.approx(np.array(means))


def test_stone_soup(path: Path) -> None:
    """Gaussians, particles and tracks of Stone Soup, which are numbered as they come."""
    pytest.importorskip("stonesoup", reason="Stone Soup is not installed")
    from stonesoup.types.array import StateVectors
    from stonesoup.types.state import GaussianState, ParticleState
    from stonesoup.types.track import Track

    now = datetime(2026, 1, 1)  # noqa: DTZ001 - as the library's own examples have it
    samples = np.random.default_rng(0).standard_normal((4, COUNT))
    weights = np.log(np.random.default_rng(1).dirichlet(np.ones(COUNT)))
    with pftrack.record(path, precision="double") as rec:
        record_stone_soup(rec, 0, ParticleState(StateVectors(samples), log_weight=weights, timestamp=now))
    assert rows_of(path)[0].estimate == pytest.approx((samples @ np.exp(weights))[:2])
    tracks = [Track(), Track()]
    with pftrack.record(path.with_name("tracks.pft")) as rec:
        for t in range(FRAMES):
            for place, track in enumerate(tracks):
                track.append(GaussianState([t, 10 * place], np.eye(2), timestamp=now + timedelta(seconds=t)))
            record_stone_soup(rec, t, tracks)
    last = rows_of(path.with_name("tracks.pft"))[-1]
    assert (last.number("targets"), last.estimate) == (2, (FRAMES - 1, 0))
