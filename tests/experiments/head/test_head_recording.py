"""The head on recordings: found, started late, lost and found again, and refused."""

from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import History
from pftrack.core.refusal import RefusedError
from pftrack.experiments import find
from pftrack.experiments.head import recording
from pftrack.experiments.head.recording import FINDER, FaceBox, FacePoints, PoseTable, first_face, read_poses
from pftrack.experiments.head.scene import HeadSceneParameters, HeadSource
from pftrack.runs.run import Run
from pftrack.sources.sequence import open_sequence
from pftrack.sources.truth import TruthTable
from pftrack.vision.face import FEATURES, gaze
from tests.experiments.head.heads import Picture, Pictures, empty, marked, pictures, simulated
from tests.making import truth_file, whole_run

HEAD = find("head")
CLIP = Path(__file__).parents[3] / ".." / "shared" / "data" / "face_turning"
NEEDS_CLIP = pytest.mark.skipif(not CLIP.exists(), reason="the sample clips are not beside this checkout")


def on(shown: list[Picture], **options: object) -> Run:
    """Return a finished run on pictures; options are those of `on_video`."""
    return whole_run(HEAD, HEAD.video.on_video(Pictures(shown), None, **options), seed=2)  # type: ignore[arg-type]


def largest_yaw_deg(run: Run, error_deg: float, correlation: float) -> float:
    """Return the largest true yaw of a face that is tracked near the truth in all frames."""
    report = HEAD.measured.report(run.diagnostics)  # type: ignore[misc]
    truth = np.array([row.series["yaw_deg_true"] for row in run.diagnostics])
    assert report["tracked_share"] == 1.0
    assert max(report["mean_abs_error_deg"].values()) < error_deg
    assert np.corrcoef(np.array(report["yaw_deg"]), truth)[0, 1] > correlation
    return float(abs(truth).max())


def test_a_face_is_found_and_its_pose_has_the_right_signs() -> None:
    """Through a turn to either side yaw, pitch and roll follow the truth."""
    frames = enumerate(simulated(110, width=480, every=2))
    truth = PoseTable({index: tuple(np.rad2deg(gaze(frame.target.position)).tolist()) for index, frame in frames})
    assert largest_yaw_deg(on(pictures(110, width=480, every=2), truth=truth), 7.0, 0.95) > 20


