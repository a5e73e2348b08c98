"""A hand on recordings: found or marked, and refused in words."""

from contextlib import closing
from pathlib import Path

import cv2
import numpy as np
import pytest

from pftrack.core.model.drawing import COLOURS
from pftrack.core.model.parameters import Value
from pftrack.core.model.setup import Setup, Suitability
from pftrack.core.model.source import FrameSequence
from pftrack.core.model.tracker import Step
from pftrack.experiments import find
from pftrack.experiments.hand.recording import HandTips
from pftrack.runs.run import Run
from pftrack.sources.sequence import open_sequence
from tests.experiments.hand.seen import simulated
from tests.experiments.head.heads import Pictures
from tests.making import whole_run

HAND = find("hand")
FRAMES = 5
CLIP = Path(__file__).parents[3] / ".." / "shared" / "data" / "hand_silhouette" / "img"


def pictures(speed: float = 1.5) -> list[np.ndarray]:
    return [simulated(frame, 1, motion="occlusion", speed=speed).image_rgb for frame in range(FRAMES)]


@pytest.fixture(scope="module")
def clip() -> FrameSequence:
    return Pictures(pictures(), frame_rate_hz=10.0)


def wired(sequence: FrameSequence, mark: HandTips | None = None, start: int = 0) -> Setup:
    return HAND.video.on_video(sequence, mark, start=start)


def suits(sequence: FrameSequence, setup: Setup, **values: Value) -> Suitability:
    assert setup.footage is not None
    return HAND.video.suits(sequence, setup.footage, setup.parameters.model_copy(update=values))


def error(step: Step) -> float:
    """Return the mean distance of the tips from the true ones of the last frame, palm axes."""
    truth = simulated(FRAMES - 1, 1, motion="occlusion", speed=1.5).target
    return float(np.hypot(*(step.state.estimate.reshape(5, 3)[:, :2] - truth.tips).T).mean() / truth.scale)


def test_an_open_hand_is_found_and_followed_without_marks(clip: FrameSequence) -> None:
    """The folding fingers are followed; a run from the stored mark gives the same numbers."""
    setup = wired(clip)
    run = Run(HAND, setup, seed=0)
    assert error(run.finish()) < 0.2
    assert len(run.diagnostics) == FRAMES
    again = whole_run(HAND, wired(clip, HandTips.read(setup.footage.mark)), seed=0)
    assert again.estimates_sha256 == run.estimates_sha256


def test_folded_fingers_are_proposed_and_not_started_with(clip: FrameSequence) -> None:
    """A guess that nobody confirms does not start a run, though a form shows it."""
    [proposed] = HAND.video.finder.search(clip, [FRAMES - 1])
    assert proposed.mark is not None
    assert proposed.placed
    with pytest.raises(ValueError, match=r"hold up an open hand.*or mark the tips"):
        wired(clip, start=FRAMES - 1)


def test_a_form_says_how_well_the_hand_covers_what_is_seen(clip: FrameSequence) -> None:
    """A detected hand suits well; above a level that no pixel exceeds, none is seen.

    Tips marked in the wrong order do not suit, and a thumb marked on the other side makes it the other hand.
    """
    setup = wired(clip)
    good, bad = suits(clip, setup), suits(clip, setup, brightness_level=254)
    assert (good.grade, bad.grade) == ("well", "not at all")
    assert good.remark.startswith("5 fingers are seen")
    assert "nothing in the picture is classified as a hand" in bad.remark
    tips = HandTips.read(setup.footage.mark).tips
    exchanged = suits(clip, wired(clip, HandTips.of(tips[[0, 2, 1, 4, 3]])))
    assert exchanged.grade != "well"
    assert "palms from its mark" in exchanged.remark
    swapped = wired(clip, HandTips.of(tips[::-1].copy()))
    assert [one.open_source(0, one.parameters).start.model.side for one in (setup, swapped)] == [1.0, -1.0]  # type: ignore[attr-defined]


