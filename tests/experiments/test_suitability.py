"""Suitability: before tracking, a target is rated in words, with advice."""

import runpy
from collections.abc import Mapping

import cv2
import numpy as np
import pytest

from pftrack.core.model.marks import Box
from pftrack.core.model.parameters import revise
from pftrack.core.model.setup import Suitability
from pftrack.core.model.source import FrameSequence
from pftrack.experiments import find
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.head.recording import FacePoints
from tests.experiments.head.heads import Pictures, pictures
from tests.installing import ROOT

BALL, HEAD, HISTOGRAM = find("ball"), find("head"), find("histogram")
GREY = (110, 110, 110)
CLIPS = ROOT / ".." / "shared" / "data"


def of(sequence: FrameSequence, box: Box, experiment: Experiment = BALL, **values: object) -> Suitability:
    """Return the suitability of the target in a box for the trackers of a ball, or of another experiment."""
    setup = experiment.video.on_video(sequence, box)
    return experiment.video.suits(sequence, setup.footage, revise(setup.parameters, values))


def painted(target: tuple[int, int, int], ground: tuple[int, int, int] = GREY, count: int = 31) -> Pictures:
    """Return a disc of radius 15 px in the middle of a plain ground, with noise."""
    plain = cv2.circle(np.full((120, 160, 3), ground, np.uint8), (80, 60), 15, target, -1)
    rng = np.random.default_rng(7)
    return Pictures([np.clip(plain + rng.normal(0, 4, plain.shape), 0, 255).astype(np.uint8) for _ in range(count)])


DISC, RED = Box.of(65, 45, 31, 31), (200, 50, 50)


def test_a_red_disc_on_grey_separates_well() -> None:
    """It needs no advice; the map of the likelihood is bright on the disc and dark around it."""
    found = of(painted(RED), DISC)
    assert (found.grade, found.advice) == ("well", ())
    assert found.value > 0.9
    assert found.sentences[0].startswith("Separates well: what is around the target is ")
    assert found.likelihood.shape == (120, 160)
    assert found.likelihood[60, 80] > 0.5 > found.likelihood[10, 10]


def test_grey_on_grey_separates_not_at_all() -> None:
    """A disc that only differs in brightness is rated so, and no better box is proposed."""
    found = of(painted((60, 60, 60), (140, 140, 140)), DISC)
    assert (found.grade, found.better) == ("not at all", None)
    assert "separates not at all" in found.remark
    assert "% of the rest of the picture looks like it" in found.remark
    assert any("follow colour alone" in said for said in found.advice)


def test_a_part_that_stands_out_is_proposed() -> None:
    """For a grey object with a red lamp the box around the lamp is proposed, and separates better."""
    plain = painted((140, 140, 140), (140, 140, 140))
    shown = [plain.picture(index).copy() for index in range(plain.frame_count)]
    for picture in shown:
        picture[46:60, 66:80] = (220, 30, 30)
    found = of(Pictures(shown), DISC)
    assert found.grade != "well"
    assert isinstance(found.better, Box)
    assert "smaller box separates better" in found.advice[-1]
    assert of(Pictures(shown), found.better).value >= found.value + 0.15


def test_the_present_parameters_count() -> None:
    """A high background level drowns a red disc, and the advice names a better one."""
    found = of(painted(RED), DISC, background_level=1.0)
    assert found.grade == "no verdict"
    assert "a background level of 0.02 separates better" in " ".join(found.advice)
    other = of(painted((80, 160, 60), (80, 60, 160)), DISC, colour_model="redness")
    assert other.grade == "not at all"
    assert "colour model 'chromaticity' separates better" in " ".join(other.advice)


