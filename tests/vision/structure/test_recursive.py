from collections.abc import Iterable
from typing import TypeAlias

import numpy as np
import pytest

from pftrack.core.geometry import rotation
from pftrack.vision.structure import recursive
from pftrack.vision.structure.cameras import Sight, fit_camera, frontal, residuals_and_slopes, steady_camera
from pftrack.vision.structure.factorization import Tracks, shape_error
from pftrack.vision.structure.recursive import Recursive, Settings, from_window
from tests.vision.refusing import refuse
from tests.vision.structure.views import FOCAL_PX, covariance, own, usual, views

Viewed: TypeAlias = tuple[np.ndarray, np.ndarray]
SETTINGS = Settings(FOCAL_PX)


def steps(state: Recursive, frames: Iterable[Viewed], hidden: int | None = None) -> Recursive:
    """Return what is learned from frames; one point may be hidden in all."""
    for positions, variances in frames:
        if hidden is not None:
            positions[hidden], variances[hidden] = np.nan, np.inf
        state = recursive.step(state, positions, variances)
    return state


def learned(shape: np.ndarray, frames: int, settings: Settings = SETTINGS, **how: float) -> Recursive:
    state = recursive.begin(usual(), covariance(), settings)
    return steps(state, views(shape, frames, **how))  # type: ignore[arg-type] # a seed is whole


def tracks_of(frames: Iterable[Viewed]) -> Tracks:
    return Tracks(*(np.array(each) for each in zip(*frames, strict=True)))


def depths(state: Recursive) -> np.ndarray:
    return np.sqrt(state.shape_covariances[:, 2, 2])


def test_a_camera_is_found_exactly() -> None:
    """From the front the camera of a noise-free view is found to 1e-7."""
    shape, theta = own(), np.array([0.2, -0.4, 0.1])
    camera = np.column_stack([rotation(theta), [5.0, -3.0, 400.0]])
    placed = shape @ camera[:, :3].T + camera[:, 3]
    rows = np.ascontiguousarray((FOCAL_PX * placed[:, :2] / placed[:, 2:]).T)
    sight = Sight(FOCAL_PX, rows, np.ones_like(rows))
    first = frontal(sight, shape)
    found = fit_camera(sight, first, shape, first, 0.0, 30)
    assert np.abs(found - camera).max() < 1e-7


def test_noise_free_views_are_recovered() -> None:
    """From nearly noise-free views of a body that turns the shape comes back, up to a similarity, to 1e-4."""
    assert shape_error(learned(own(), 60, sd=1e-3).shape, own(), "similarity") < 1e-4


def test_learning_beats_the_prior() -> None:
    """With a pixel of noise sixty frames leave a tenth of the mean shape's error, and errors are as large as is said.

    Bodies are drawn from the prior, so the distance by the joint covariance should be chi-square; that each frame's
    slopes depend on what was learned before makes it up to twice as long.
    """
    errors, squares = [], []
    for seed in range(1, 7):
        body = own(seed)
        state = learned(body, 60, seed=seed)
        errors.append([shape_error(shape, body, "similarity") for shape in (state.shape, usual())])
        apart = (state.shape - body).ravel()
        squares.append(apart @ state.precision @ apart / apart.size)
    ours, mean = np.mean(errors, axis=0)
    assert ours < 0.1 * mean
    assert 0.5 < np.mean(squares) < 4.0


def test_a_turn_that_may_be_noise_is_taken_as_none() -> None:
    """A rotation within its noise is shrunk to none, one far beyond it is kept."""
    shape = usual()
    front = np.column_stack([np.eye(3), [0.0, 0.0, 500.0]])
    for theta, kept in ((1e-4, False), (0.5, True)):
        camera = np.column_stack([rotation(np.array([0.0, theta, 0.0])), front[:, 3]])
        rows = -residuals_and_slopes(Sight(FOCAL_PX, *np.zeros((2, 2, len(shape)))), camera, shape)[0]
        steady = steady_camera(Sight(FOCAL_PX, rows, np.ones_like(rows)), camera, front, shape)
        assert np.allclose(steady, camera if kept else front, atol=0.02 if kept else 1e-12)


def test_the_mirror_image_is_told_by_perspective() -> None:
    """Without a prior the first frames give the metric shape, not its mirror image, and later frames improve it."""
    body = own()
    frames = list(views(body, 80, sd=0.5))
    state = from_window(tracks_of(frames[:60]), SETTINGS)
    first = shape_error(state.shape, body)
    state = steps(state, frames[60:])
    assert shape_error(state.shape, body) < max(first, 0.02)
    cross = (state.shape - state.shape.mean(axis=0)).T @ (body - body.mean(axis=0))
    assert np.linalg.det(cross) > 0.0
    refuse("a body that turns", from_window, tracks_of(views(body, 30, turn=0.0, approach=0.0)), SETTINGS)


def test_what_is_hidden_is_not_forgotten() -> None:
    """With forgetting, a point that is hidden keeps its precision, while one that is seen has a bounded one."""
    frames = list(views(own(), 80))
    state = steps(recursive.begin(usual(), covariance(), Settings(FOCAL_PX, memory=0.9)), frames[:40])
    before = np.trace(state.precision[9:12, 9:12])
    state = steps(state, frames[40:], hidden=3)
    assert np.trace(state.precision[9:12, 9:12]) == pytest.approx(before, rel=0.3)
    assert shape_error(state.shape, own(), "similarity") < shape_error(usual(), own(), "similarity")
    seen = np.arange(8) != 3
    assert (depths(state)[seen] > depths(learned(own(), 80))[seen]).all()


def test_the_first_frame_forgets_nothing() -> None:
    """There the belief is the prior, so a memory below 1 changes shape and precision by no more than rounding does."""
    one, other = (learned(own(), 1, Settings(FOCAL_PX, memory=memory)) for memory in (1.0, 0.5))
    np.testing.assert_allclose(one.shape, other.shape, atol=1e-9)
    np.testing.assert_allclose(one.precision, other.precision, atol=1e-9)
