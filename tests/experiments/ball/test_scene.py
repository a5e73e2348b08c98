import numpy as np
import pytest

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import Frame, History
from pftrack.experiments.ball.experiment import SimulatedBallParameters
from pftrack.experiments.ball.scene import BallSource
from pftrack.experiments.shared.recording import LAYOUTS


def scene(**values: object) -> SimulatedBallParameters:
    return revise(SimulatedBallParameters(), values)


def seen(index: int, seed: int = 0, **values: object) -> Frame:
    parameters = scene(**values)
    return BallSource(seed, parameters).frame(index, History(((0, parameters),)))


def shown(index: int, seed: int = 0, **values: object) -> np.ndarray:
    return seen(index, seed, **values).image_rgb


def red(image: np.ndarray) -> np.ndarray:
    return (image == (200, 50, 50)).all(axis=-1)


def test_path_is_a_swing_about_the_middle() -> None:
    """It is U = 160 - 100 cos(2 pi t / 30), v = 120."""
    for t in range(60):
        frame = seen(t)
        assert np.allclose(frame.target.position, [160 - 100 * np.cos(2 * np.pi * t / 30), 120])
        assert (frame.time_s, frame.target.size) == (pytest.approx(t / 30), 10)


def test_occluder_covers_its_columns() -> None:
    """Exactly the columns 160 - w/2 <= u < 160 + w/2 show the occluder, in front of everything."""
    for width in (0, 1, 5, 40, 100, 640):
        image = shown(7, occlusion_width_px=width, distracter_radius_px=20)
        covered = (image == 60).all(axis=(0, 2))
        columns = np.arange(320)
        assert np.array_equal(covered, (160 - width / 2 <= columns) & (columns < 160 + width / 2))


def test_distracters_sit_in_three_of_six_slots() -> None:
    """Each of the twenty layouts shows three discs of the ball's colour around its slots."""
    assert len(set(LAYOUTS)) == 20
    rows, columns = np.mgrid[:240, :320]
    slots = [(rows - 70 - 100 * row) ** 2 + (columns - 100 - 60 * at) ** 2 <= 64 for row in range(2) for at in range(3)]
    for layout, chosen in enumerate(LAYOUTS):
        image = red(shown(0, layout=layout, distracter_radius_px=8, occlusion_width_px=0))
        assert [bool(image[disc].all()) for disc in slots] == [slot in chosen for slot in range(6)]
        assert image[:, 70:].sum() == 3 * 197  # the ball itself is left of them


def test_hidden_means_wholly_covered() -> None:
    """The ball counts as hidden only while all of it is behind the occluder."""
    for t in range(31):
        frame = seen(t, occlusion_width_px=100, distracter_radius_px=0)
        assert frame.target.hidden == (not red(frame.image_rgb).any())


def test_noise_belongs_to_seed_and_frame() -> None:
    """Pixel noise has its deviation, and repeats for the same seed and frame only; the picture is read-only."""
    first = shown(3, 1, image_noise_sd=5)
    for index, seed, same in ((3, 1, True), (3, 2, False), (33, 1, False)):
        assert np.array_equal(first, shown(index, seed, image_noise_sd=5)) == same
    assert (first[:60, :100].astype(float) - 100).std() == pytest.approx(5, rel=0.02)
    assert not first.flags.writeable


def test_a_change_of_speed_does_not_make_the_ball_jump() -> None:
    """After a change of frame rate or period the phase continues."""
    before, after = scene(), scene(frame_rate_hz=10, period_s=2)
    source = BallSource(0, before)
    history = History(((0, before), (11, after)))
    turns = [10 / 30 + max(t - 10, 0) / 20 if t > 10 else t / 30 for t in range(30)]
    for t, turn in enumerate(turns):
        frame = source.frame(t, history)
        assert frame.target.position[0] == pytest.approx(160 - 100 * np.cos(2 * np.pi * turn))
    assert source.frame(29, history).time_s == pytest.approx(10 / 30 + 19 / 10)


def test_a_bouncing_ball_flies_evenly_between_four_walls() -> None:
    """Its speed only changes in a bounce, and it stays within its walls and the picture."""
    values = {"ball_path": "bounces", "period_s": 3, "amplitude_px": 100}
    places = np.array([seen(t, **values).target.position for t in range(400)])
    assert places[0, 0] == 60
    assert (np.abs(places - [160, 120]) <= 100 + 1e-9).all()
    turns = np.abs(np.diff(places, 2, axis=0)).max(axis=1) > 1e-9
    assert 10 < turns.sum() < 40
    assert np.abs(np.diff(places, axis=0)).max(axis=0) == pytest.approx([400 / 90, 0.618 * 400 / 90])
    low = {"ball_path": "bounces", "image_height_px": 60, "amplitude_px": 100}
    assert np.ptp([seen(t, **low).target.position[1] for t in range(60)]) <= 50


def test_clutter_lies_clear_of_the_swing() -> None:
    """More clutter keeps the existing pieces, none touches the ball's path, and another seed has others."""
    bare, few, many = (shown(0, clutter_count=count) for count in (0, 10, 30))
    added, all_added = ((image != bare).any(axis=-1) for image in (few, many))
    assert added.any()
    assert all_added[added].all()
    assert np.abs(np.flatnonzero(all_added.any(axis=1)) - 120).min() > 5
    assert not np.array_equal(many, shown(0, 1, clutter_count=30))
    assert many[all_added][:, 0] / many[all_added].sum(axis=-1) == pytest.approx(2 / 3, abs=0.01)
