"""A recording of a ball: what its box sets, how it is followed, and what is drawn over it."""

from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from pftrack.core.model.marks import Box
from pftrack.core.model.recipe import Change
from pftrack.core.model.source import FrameSequence
from pftrack.experiments import find
from pftrack.runs.run import Run
from pftrack.sources.truth import TruthTable
from tests.experiments.head.heads import Pictures
from tests.making import whole_run

BALL = find("ball")


def centre(index: int) -> tuple[int, int]:
    return 30 + 6 * index, 60 + round(20 * np.sin(index / 4))


@pytest.fixture(scope="module")
def clip() -> FrameSequence:
    """Forty pictures of a green disc that wanders to the right over grey noise."""
    shown = np.random.default_rng(0).normal(120, 4, size=(40, 120, 320, 3)).astype(np.uint8)
    for index, image in enumerate(shown):
        cv2.circle(image, centre(index), 9, (70, 190, 60), -1)
    return Pictures(list(shown))


def box(index: int) -> Box:
    u, v = centre(index)
    return Box.of(u - 9.0, v - 9.0, 19.0, 19.0)


def test_colour_and_lengths_come_from_the_box(clip: FrameSequence) -> None:
    """The setup of a recording fits the colour to the box and scales thresholds and noise to its size."""
    parameters = BALL.video.on_video(clip, box(3), start=3).parameters
    assert parameters.colour_model == "chromaticity"
    assert parameters.target_green_share == pytest.approx(190 / 320, abs=0.01)
    assert parameters.gamma_px == 9.5
    assert parameters.distracter_colour == "#46be3c"


def test_surroundings_have_no_likelihood_beyond_the_picture(clip: FrameSequence) -> None:
    """On the disc they are far less likely than the disc; an estimate that has left the picture has none."""
    setup = BALL.video.on_video(clip, box(3), start=3)
    run = Run(BALL, setup, seed=1)
    places = (centre(3), (-200.0, 60.0), (600.0, 60.0), (160.0, -200.0))
    on_disc, *beyond = (
        setup.beside(run.current.frame, SimpleNamespace(estimate=np.array(place)), setup.parameters) for place in places
    )
    assert on_disc < 0.1
    assert np.isnan(beyond).all()


def summary_of(clip: FrameSequence, beside_px: float | None, tracker: str | None = None) -> dict[str, Any]:
    """Return what comes of a run from picture 5 on, whose truth lies beside the disc or is unknown."""
    boxes = {
        index: (u + (beside_px or 0.0), v, w, h) for index in range(40) for u, v, w, h in [box(index).corner_and_size]
    }
    truth = None if beside_px is None else TruthTable(boxes)
    setup = BALL.video.on_video(clip, box(5), start=5, truth=truth)
    return whole_run(BALL, setup, tracker=tracker, seed=1).summary().as_dict()


@pytest.mark.parametrize("tracker", BALL.trackers)
def test_every_tracker_follows_the_disc(clip: FrameSequence, tracker: str) -> None:
    """From a box on any picture, each tracker follows the disc to the end."""
    summary = summary_of(clip, 0.0, tracker)
    assert summary["frames"] == summary["labelled_frames"] == 35
    assert (summary["success"], summary["success_measure"]) == (True, "inside_share")
    assert summary["hit_rate"] == summary["inside_share"] > 0.9


def test_beside_the_box_is_no_success(clip: FrameSequence) -> None:
    """A truth that lies beside what is followed, however near, is lost: the target is held inside its true box.

    Where the truth is unknown there is no error, no loss and no verdict.
    """
    beside, unknown = summary_of(clip, 12.0), summary_of(clip, None)
    assert beside["hit_rate"] == beside["inside_share"] < 0.2
    assert beside["success"] is False
    assert {unknown[key] for key in ("success", "mean_error_px", "lost_frames", "hit_rate")} == {None}
    assert unknown["labelled_frames"] == 0


def test_overlay_is_worn_live(clip: FrameSequence) -> None:
    """The strip and the look-alikes appear where and when they are asked for; the clip itself is not changed.

    Time counts from the first picture used, by the recording's own clock.
    """
    changes = (Change(3, {"occlusion_width_px": 40, "occlusion_offset_px": -60, "distracter_radius_px": 5}),)
    run = Run(BALL, BALL.video.on_video(clip, box(4), start=4), seed=1, frames=6, timeline=changes)
    frames = [step.frame for step in run]
    pictures = [frame.image_rgb for frame in frames]
    same = [np.array_equal(image, clip.picture(index)) for index, image in enumerate(pictures, 4)]
    assert same == [True] * 3 + [False] * 3
    assert [frame.time_s for frame in frames] == pytest.approx(clip.times_s[4:10] - clip.times_s[4])
    assert (pictures[4][:, 80:120] == 60).all()
    assert not (pictures[4][:, 79] == 60).all()
