"""Measurements that are silently wrong: found, and kept out of shapes."""

import numpy as np

from pftrack.core.geometry import rotation
from pftrack.core.model.parameters import Value
from pftrack.experiments import find
from pftrack.vision.structure import variational
from pftrack.vision.structure.cameras import Sight
from pftrack.vision.structure.factorization import Tracks, shape_error
from pftrack.vision.structure.growing import find_right, fit_despite_outliers
from tests.making import whole_run

POINTS = np.random.default_rng(7).standard_normal((12, 3))
FOCAL, NOISE = 900.0, 1.0
CAMERA = np.column_stack([np.eye(3), [0.0, 0.0, 9.0]])


def seen(theta: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the points (2, n) that a pinhole sees, with noise, px."""
    x, y, z = rotation(theta) @ POINTS.T + np.array([[0.0], [0.0], [9.0]])
    return FOCAL * np.stack([x / z, y / z]) + NOISE * rng.standard_normal((2, len(POINTS)))


def test_what_has_slipped_is_found() -> None:
    """Two of 12 measurements are 40 px off: these are found wrong, and hardly one of the others."""
    rng = np.random.default_rng(1)
    sure = np.zeros((12, 3, 3))
    believed = []
    for _ in range(20):
        rows = seen(np.array([0.02, -0.03, 0.01]), rng)
        slipped = rng.choice(12, 2, replace=False)
        for point in slipped:
            turn = rng.uniform(0, 2 * np.pi)
            rows[:, point] += 40.0 * np.array([np.cos(turn), np.sin(turn)])
        right = find_right(Sight(FOCAL, rows, np.full((2, 12), NOISE**-2)), CAMERA, POINTS, sure, 0.02)
        assert right[slipped].max() < 1e-3
        believed.extend(np.delete(right, slipped))
    assert np.mean(believed) > 0.98


def test_a_shape_that_is_wrong_itself_accuses_nobody() -> None:
    """Where no point is where the shape has it, hardly one is taken to be wrong; missing ones are left alone."""
    rng = np.random.default_rng(2)
    rows, precisions = seen(np.zeros(3), rng), np.full((2, 12), NOISE**-2)
    other = POINTS + 0.3 * rng.standard_normal(POINTS.shape)
    right = find_right(Sight(FOCAL, rows, precisions), CAMERA, other, np.zeros((12, 3, 3)), 0.02)
    assert np.median(right) > 0.9
    assert (right > 0.5).sum() >= 10
    rows[:, 3], precisions[:, 3] = 0.0, 0.0
    assert find_right(Sight(FOCAL, rows, precisions), CAMERA, POINTS, np.zeros((12, 3, 3)), 0.02)[3] == 1.0
    precisions[:, 4:] = 0.0
    rows[:, 0] += 50.0
    assert find_right(Sight(FOCAL, rows, precisions), CAMERA, POINTS, np.zeros((12, 3, 3)), 0.02).tolist() == [1.0] * 12


def test_a_factorization_does_without_them() -> None:
    """With a tenth of the measurements 40 px off the shape is as good as without, and all are believed if asked to."""
    rng = np.random.default_rng(3)
    views = [100.0 * POINTS @ rotation(np.array([0.03 * t, 0.02 * t, 0.0]))[:2].T for t in range(30)]
    clean = np.array(views) + NOISE * rng.standard_normal((30, 12, 2))
    wrong = clean.copy()
    slipped = rng.random(wrong.shape[:2]) < 0.1
    turns = rng.uniform(0, 2 * np.pi, slipped.sum())
    wrong[slipped] += 40.0 * np.column_stack([np.cos(turns), np.sin(turns)])
    variances = np.full(clean.shape, NOISE**2)

    def error(fit: variational.Variational) -> float:
        return shape_error(variational.metric(fit).shape, POINTS, "similarity")

    doubted, fit = fit_despite_outliers(Tracks(wrong, variances), 0.02)
    assert (doubted.variances[slipped] > 100.0).mean() > 0.95
    assert (doubted.variances[~slipped] < 2.0).mean() > 0.95
    _, ordinary = fit_despite_outliers(Tracks(wrong, variances), 0.0)
    assert np.array_equal(ordinary.shape, variational.fit(Tracks(wrong, variances)).shape)
    assert error(fit) < 4.0 * error(variational.fit(Tracks(clean, variances)))
    assert error(ordinary) > 3.0 * error(fit)


def test_wrong_tracks_do_not_spoil_a_face() -> None:
    """With a twentieth of tracks 40 px off the shape of a face is nearly as good as without, but not if all count."""
    experiment = find("structure")

    def error(**values: Value) -> float:
        scene: dict[str, Value] = {"tracked_body": "face", "swing_deg": 40, "seen_noise_px": 1, **values}
        run = whole_run(experiment, tracker="growing", seed=7, frames=100, values=scene)
        return float(np.median([row.error for row in run.diagnostics[70:]]))

    clean, doubted, believed = error(), error(slip_share=0.05), error(slip_share=0.05, wrong_odds=0)
    assert doubted < 1.3 * clean + 0.3
    assert believed > 1.15 * doubted
