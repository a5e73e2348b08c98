import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import History
from pftrack.experiments.trajectories.scene import CORNERS_FRAMES as FRAMES
from pftrack.experiments.trajectories.scene import (
    CORNERS_PX,
    LINE,
    ON_BOOK,
    ON_BOX,
    ON_WALL,
    CornerSceneParameters,
    CornerSource,
    SceneMotion,
    book,
    shifts_px,
    wall,
)
from pftrack.experiments.trajectories.scene import CORNERS_SIZE_PX as SIZE_PX
from pftrack.vision.matching import cut, match

PLAIN = CornerSceneParameters()
CLEAN = revise(PLAIN, {"image_noise_sd": 0, "gain_jump": 0, "gain_jump_share": 0})


def history(parameters: CornerSceneParameters = PLAIN) -> History[CornerSceneParameters]:
    return History(((0, parameters),))


def grey(source: CornerSource, index: int, past: History[CornerSceneParameters]) -> NDArray[np.uint8]:
    image = source.frame(index, past).image_rgb
    assert image is not None
    return image[:, :, 0]


@pytest.fixture(scope="module")
def source() -> CornerSource:
    return CornerSource(1, PLAIN)


def test_corners_stay_in_sight(source: CornerSource) -> None:
    """At most 60 corners of all surfaces are followed, and for 60 frames none is near the edge or hidden."""
    points = source.points_px
    first = np.zeros(len(points), np.int64)
    motion = SceneMotion(shifts_px(np.arange(float(FRAMES))))
    assert 50 <= len(points) <= 60
    assert set(motion.surfaces(points, first)) == {ON_WALL, ON_BOOK, ON_BOX}
    for index in (0, 20, 59):
        now = motion.path(points, index, first)
        assert (now >= 12).all()
        assert (now <= np.array(SIZE_PX) - 13).all()
        assert not motion.hidden(points, index, 8.0).any()


def test_false_corners_lie_on_the_slanted_line(source: CornerSource) -> None:
    """The last six points are on the book's bright line, evenly along it."""
    (x0, y0), (x1, y1) = LINE
    on_book = source.points_px[-6:] - CORNERS_PX[ON_BOOK]
    off = (on_book[:, 0] - x0) * (y1 - y0) - (on_book[:, 1] - y0) * (x1 - x0)
    assert np.abs(off / np.hypot(x1 - x0, y1 - y0)).max() < 1.0
    x, y = np.rint(on_book).astype(int).T
    assert (book(1)[y, x] == 16 * 225).all()
    without = CornerSource(1, revise(PLAIN, {"false_corners": 0}))
    assert not (without.points_px[:, None] == source.points_px[-6:]).all(axis=2).any()


def test_the_truth_is_where_the_picture_has_moved_to() -> None:
    """Without noise and jumps, what is not ambiguous is matched within half a pixel of its true place, in any frame."""
    source = CornerSource(0, CLEAN)
    points = source.points_px
    first = np.zeros(len(points), np.int64)
    for index in (1, 25, 59):
        motion = source.frame(index, history(CLEAN)).target.motion  # type: ignore[union-attr]
        truth = motion.path(points, index, first)
        templates = cut(grey(source, 0, history(CLEAN)), points.astype(np.int64), 11)
        found = match(grey(source, index, history(CLEAN)), templates, np.rint(truth).astype(np.int64), 3, "correlation")
        off = np.abs(found.places + found.offsets - truth).max(axis=1)
        assert np.median(off) < 0.15
        assert np.quantile(off[motion.surfaces(points, first) != ON_BOOK], 0.95) < 0.6


def test_points_that_are_taken_up_later_have_a_truth(source: CornerSource) -> None:
    """A point of a later picture moves with the surface that is in front there."""
    index, later = 40, 55
    motion = SceneMotion(shifts_px(np.arange(60.0)))
    corners = CORNERS_PX + motion.shifts[index]
    points = np.array([[20.0, 20.0], corners[ON_BOOK] + 5.0, corners[ON_BOX] + 5.0])
    born = np.full(3, index)
    assert motion.surfaces(points, born).tolist() == [ON_WALL, ON_BOOK, ON_BOX]
    moved = motion.path(points, later, born) - points
    assert moved == pytest.approx(motion.shifts[later] - motion.shifts[index])
    assert motion.path(points, index, born) == pytest.approx(points)
    assert SceneMotion(motion.shifts[:56]).path(points, later, born) == pytest.approx(points + moved)


def test_the_drift_turns_back() -> None:
    """After 60 frames what has drifted away comes back, so that an endless run stays in the picture."""
    shifts = shifts_px(np.arange(600.0))
    for surface, size in ((ON_BOOK, (110, 84)), (ON_BOX, (70, 90))):
        corner = CORNERS_PX[surface] + shifts[:, surface]
        assert (corner > 0).all()
        assert (corner + size < SIZE_PX).all()
    assert np.abs(shifts[:, ON_WALL]).max() < 48


def test_parameters_act_from_their_frame_on(source: CornerSource) -> None:
    """A change leaves earlier frames alone: at half the speed all is where it was half as many frames later."""
    slow = revise(PLAIN, {"scene_speed": 0.5})
    changed = History(((0, PLAIN), (11, slow)))
    assert (grey(source, 10, changed) == grey(source, 10, history())).all()
    one = source.frame(30, changed).target
    other = source.frame(20, history()).target
    assert (one.position == other.position).all()  # type: ignore[union-attr]
    noisy = History(((0, PLAIN), (5, revise(PLAIN, {"image_noise_sd": 0}))))
    assert grey(source, 6, noisy).std() < grey(source, 6, history()).std()


def test_the_light_jumps() -> None:
    """With jumps in every frame the mean brightness is off by about a tenth; without, by the flicker alone."""
    jumping = history(revise(CLEAN, {"gain_jump": 0.11, "gain_jump_share": 1}))
    source = CornerSource(0, CLEAN)
    steady = np.array([grey(source, index, history(CLEAN)).mean() for index in range(8)])
    unsteady = np.array([grey(source, index, jumping).mean() for index in range(8)])
    assert np.abs(unsteady / steady - 1.0) == pytest.approx(0.11, abs=0.01)
    assert steady.std() / steady.mean() < 0.05


def test_the_lattice_is_what_was_asked_for() -> None:
    """Pitch and contrast of the wall are those of the parameters."""
    lines = wall(0, 20, 100.0)[::-1][:, 5:9].mean(axis=1)[::-1]
    dark = lines < lines.max() - 16 * 60
    assert np.flatnonzero(dark[1:] & ~dark[:-1])[:3].tolist() == [19, 39, 59]


def test_a_scene_without_a_corner_is_refused() -> None:
    """Where nothing is left to be followed, a sentence says so."""
    with pytest.raises(ValueError, match=r"no corner of frame 0 stays in sight for 60 frames"):
        CornerSource(0, revise(PLAIN, {"false_corners": 0, "corner_margin_px": 150}))