def test_a_large_picture_is_sampled() -> None:
    """A picture six times as large has the same contrast, computed from some of its pixels."""
    small = painted((120, 100, 90), count=9)
    shown = [np.repeat(np.repeat(small.picture(index), 6, axis=0), 6, axis=1) for index in range(9)]
    large = Pictures(shown, frame_rate_hz=8.0)
    one, other = of(small, DISC), of(large, Box.of(6 * 65, 6 * 45, 6 * 31, 6 * 31))
    assert other.value == pytest.approx(one.value, abs=0.05)
    assert max(other.likelihood.shape) <= 960


# ---------------------------------------------------------------- faces


def face(change: float = 1.0, shift: float = 0.0, scale: float = 1.0) -> Suitability:
    """Return the suitability of a simulated face with changed grey levels and size."""
    shown = pictures(1, width=480)
    setup = HEAD.video.on_video(Pictures(shown), None)
    points = {name: np.array(place) for name, place in setup.footage.mark["points"].items()}
    changed = np.clip(np.rint(shift + change * shown[0].astype(float)), 0, 255).astype(np.uint8)
    small = cv2.resize(changed, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    placed = {name: tuple((places + 0.5) * scale - 0.5) for name, places in points.items()}
    footage = setup.footage.model_copy(update={"mark": FacePoints(points=placed).model_dump(mode="json")})
    return HEAD.video.suits(Pictures([small.astype(np.uint8)]), footage, setup.parameters)


@pytest.mark.parametrize(
    ("options", "grade", "said", "advice"),
    [
        ({}, "well", "px apart", ""),
        ({"scale": 0.09}, "not at all", "px apart", "a larger face"),
        ({"change": 0.04}, "not at all", "too dark", "more light"),
        ({"change": 0.04, "shift": 240.0}, "not at all", "overexposed", "less light"),
        ({"change": 0.04, "shift": 120.0}, "not at all", "little contrast", "light from one side"),
        ({"change": 0.14, "shift": 100.0}, "poorly", "little contrast", "light from one side"),
    ],
)
def test_a_face_is_rated_in_words(options: Mapping[str, float], grade: str, said: str, advice: str) -> None:
    """A large bright face needs no advice; a small, dark, overexposed or flat one gets some."""
    found = face(**options)
    assert (found.grade, found.likelihood) == (grade, None)
    assert said in found.remark
    assert advice in " ".join(found.advice)
    assert bool(advice) == bool(found.advice)


@pytest.mark.slow
@pytest.mark.skipif(not CLIPS.exists(), reason="the sample clips are not beside this checkout")
def test_the_rating_predicts_losses_on_real_clips(monkeypatch: pytest.MonkeyPatch) -> None:
    """By colour no start rated "well" is lost and each rated "not at all" is; a window has no verdict."""
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    study = runpy.run_path(str(ROOT / "benchmarks" / "suitability.py"))
    for _, name, clip, boxes in study["targets"]():
        ball, window = (study["measure"](one, name, clip, boxes, starts=2, follow=40) for one in (BALL, HISTOGRAM))
        assert ball["lost"] == {"well": 0, "not at all": ball["starts"]}[ball["said"]]
        assert window["said"] == "no verdict"


def test_a_window_is_compared_with_those_around_it() -> None:
    """The map of a red disc on grey is brightest there; the remark adds that it does not predict a loss."""
    found = of(painted(RED), DISC, experiment=HISTOGRAM)
    assert (found.grade, found.advice) == ("no verdict", ())
    assert found.value > 0.9
    assert "is not informative for this tracker" in found.remark
    step = 120 / len(found.likelihood)
    top = np.unravel_index(int(found.likelihood.argmax()), found.likelihood.shape)
    assert top == pytest.approx((60 / step, 80 / step), abs=1.0)


def test_a_window_on_plain_ground_separates_not_at_all() -> None:
    """Its advice is that no other way of counting helps."""
    found = of(painted(RED), Box.of(10, 10, 31, 31), experiment=HISTOGRAM)
    assert found.grade == "not at all"
    assert found.advice[0].startswith("no other way of counting separates better")
