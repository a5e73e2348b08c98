"""Suitability: a target that cannot be followed is told before it is tracked, in words and with what would help."""

import runpy
from collections.abc import Iterator, Mapping

import cv2
import numpy as np
import pytest

from pftrack.core.model.marks import Box
from pftrack.core.model.parameters import revise
from pftrack.core.model.setup import NOT_AT_ALL, WELL, Setup, Suitability, grade
from pftrack.core.model.source import FrameSequence, History
from pftrack.experiments import find
from pftrack.experiments.ball.scene import BallSceneParameters, BallSource
from pftrack.experiments.head.recording import FacePoints
from pftrack.runs.run import Run
from pftrack.sources.truth import TruthTable
from tests.experiments.head.heads import Picture, Pictures, pictures
from tests.installing import ROOT

BALL, HEAD, HISTOGRAM = find("ball"), find("head"), find("histogram")
CLIPS = ROOT / ".." / "shared" / "data"

Boxes = Mapping[int, tuple[float, float, float, float]]


def of(sequence: FrameSequence, box: Box, start: int = 0, values: Mapping[str, object] | None = None) -> Suitability:
    """Return how suitable the target in a box is for the trackers of a ball."""
    setup = BALL.video.on_video(sequence, box, start=start)
    return looked_at(setup, sequence, values)


def looked_at(setup: Setup, sequence: FrameSequence, values: Mapping[str, object] | None = None) -> Suitability:
    assert setup.footage is not None
    return BALL.video.suits(sequence, setup.footage, revise(setup.parameters, values or {}))


def painted(target: tuple[int, int, int], ground: tuple[int, int, int], count: int = 31) -> Pictures:
    """Return a disc of radius 15 px in the middle of a plain ground, with noise."""
    rng = np.random.default_rng(7)
    shown = []
    for _ in range(count):
        picture = np.full((120, 160, 3), ground, np.uint8)
        cv2.circle(picture, (80, 60), 15, target, -1)
        shown.append(np.clip(picture + rng.normal(0, 4, picture.shape), 0, 255).astype(np.uint8))
    return Pictures(shown)


DISC = Box.of(65, 45, 31, 31)


def test_a_colour_of_its_own_separates_well() -> None:
    """A red disc on grey needs no advice; its map is bright on the disc and dark around."""
    found = of(painted((200, 50, 50), (110, 110, 110)), DISC)
    assert found.grade == "well"
    assert found.value > 0.9
    assert found.sentences[0].startswith("Separates well: what is around the target is ")
    assert found.advice == ()
    assert found.likelihood.shape == (120, 160)
    assert found.likelihood[60, 80] > 0.5 > found.likelihood[10, 10]


def test_grey_on_grey_separates_not_at_all() -> None:
    """A dark disc on a lighter ground of the same chromaticity is told, and that no other box helps."""
    found = of(painted((60, 60, 60), (140, 140, 140)), DISC)
    assert found.grade == "not at all"
    assert "separates not at all" in found.remark
    assert "% of the rest of the picture looks like it" in found.remark
    assert any("follow colour alone" in said for said in found.advice)
    assert found.better is None


def test_a_part_that_stands_out_is_proposed() -> None:
    """Of a box around a grey thing with a red lamp on it, the box around the lamp is proposed, and is suitable."""
    sequence = painted((140, 140, 140), (140, 140, 140))
    shown = [sequence.picture(index).copy() for index in range(sequence.frame_count)]
    for picture in shown:
        picture[46:60, 66:80] = (220, 30, 30)
    sequence = Pictures(shown)
    found = of(sequence, DISC)
    assert found.grade != "well"
    assert isinstance(found.better, Box)
    assert "smaller box separates better" in found.advice[-1]
    assert of(sequence, found.better).value >= found.value + 0.15