@pytest.mark.parametrize(
    "change",
    [
        lambda picture: np.stack([picture[:, :, 0], picture[:, :, 0] // 2, picture[:, :, 0] // 3], axis=2),
        lambda picture: np.repeat(np.repeat(picture, 3, axis=0), 3, axis=1),
        lambda picture: picture[12:-11, 7:-8],
    ],
    ids=["colour", "large", "odd size"],
)
def test_unusual_pictures_are_tracked(change: object) -> None:
    """These are a tinted, an enlarged and a cropped picture."""
    run = on(pictures(12, change, width=320))  # type: ignore[arg-type]
    assert HEAD.measured.report(run.diagnostics)["tracked_share"] == 1.0  # type: ignore[misc]
    assert max(abs(angle) for angle in run.diagnostics[-1].estimate) < 12


def test_noises_follow_the_frame_rate_and_the_size_of_the_face() -> None:
    """At 12 frames a second features may move 2.5 times as far in a frame as at 30, and further on a larger face."""
    shown = pictures(3, width=320)
    usual, slow = (HEAD.video.on_video(Pictures(shown, frame_rate_hz=rate), None).parameters for rate in (30.0, 12.0))
    for name, factor in (("feature_noise_px", 2.5), ("camera_noise", 2.5), ("pose_change_noise", 6.25)):
        assert getattr(slow, name) == pytest.approx(factor * getattr(usual, name))
    assert slow.sd_floor_px == usual.sd_floor_px  # type: ignore[attr-defined]
    large = HEAD.video.on_video(Pictures(pictures(3, width=640)), None).parameters
    assert large.feature_noise_px / usual.feature_noise_px == pytest.approx(2.0, abs=0.15)  # type: ignore[attr-defined]


def test_a_face_that_leaves_and_returns_is_found_again() -> None:
    """Without a face the tracker searches with growing uncertainty; afterwards the uncertainty is small again."""
    shown = pictures(40, width=320)
    run = on([*shown[:10], *[empty(shown[0])] * 40, *shown[10:40]])
    face = np.array([not row.searching for row in run.diagnostics])
    sigma = np.array([row.sigma[1] for row in run.diagnostics])
    assert face[:10].all()
    assert not face[25:50].any()
    assert face[60:].all()
    assert sigma[45] > max(3 * sigma[9], sigma[30])
    assert sigma[79] < 2 * sigma[9]
    assert abs(run.diagnostics[-1].estimate[1]) < 12
    assert HEAD.measured.report(run.diagnostics)["tracked_share"] == pytest.approx(face.mean())  # type: ignore[misc]


def test_marked_points_are_taken_as_they_are() -> None:
    """Marked points stay in place; the model places the others."""
    for points in (marked(), {name: marked()[name] for name in ("leye", "reye", "nose")}):
        setup = HEAD.video.on_video(Pictures(pictures(3, width=320)), FacePoints.read({"points": points}))
        placed = setup.footage.mark["points"]
        assert {name: placed[name] for name in points} == {name: pytest.approx(at) for name, at in points.items()}
        assert len(placed) == 11
        assert np.isfinite(Run(HEAD, setup).finish().diagnostics.estimate).all()


def test_a_box_says_which_face() -> None:
    """The face in the box is tracked, not the other one; a box without a face is refused."""
    both = Pictures([np.hstack([picture, picture]) for picture in pictures(2, width=320)])
    for left in (0, 320):
        setup = HEAD.video.on_video(both, FaceBox.of(left + 100.0, 40.0, 120.0, 150.0))
        xs = [x for x, _ in setup.footage.mark["points"].values()]
        assert left < min(xs) < max(xs) < left + 320
    with pytest.raises(RefusedError):
        HEAD.video.on_video(both, FaceBox.of(0.0, 0.0, 40.0, 40.0))


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ({"nose": (10.0, 10.0)}, "at least two"),
        ({"leye": (1.0, 1.0), "ear": (2.0, 2.0)}, "one of nose"),
        ({"leye": (190.0, 90.0), "reye": (140.0, 90.0), "nose": (9999.0, 90.0)}, "within the picture of 320 x 240 px"),
        ({"leye": (190.0, 90.0), "reye": (190.0, 90.0)}, "all at one place"),
        (dict.fromkeys(FEATURES, (100.0, 100.0)), "all at one place"),
        ({name: (100.0 + 9 * index, 100.0) for index, name in enumerate(FEATURES)}, "one line or all in one place"),
    ],
)
def test_unusable_points_are_refused(points: dict[str, tuple[float, float]], message: str) -> None:
    """Too few points, unknown ones, and points outside, in one place or on one line are refused by name."""
    shown = Pictures(pictures(3, width=320))
    with pytest.raises(ValueError, match=message):
        Run(HEAD, HEAD.video.on_video(shown, FacePoints.read({"points": points})))


@NEEDS_CLIP
def test_the_real_clip_is_followed() -> None:
    """On the sample clip yaw, pitch and roll stay within 5 degrees of the reference, without a loss."""
    with closing(open_sequence(CLIP / "clip.mp4")) as sequence:
        setup = HEAD.video.on_video(sequence, None, truth=read_poses(CLIP / "reference_pose.csv"))
        run = whole_run(HEAD, setup, seed=0)
    assert largest_yaw_deg(run, 3.0, 0.9) > 0


@NEEDS_CLIP
def test_a_face_first_seen_from_the_side_is_followed() -> None:
    """The short sample, whose head turns by 65 degrees in half a second, is tracked from its first frontal picture."""
    truth = read_poses(CLIP / "head_turn_short_reference_pose.csv")
    with closing(open_sequence(CLIP / "head_turn_short.gif")) as sequence:
        setup = HEAD.video.on_video(sequence, None, truth=truth)
        run = whole_run(HEAD, setup, seed=0)
    assert abs(truth.poses[setup.footage.start][0]) < 10.0  # type: ignore[index]
    assert HEAD.measured.report(run.diagnostics)["tracked_share"] > 0.7  # type: ignore[misc]


# Tables of true poses are read or refused as a whole, and are relative to a frame.


