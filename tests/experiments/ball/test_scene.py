import numpy as np
import pytest

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import History
from pftrack.experiments.ball.experiment import SimulatedBallParameters
from pftrack.experiments.ball.scene import BallSource
from pftrack.experiments.shared.recording import LAYOUTS


def scene(**values: object) -> SimulatedBallParameters:
    return revise(SimulatedBallParameters(), values)


def shown(index: int, seed: int = 0, **values: object) -> np.ndarray:
    parameters = scene(**values)
    return BallSource(seed, parameters).frame(index, History(((0, parameters),))).image_rgb


def red(image: np.ndarray) -> np.ndarray:
    return (image == (200, 50, 50)).all(axis=-1)


def test_path_is_a_swing_about_the_middle() -> None:
    """U = 160 - 100 cos(2 pi t / 30), v = 120."""
    parameters = scene()
    source = BallSource(0, parameters)
    for t in range(60):
        frame = source.frame(t, History(((0, parameters),)))
        assert np.allclose(frame.target.position, [160 - 100 * np.cos(2 * np.pi * t / 30), 120])
        assert frame.time_s == pytest.approx(t / 30)
        assert frame.target.size == 10


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
    slots = [(100 + 60 * column, 70 + 100 * row) for row in range(2) for column in range(3)]
    for layout, chosen in enumerate(LAYOUTS):
        image = red(shown(0, layout=layout, distracter_radius_px=8, occlusion_width_px=0))
        for slot, (u, v) in enumerate(slots):
            rows, columns = np.mgrid[:240, :320]
            disc = (rows - v) ** 2 + (columns - u) ** 2 <= 64
            assert image[disc].all() == (slot in chosen)
        image[:, :70] = False  # the ball itself
        assert image.sum() == 3 * 197


def test_hidden_means_wholly_covered() -> None:
    """The ball counts as hidden only while all of it is behind the occluder."""
    parameters = scene(occlusion_width_px=100, distracter_radius_px=0)
    source = BallSource(0, parameters)
    for t in range(31):
        frame = source.frame(t, History(((0, parameters),)))
        assert frame.target.hidden == (not red(frame.image_rgb).any())


def test_noise_belongs_to_seed_and_frame() -> None:
    """Pixel noise has the spread asked for, and is the same for the same seed and frame only."""
    first = shown(3, seed=1, image_noise_sd=5)
    assert np.array_equal(first, shown(3, seed=1, image_noise_sd=5))
    assert not np.array_equal(first, shown(3, seed=2, image_noise_sd=5))
    assert not np.array_equal(first, shown(33, seed=1, image_noise_sd=5))
    assert (first[:60, :100].astype(float) - 100).std() == pytest.approx(5, rel=0.02)


def test_a_change_of_speed_does_not_make_the_ball_jump() -> None:
    """When frame rate or period change in mid-run the phase goes on from where it was."""
    before, after = scene(), scene(frame_rate_hz=10, period_s=2)
    source = BallSource(0, before)
    history = History(((0, before), (11, after)))
    turns = [10 / 30 + max(t - 10, 0) / 20 if t > 10 else t / 30 for t in range(30)]
    for t, turn in enumerate(turns):
        frame = source.frame(t, history)
        assert frame.target.position[0] == pytest.approx(160 - 100 * np.cos(2 * np.pi * turn))
    assert source.frame(29, history).time_s == pytest.approx(10 / 30 + 19 / 10)


def test_frames_cannot_be_spoiled() -> None:
    """A picture that a source hands out is read-only, since others may be looking at it."""
    with pytest.raises(ValueError, match="read-only"):
        shown(0)[0, 0] = 0


def test_other_reading_of_the_scene() -> None:
    """Picture size, amplitude and slots can be set to the other reading of Bando 2007, ch. 3 section 3."""
    values = {
        "image_width_px": 640,
        "image_height_px": 480,
        "amplitude_px": 200,
        "frame_rate_hz": 60,
        "slot_spacing_px": 120,
        "slot_offset_px": 30,
        "layout": 0,
        "occlusion_width_px": 0,
    }
    image = red(shown(30, **values))
    assert image.shape == (480, 640)
    assert image[240, 520]
    assert image[210, [200, 320, 440]].all()


def test_a_bouncing_ball_flies_evenly_between_four_walls() -> None:
    """Its speed is the same in all frames but those of a bounce; it stays within its walls, in the picture."""
    parameters = scene(ball_path="bounces", period_s=3, amplitude_px=100)
    source = BallSource(0, parameters)
    places = np.array([source.frame(t, History(((0, parameters),))).target.position for t in range(400)])
    assert places[0, 0] == 60
    assert (np.abs(places - [160, 120]) <= 100 + 1e-9).all()
    turns = np.abs(np.diff(places, 2, axis=0)).max(axis=1) > 1e-9
    assert 10 < turns.sum() < 40
    assert np.abs(np.diff(places, axis=0)).max(axis=0) == pytest.approx([400 / 90, 0.618 * 400 / 90])
    low = scene(ball_path="bounces", image_height_px=60, amplitude_px=100)
    assert np.ptp([BallSource(0, low).frame(t, History(((0, low),))).target.position[1] for t in range(60)]) <= 50


def test_clutter_lies_clear_of_the_swing() -> None:
    """Each thing more leaves the others where they are, none touches the ball's way, and another seed has others."""
    bare, few, many = (shown(0, clutter_count=count) for count in (0, 10, 30))
    added = (few != bare).any(axis=-1)
    assert added.any()
    assert (many[added] != bare[added]).any(axis=-1).all()
    rows = np.flatnonzero((many != bare).any(axis=(1, 2)))
    assert np.abs(rows - 120).min() > 5
    assert not np.array_equal(many, shown(0, seed=1, clutter_count=30))
    shares = many[(many != bare).any(axis=-1)] @ [1.0, 0.0, 0.0] / many[(many != bare).any(axis=-1)].sum(axis=-1)
    assert shares == pytest.approx(2 / 3, abs=0.01)