def test_what_is_turned_counts() -> None:
    """It is asked of the likelihood in force: a high background level drowns the target, and the usual one is named."""
    sequence = painted((200, 50, 50), (110, 110, 110))
    found = of(sequence, DISC, values={"background_level": 1.0})
    assert found.grade == "no verdict"
    assert any("a background level of 0.02 separates better" in said for said in found.advice)


def test_another_colour_model_is_named_if_it_helps() -> None:
    """Green on blue of the same share of red is not told apart by redness, but by both shares."""
    sequence = painted((80, 160, 60), (80, 60, 160))
    found = of(sequence, DISC, values={"colour_model": "redness"})
    assert found.grade == "not at all"
    assert any("colour model 'chromaticity' separates better" in said for said in found.advice)


def test_a_large_picture_is_looked_at_in_part() -> None:
    """Six times as large, of which only every so-many-th pixel is looked at, the same picture has the same contrast."""
    small = painted((120, 100, 90), (110, 110, 110))
    shown = [np.repeat(np.repeat(small.picture(index), 6, axis=0), 6, axis=1) for index in range(9)]
    large = Pictures(shown, frame_rate_hz=8.0)
    one, other = of(small, DISC), of(large, Box.of(6 * 65, 6 * 45, 6 * 31, 6 * 31))
    assert other.value == pytest.approx(one.value, abs=0.05)
    assert max(other.likelihood.shape) <= 960


@pytest.mark.parametrize(
    ("value", "expected"), [(0.0, 0.0), (5.0, NOT_AT_ALL), (7.5, 0.45), (10.0, WELL), (20.0, 1.0), (90.0, 1.0)]
)
def test_more_is_better_up_to_twice_what_is_needed(value: float, expected: float) -> None:
    """The limits of the words lie where the quantity is unusable and usable."""
    assert grade(value, 5.0, 10.0) == pytest.approx(expected)


# ---------------------------------------------------------------- faces


