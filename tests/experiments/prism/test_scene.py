import numpy as np
import pytest
from scipy.spatial import ConvexHull

from pftrack.core.geometry import rotation
from pftrack.core.model.parameters import revise
from pftrack.core.model.source import History
from pftrack.core.numerics.matrices import pinhole
from pftrack.experiments.prism import scene
from pftrack.experiments.prism.scene import FRAMES, REAR, VERTICES_MM, PrismParameters, PrismSource, sight

SCENE = PrismParameters()


def sights(**values: object) -> list[scene.Sight]:
    given = revise(SCENE, values)
    return [sight(0, t, given) for t in range(FRAMES)]


def test_rear_vertices_hide_as_often_as_they_should() -> None:
    """Vertices with odd numbers are always visible, the others are hidden in 31, 29, 32 and 29 % of the frames."""
    visible = np.array([now.visible for now in sights()])
    assert visible[:, [0, 2, 4, 6]].all()
    assert np.allclose(1 - visible[:, REAR].mean(axis=0), [0.314, 0.290, 0.315, 0.286], atol=0.01)
    assert np.bincount(8 - visible.sum(axis=1)).tolist() == [50, 397, 178]


def test_a_vertex_is_hidden_if_the_solid_is_in_front_of_it() -> None:
    """A vertex is hidden exactly if the line of sight, just before it, runs inside the convex hull."""
    planes = ConvexHull(VERTICES_MM).equations
    for t in range(0, FRAMES, 7):
        now = sight(0, t, SCENE)
        eye = -now.translation_mm @ rotation(now.theta_rad)
        before = VERTICES_MM + 1e-3 * (eye - VERTICES_MM)
        inside = (before @ planes[:, :3].T + planes[:, 3] < -1e-9).all(axis=1)
        assert np.array_equal(inside, ~now.visible)


def test_measurements_have_the_stated_noise() -> None:
    """Measurements less the truth, divided by their standard deviations, are standard normal, hidden or not."""
    scores, hidden = [], []
    for now in sights():
        placed = VERTICES_MM @ rotation(now.theta_rad).T + now.translation_mm
        assert np.allclose(now.true_px, pinhole(placed, 400.0))
        assert np.array_equal(now.noise_sd_px, np.where(now.visible, 1.0, 100.0))
        scores.append((now.points_px - now.true_px) / now.noise_sd_px[:, None])
        hidden.append(~now.visible)
    for chosen, within in ((slice(None), 0.02), (np.array(hidden), 0.05)):
        assert np.std(np.array(scores)[chosen]) == pytest.approx(1.0, abs=within)


def test_the_motion_is_that_of_the_study() -> None:
    """Angles and translation are the sinusoids of docs/methods/adaptive.md; at first it faces the camera."""
    still = sight(0, 0, SCENE)
    assert not still.theta_rad.any()
    assert scene.visible_faces(still.theta_rad, still.translation_mm).tolist() == [
        True,
        False,
        True,
        True,
        False,
        False,
    ]
    for t, now in enumerate(sights(translation=1)):
        u = t / 625
        theta = [20 * np.sin(6 * np.pi * u), 40 * np.sin(8 * np.pi * u), 15 * np.sin(4 * np.pi * u)]
        assert np.allclose(np.rad2deg(now.theta_rad), theta)
        across, down = 20 * np.sin(4 * np.pi * u), 15 * np.sin(6 * np.pi * u)
        assert np.allclose(now.translation_mm, [across, down, 80 * (1 + 0.15 * np.sin(3 * np.pi * u))])


def test_the_motion_is_continuous_when_the_speed_changes() -> None:
    """After a change of speed in mid-run it continues from the same pose."""
    source, history = PrismSource(0, SCENE), History(((0, SCENE), (101, revise(SCENE, {"speed": 3}))))
    for frame, usual in ((100, 100), (110, 130)):
        assert np.allclose(source.sight(frame, history).theta_rad, sight(0, usual, SCENE).theta_rad)
    assert np.array_equal(source.sight(40, history).points_px, sight(0, 40, SCENE).points_px)