def blank(value: int, size: int = 200) -> np.ndarray:
    return np.full((size, size, 3), value, np.uint8)


def test_other_pictures_are_refused_in_words() -> None:
    """The refusal and the finder's remark give the reason."""
    picture = blank(10)
    for place in ((55, 100), (145, 100)):
        cv2.circle(picture, place, 40, (220, 180, 150), -1)
    sequence = Pictures([picture] * 2)
    with pytest.raises(ValueError, match="two regions of similar size"):
        wired(sequence)
    (seen,) = HAND.video.finder.search(sequence, [0])
    assert seen.mark is None
    assert "two regions of similar size" in seen.remarks[0]


def test_a_flash_and_an_empty_picture_are_waited_out() -> None:
    """While no hand is visible the estimate stays; the run's events and the caption give the reason."""
    shown = pictures(speed=0.25)
    run = Run(HAND, wired(Pictures([shown[0], blank(255), shown[2], blank(0), shown[4]])), seed=0)
    steps = list(run)
    names = [[name for name in ("flash", "no_hand") if row.number(name)] for row in run.diagnostics]
    assert names == [[], ["flash"], [], ["no_hand"], []]
    assert [row.searching for row in run.diagnostics] == [bool(events) for events in names]
    assert np.array_equal(steps[1].state.pose, steps[0].state.pose)
    seen, waited = (HAND.draw(step, run.diagnostics) for step in steps[:2])
    assert "flash of light" in waited.caption
    assert "grey: the hand seen last" in waited.caption
    assert seen.primitives["outline"].colour == COLOURS["estimate"]
    assert waited.primitives["outline"].colour == COLOURS["hidden"]


@pytest.mark.skipif(not CLIP.exists(), reason="the sample clips are not beside this checkout")
def test_a_real_hand_with_two_raised_fingers_is_proposed_and_followed() -> None:
    """It does not start automatically; the proposed tips suit, their reversal does not, and tracking succeeds."""
    with closing(open_sequence(CLIP)) as sequence:
        with pytest.raises(ValueError, match="2 fingers are seen"):
            wired(sequence, start=299)
        for start in (79, 0):
            (guess,) = HAND.video.finder.search(sequence, [start])
            turned = HandTips.of(guess.mark.tips[::-1].copy())
            right, wrong = (suits(sequence, wired(sequence, mark, start)) for mark in (guess.mark, turned))
            assert right.grade == "well" != wrong.grade
            assert wrong.better == guess.mark
        assert not guess.sure
        assert set(guess.placed) == {"points.thumb", "points.ring", "points.little"}
        run = whole_run(HAND, wired(sequence, guess.mark), seed=0, frames=6)
    assert all(row.number("difference") < 25.0 for row in run.diagnostics[1:])


def test_a_hand_before_a_textured_wall_is_told_by_its_backdrop() -> None:
    """It is followed where neither level, border nor skin separates it; seek and branch give the same numbers."""
    shade = np.random.default_rng(1).uniform(0.1, 1.1, (25, 25)).astype(np.float32)  # boards with the colours of skin
    shade = cv2.resize(shade, (200, 200), interpolation=cv2.INTER_NEAREST)
    wall = (shade[..., None] * np.array([150.0, 105.0, 75.0])).astype(np.uint8)
    shown = [np.where((picture > 60).any(axis=2)[..., None], picture, wall) for picture in pictures()]
    sequence = Pictures([wall] * 4 + shown)
    setup = wired(sequence)
    assert setup.footage.start == setup.parameters.backdrop_frames == 4
    assert setup.parameters.tells_by == "backdrop"
    run = Run(HAND, setup, seed=0)
    assert error(run.finish()) < 0.2
    assert np.array_equal(run.seek(2).state.pose, Run(HAND, wired(sequence), seed=0, frames=3).finish().state.pose)
    branch = run.branch(2, {})
    branch.finish()
    assert branch.estimates_sha256 == run.estimates_sha256
    assert suits(sequence, setup, tells_by="background").grade == "not at all"