def face(change: float = 1.0, shift: float = 0.0, scale: float = 1.0) -> Suitability:
    """Return how suitable a simulated face is, its grey levels changed, its picture made smaller."""
    shown = pictures(1, width=480)
    setup = HEAD.video.on_video(Pictures(shown), None)
    points = {name: np.array(place) for name, place in setup.footage.mark["points"].items()}
    changed = np.clip(np.rint(shift + change * shown[0].astype(float)), 0, 255).astype(np.uint8)
    small = cv2.resize(changed, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    placed = {name: tuple((places + 0.5) * scale - 0.5) for name, places in points.items()}
    footage = setup.footage.model_copy(update={"mark": FacePoints(points=placed).model_dump(mode="json")})
    return HEAD.video.suits(Pictures([small.astype(np.uint8)]), footage, setup.parameters)


def test_a_large_bright_face_is_followed_well() -> None:
    """It says how large it is, and has no advice."""
    found = face()
    assert found.grade == "well"
    assert "px apart" in found.remark
    assert found.advice == ()
    assert found.likelihood is None


@pytest.mark.parametrize(
    ("options", "grade", "said", "advice"),
    [
        ({"scale": 0.09}, "not at all", "px apart", "a larger face"),
        ({"change": 0.04}, "not at all", "too dark", "more light"),
        ({"change": 0.04, "shift": 240.0}, "not at all", "overexposed", "less light"),
        ({"change": 0.04, "shift": 120.0}, "not at all", "little contrast", "light from one side"),
        ({"change": 0.14, "shift": 100.0}, "poorly", "little contrast", "light from one side"),
    ],
)
def test_what_is_wrong_with_a_face_is_said(options: Mapping[str, float], grade: str, said: str, advice: str) -> None:
    """Too small, too dark, overexposed, flat: each with what would help."""
    found = face(**options)
    assert found.grade == grade
    assert said in found.remark
    assert any(advice in each for each in found.advice)


# ---------------------------------------------------------------- does it predict?


def simulated() -> Iterator[tuple[FrameSequence, int, Boxes]]:
    """Yield scenes whose ball differs from its ground by more and more, with noise and look-alikes at random."""
    rng = np.random.default_rng(2024)
    for scene in range(24):
        ground, direction = rng.uniform(60, 200, 3), rng.normal(size=3)
        colour = np.clip(ground + (3 + 2 * scene) * direction / np.linalg.norm(direction), 5, 250)
        parameters = BallSceneParameters(
            ball_colour=hexadecimal(colour),
            background_colour=hexadecimal(ground),
            ball_radius_px=float(rng.uniform(6, 14)),
            image_noise_sd=float(rng.uniform(2, 10)),
            occlusion_width_px=0,
            distracter_radius_px=float(rng.choice([0, 6, 8])),
            period_s=float(rng.uniform(1.5, 4)),
        )
        source, history = BallSource(500 + scene, parameters), History(((0, parameters),))
        frames = [source.frame(index, history) for index in range(60)]
        r = parameters.ball_radius_px
        boxes = {f.index: (*(f.target.position - r + 0.5).tolist(), 2 * r, 2 * r) for f in frames if f.target}
        shown: list[Picture] = [frame.image_rgb for frame in frames if frame.image_rgb is not None]
        yield Pictures(shown), 0, boxes


def hexadecimal(colour: np.ndarray[tuple[int], np.dtype[np.float64]]) -> str:
    return "#{:02x}{:02x}{:02x}".format(*colour.astype(int))


def followed(sequence: FrameSequence, start: int, boxes: Boxes) -> tuple[float, float]:
    """Return how suitable a target is, and what share of the frames the tracker is inside its box."""
    setup = BALL.video.on_video(sequence, Box.of(*boxes[start]), start=start, truth=TruthTable(boxes))
    inside = []
    for seed in range(3):
        run = Run(BALL, setup, seed=seed)
        run.finish()
        inside.append(run.summary().measures["inside_share"])
    return looked_at(setup, sequence).value, float(np.mean(inside))


@pytest.mark.slow
@pytest.mark.skipif(not CLIPS.exists(), reason="the sample clips are not beside this checkout")
def test_on_real_clips_what_it_says_comes_true(monkeypatch: pytest.MonkeyPatch) -> None:
    """By colour no start that separates well is lost, and each that does not is; of a window there is no verdict."""
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    study = runpy.run_path(str(ROOT / "benchmarks" / "suitability.py"))
    for _, name, clip, boxes in study["targets"]():
        ball, window = (study["measure"](one, name, clip, boxes, starts=2, follow=40) for one in (BALL, HISTOGRAM))
        assert ball["lost"] == {"well": 0, "not at all": ball["starts"]}[ball["said"]]
        assert window["said"] == "no verdict"


def by_window(sequence: FrameSequence, box: Box) -> Suitability:
    """Return how suitable the target in a box is for the trackers by colour histograms."""
    setup = HISTOGRAM.video.on_video(sequence, box)
    assert setup.footage is not None
    return HISTOGRAM.video.suits(sequence, setup.footage, setup.parameters)


def test_a_window_is_compared_with_those_around_it() -> None:
    """Of a red disc on grey the map is brightest there; that does not tell whether it is lost, and it says so."""
    found = by_window(painted((200, 50, 50), (110, 110, 110)), DISC)
    assert found.grade == "no verdict"
    assert found.value > 0.9
    assert "is not informative for this tracker" in found.remark
    assert found.advice == ()
    step = 120 / len(found.likelihood)
    assert np.unravel_index(int(found.likelihood.argmax()), found.likelihood.shape) == pytest.approx(
        (60 / step, 80 / step), abs=1.0
    )


def test_a_window_of_the_grounds_colours_is_told() -> None:
    """A box on plain ground separates not at all, and no other way of counting helps."""
    found = by_window(painted((200, 50, 50), (110, 110, 110)), Box.of(10, 10, 31, 31))
    assert found.grade == "not at all"
    assert found.advice[0].startswith("no other way of counting separates better")
