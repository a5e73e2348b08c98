"""The simulated lawn: where what is (docs/methods/colours.md), and what depends on which parameter."""

from typing import Any

import numpy as np
import pytest

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import History
from pftrack.experiments.histogram.scene import LawnSceneParameters, LawnSource, visible_share

STILL = {"image_noise_sd": 0, "lighting_amplitude": 0}


def frame(index: int, values: dict[str, Any] | None = None, seed: int = 0) -> Any:
    parameters = revise(LawnSceneParameters(), values or {})
    return LawnSource(seed, parameters).frame(index, History(((0, parameters),)))


def test_the_target_is_hidden_when_the_reference_scene_hides_it() -> None:
    """It is partly hidden in frames 76 to 107 and wholly in frames 87 to 96."""
    shares = np.array([visible_share(index, LawnSceneParameters()) for index in range(120)])
    partly, wholly = np.flatnonzero(shares < 1), np.flatnonzero(shares == 0)
    assert (partly[0], partly[-1], wholly[0], wholly[-1]) == (76, 107, 87, 96)
    assert [frame(index).target.hidden for index in (86, 87, 96, 97)] == [False, True, True, False]


def test_path_colours_and_column() -> None:
    """The target begins at (28, 120), red above, yellow below; the column covers x = 206 to 251, darker at its ends."""
    first = frame(0, STILL)
    assert first.target.position.tolist() == [28.0, 120.0]
    assert first.target.extent == (25.0, 33.0)
    assert first.image_rgb[110, 28].tolist() == [205, 40, 40]
    assert first.image_rgb[130, 28].tolist() == [215, 190, 40]
    bare = frame(0, {**STILL, "occlusion_width_px": 0}).image_rgb
    covered = np.flatnonzero((first.image_rgb != bare).any(axis=(0, 2)))
    assert (covered[0], covered[-1]) == (206, 251)
    assert (first.image_rgb[:, [206, 207, 250, 251]].max(axis=(0, 2)) < 80).all()
    later = frame(30, STILL)
    assert later.target.position == pytest.approx([94.0, 120.0 + 14.0 * np.sin(2 * np.pi / 3)])


def test_the_target_passes_in_front_of_the_look_alike() -> None:
    """Where both are, in frame 47, the picture does not depend on the look-alike under the target."""
    shown = [frame(47, {**STILL, "look_alike_red": share}) for share in (0.0, 1.0)]
    column, row = shown[0].target.position.astype(int)
    window = np.s_[row - 8 : row + 9, column - 6 : column + 7]
    assert np.array_equal(shown[0].image_rgb[window], shown[1].image_rgb[window])
    assert not np.array_equal(shown[0].image_rgb, shown[1].image_rgb)


def test_a_scene_depends_on_its_number_alone() -> None:
    """Runs of any seed see the same pictures, other numbers other lawns; the column is grey where that is asked."""
    assert np.array_equal(frame(5).image_rgb, frame(5, seed=9).image_rgb)
    assert not np.array_equal(frame(5).image_rgb, frame(5, {"scene_number": 1}).image_rgb)
    grey = frame(5, {**STILL, "column_colours": "grey"}).image_rgb[:, 210:248].astype(int)
    assert np.ptp(grey, axis=2).max() == 0
    assert grey.std() > 1


def test_noise_and_light() -> None:
    """Pixel noise has the standard deviation that is asked for, and the light grows by its amplitude."""
    still, noisy = frame(0, STILL), frame(0, {**STILL, "image_noise_sd": 10})
    assert (noisy.image_rgb.astype(float) - still.image_rgb).std() == pytest.approx(10, rel=0.02)
    dark, light = (frame(index, {**STILL, "lighting_amplitude": 0.5}).image_rgb for index in (37, 12))
    assert light[:60].mean() / dark[:60].mean() == pytest.approx(3.0, rel=0.05)


def test_it_goes_on_for_ever() -> None:
    """Long after the target has left the picture there is still a frame, in which it is not hidden but away."""
    assert frame(5000).image_rgb.shape == (240, 320, 3)
    assert frame(5000).target.hidden is False
    assert frame(1).target.hidden is False  # a flag of Python, as messages have it
