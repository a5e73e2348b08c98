"""Adapters and results beside the libraries of others: a recording holds what their filters hold."""

import json
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

import pftrack
from pftrack.sources.beliefs.recorder import ParticlesCollector, record_filterpy, record_pfilter, record_stone_soup
from pftrack.sources.results.table import Box
from pftrack.sources.results.writing import write_results
from tests.sources.films import rows_of

FRAMES, COUNT = 6, 60
MEASURED = np.arange(FRAMES, dtype=float)

pytestmark = [pytest.mark.filterwarnings(f"ignore::{it}Warning") for it in ("Deprecation", "Future", "Syntax", "User")]


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


SHOWN = 40


def boxes(confused: bool) -> list[Box]:
    """Three targets apart from each other, whose numbers change hands now and then, and which are missed at times."""
    rng = np.random.default_rng(4)
    found = []
    order = [1, 2, 3]
    for frame in range(SHOWN):
        if confused and frame % 9 == 8:
            order = [order[1], order[2], order[0]]
        found += [
            Box(frame, order[place], 60.0 * place + frame, 20.0, 20.0, 30.0, score=0.9)
            for place in range(3)
            if not confused or rng.random() < 0.9
        ]
    return found


def test_motmetrics_counts_the_same_switches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It reads the text of MOTChallenge that is written here, and finds as many identity switches."""
    tool = pytest.importorskip("motmetrics", reason="motmetrics is not installed")
    monkeypatch.setattr(np, "asfarray", np.asarray, raising=False)  # it was written for NumPy 1
    read = []
    for confused in (False, True):
        data = write_results("mot", boxes(confused), frames=SHOWN, size=(320, 240), rate_hz=25.0)
        (tmp_path / "boxes.txt").write_bytes(data)
        read.append(tool.io.loadtxt(tmp_path / "boxes.txt", fmt="mot15-2D"))
    found = tool.utils.compare_to_groundtruth(*read, "iou", distth=0.5)
    counted = tool.metrics.create().compute(found, metrics=["num_switches"])["num_switches"].item()
    with pftrack.record(tmp_path / "mine.pft") as rec:
        for box in boxes(confused=True):
            rec(box.frame, box=box[2:6], target=box.target)
        for box in boxes(confused=False):
            rec.truth(box.frame, box=box[2:6], target=box.target)
    assert counted > 0
    assert sum(row.number("identity_switches") for row in rows_of(tmp_path / "mine.pft")) == counted


def test_pycocotools_reads_what_is_written(tmp_path: Path) -> None:
    """It indexes images and annotations, and finds each box where it was."""
    tool = pytest.importorskip("pycocotools.coco", reason="pycocotools is not installed")
    path = tmp_path / "boxes.json"
    path.write_bytes(write_results("coco", boxes(confused=False), frames=SHOWN, size=(320, 240), rate_hz=25.0))
    coco = tool.COCO(str(path))
    assert len(coco.getImgIds()) == json.loads(path.read_text())["videos"][0]["length"] == SHOWN
    assert coco.loadAnns(coco.getAnnIds(imgIds=[1]))[0]["bbox"] == [0.0, 20.0, 20.0, 30.0]