def test_poses_are_read_and_taken_relative_to_a_frame(tmp_path: Path) -> None:
    """A table of poses gives the angles of the rotation, minus those of the zero frame."""
    poses = read_poses(truth_file(tmp_path, "frame,yaw_deg,pitch_deg,roll_deg,x\n3,10,-5,2,\n4,20,-8,1,\n5,,,,\n"))
    assert poses.rows == {3: (10.0, -5.0, 2.0), 4: (20.0, -8.0, 1.0)}
    assert poses.at(5) is None
    for table, angles in ((poses, (20, -8, 1)), (replace(poses, zero=3), (10, -3, -1))):
        assert np.rad2deg(gaze(table.at(4).position)) == pytest.approx(angles)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("frame,x,y,w,h\n0,1,2,3,4\n", "expected the columns frame, yaw_deg, pitch_deg, roll_deg, got frame, x"),
        ("frame,yaw_deg,pitch_deg,roll_deg\n0,1,2,400\n", "roll_deg must be a number of degrees, got '400'"),
        ("frame,yaw_deg,pitch_deg,roll_deg\n0,1,2,3\n0,1,2,3\n", "frame 0 is listed twice; one pose a frame"),
    ],
)
def test_a_wrong_table_of_poses_is_refused(tmp_path: Path, text: str, message: str) -> None:
    """The message names columns, values or frames; a table of boxes is refused as the truth of a head."""
    with pytest.raises(RefusedError, match=message):
        read_poses(truth_file(tmp_path, text))
    with pytest.raises(ValueError, match="expected the truth of a head as a table of poses"):
        HEAD.video.on_video(Pictures(pictures(3, width=320)), None, truth=TruthTable({0: (1, 2, 3, 4)}))


# The first face of a recording: a search in a bounded number of pictures, or in a box.


@pytest.mark.parametrize("count", [1, 49, 50, 51, 400, 20_000])
def test_the_number_of_searched_pictures_is_bounded(count: int) -> None:
    """The first pictures are searched one by one, later ones at even distances."""
    frames = list(recording.to_search(3, 3 + count - 1))
    assert frames == sorted(set(frames))
    assert frames[:50] == list(range(3, 3 + min(count, 50)))
    assert frames[-1] < 3 + count
    assert len(frames) <= recording.MOST_SEARCHED
    assert max(np.diff(frames), default=0) <= max(5, count / 100)


def test_sightings_are_reported_one_by_one() -> None:
    """Each picture is reported, with a reason for the first only, and a face with its points placed by the model."""
    face = pictures(1)
    told = list(FINDER.search(Pictures([empty(face[0])] * 2 + face), [0, 1, 2]))
    assert [(it.frame, bool(it.remarks)) for it in told] == [(0, True), (1, False), (2, False)]
    assert [it.sure for it in told] == [False, False, True]
    assert told[2].placed == ("points.lmc", "points.rmc")
    for name, place in marked().items():
        assert np.hypot(*np.subtract(told[2].mark.points[name], place)) < 6


def test_a_face_from_the_front_is_a_better_start() -> None:
    """A face that first looks aside begins where it looks into the camera, and a remark reports this.

    Without such a picture within a second, the first one is used.
    """
    scene = revise(HeadSceneParameters(), {"person": 101})
    source, history = HeadSource(0, scene), History(((0, scene),))
    shown = [source.frame(frame, history).image_rgb for frame in range(96, 108, 2)]  # at 104 the yaw is 6 degrees
    first, points = first_face(Pictures(shown, frame_rate_hz=15.0), 0)
    assert 2 <= first <= 4
    assert points.shape == (11, 2)
    aside, frontal = FINDER.search(Pictures(shown), [0, 5])
    assert "looks aside" in aside.remarks[-1]
    assert frontal.remarks == ()
    assert first_face(Pictures(shown[:1] * 3 + shown[-1:], frame_rate_hz=2.0), 0)[0] == 0


def test_points_behind_sunglasses_are_not_sure() -> None:
    """All points are proposed by proportion, within 30 px, with a remark."""
    (sighting,) = FINDER.search(Pictures(pictures(1, width=640, sunglasses=True)), [0])
    truth = simulated(1, width=640, sunglasses=True)[0].target.landmarks.points_px
    off = np.array([sighting.mark.points[name] for name in FEATURES]) - truth
    assert np.hypot(*off.T).max() < 30
    assert sighting.placed == tuple(f"points.{name}" for name in FEATURES)
    assert not sighting.sure
    assert "drag them" in sighting.remarks[0]


def test_a_box_without_a_face_gets_a_mean_face() -> None:
    """The points of a mean face fill the box and stay within the picture."""
    nobody = Pictures([empty(pictures(1)[0])])
    sighting = FINDER.within(nobody, 0, FaceBox.of(240.0, 60.0, 80.0, 180.0))
    points = np.array([sighting.mark.points[name] for name in FEATURES])
    assert ((points >= (240, 60)) & (points <= (319, 239))).all()
    assert points[FEATURES.index("reye"), 0] < points[FEATURES.index("nose"), 0] < points[FEATURES.index("leye"), 0]
    with pytest.raises(ValueError, match="within the picture of"):
        FINDER.within(nobody, 0, FaceBox.of(300.0, 0.0, 100.0, 50.0))
