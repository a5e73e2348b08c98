import numpy as np
import pytest

from pftrack.core.model.parameters import revise
from pftrack.experiments.head.scene import SCRIPT_FRAMES, HeadSceneParameters, angles_rad, eased_amplitude, script_time


def script_deg(frames: int = SCRIPT_FRAMES) -> np.ndarray:
    return np.rad2deg([angles_rad(k / SCRIPT_FRAMES, 1.0) for k in range(frames)])


def moved(**values: float) -> HeadSceneParameters:
    return revise(HeadSceneParameters(), values)


def test_script_has_its_motions_in_order() -> None:
    """Turns of 35 degrees, then nods and rolls of 25, two of each, and rests between them."""
    degrees = script_deg()
    assert degrees[0].tolist() == [0, 0, 0]
    for first, last, axis, peak in ((45, 285, 1, 35), (315, 555, 0, 25), (585, 825, 2, 25)):
        part = degrees[first:last, axis]
        assert part.max() == pytest.approx(peak, abs=5)
        assert part.min() == pytest.approx(-peak, abs=5)
        others = np.delete(degrees[first:last], axis, axis=1)
        assert np.abs(others).max() < 5
        # Two cycles, each first to the positive side.
        assert part[30] > 0.7 * peak
        assert part[90] < -0.7 * peak
    assert np.abs(degrees[840:]).max() < 5


def test_330_of_900_frames_are_beyond_20_degrees() -> None:
    """As many frames as the reference counts have an axis beyond 20 degrees."""
    assert (np.abs(script_deg()) > 20).any(axis=1).sum() == pytest.approx(330, abs=5)


def test_script_goes_on_without_a_jump() -> None:
    """From frame to frame, also from the end of the script to its beginning, the head turns by less than 4 degrees."""
    assert np.abs(np.diff(script_deg(2 * SCRIPT_FRAMES), axis=0)).max() < 4


def test_changes_of_speed_and_amplitude_do_not_jump() -> None:
    """When speed or amplitude change in mid-run, the pose goes on from where it was."""
    before, after = moved(speed=1, amplitude=1), moved(speed=0.2, amplitude=0.2)
    path = []
    for frame in range(200):
        spans = [(min(frame, 80), before), (frame - 80, after)] if frame > 80 else [(frame, before)]
        path.append(angles_rad(script_time(spans), eased_amplitude(spans, 1.0)))
    assert np.rad2deg(np.abs(np.diff(path, axis=0)).max()) < 4
    assert np.abs(path[-1]).max() < np.abs(path[80]).max()


def test_speed_is_summed_and_amplitude_lags() -> None:
    """At twice the speed the script takes half the frames; the amplitude reaches what is asked for after a while."""
    assert script_time([(450, moved(speed=2))]) == pytest.approx(1)
    assert script_time([(100, moved(speed=0)), (90, moved())]) == pytest.approx(0.1)
    assert eased_amplitude([(15, moved(amplitude=0))], 1.0) == pytest.approx(np.exp(-1))
    assert eased_amplitude([(500, moved(amplitude=0.5))], 1.0) == pytest.approx(0.5)
    assert not angles_rad(0.3, 0.0).any()
