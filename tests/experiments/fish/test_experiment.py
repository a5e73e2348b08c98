"""The experiment on a fish: recordings, what counts as lost, and the worlds of what was learned."""

from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.marks import Mark
from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.recipe import Change
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, FrameSequence, Target
from pftrack.experiments import find
from pftrack.experiments.fish.model import FishShape, body_points, tail_corners, tail_line
from pftrack.experiments.fish.parameters import GUIDANCE
from pftrack.experiments.fish.scene import FishBody, FishTarget, RecordedFishParameters, _appearance
from pftrack.experiments.fish.trackers import begin_at
from pftrack.runs.loss import judge_state
from pftrack.runs.run import Run
from pftrack.sources.sequence import open_sequence
from pftrack.sources.truth import TruthTable
from pftrack.vision.film import FilmWriter
from tests.making import whole_run

FISH = find("fish")
SHAPE = FishShape(24.0, 10.0, 28.0)
WATER, ORANGE, DARK = (110, 125, 140), (235, 105, 40), (60, 68, 75)
FRAMES = 8


def pose(frame: int) -> NDArray[np.float64]:
    return np.array([100.0 + 2.5 * frame, 90.0, 0.1 + 0.02 * frame, 0.3])


def film(path: Path, colour: tuple[int, int, int]) -> FrameSequence:
    with FilmWriter(path, 15.0) as writer:
        for frame in range(FRAMES):
            picture = np.full((180, 240, 3), WATER, np.uint8)
            for corners in (body_points(pose(frame), SHAPE, 60), tail_corners(pose(frame), SHAPE)):
                cv2.fillPoly(picture, [np.rint(corners).astype(np.int32)], colour)
            writer.write(picture)
    return open_sequence(path)


@pytest.fixture(scope="module")
def films(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, FrameSequence]]:
    folder = tmp_path_factory.mktemp("films")
    opened = {name: film(folder / f"{name}.mp4", colour) for name, colour in (("orange", ORANGE), ("dark", DARK))}
    yield opened
    for sequence in opened.values():
        sequence.close()


def mark(**changes: object) -> Mark:
    target = FishTarget.of(pose(0), SHAPE, np.zeros(2))
    made = FISH.video.marks[0].of_target(target)
    return FISH.video.mark({**made.model_dump(mode="json"), **changes})


def wired(sequence: FrameSequence, truth: TruthTable | None = None) -> Setup:
    return FISH.video.on_video(sequence, mark(), truth=truth)


@pytest.mark.parametrize(("name", "told"), [("orange", "colour"), ("dark", "dark")])
def test_a_recording_is_followed_by_colour_or_by_darkness(
    films: dict[str, FrameSequence], name: str, told: str
) -> None:
    """The mark gives shape and scale; a colourful fish is told by its hues, another by being darker than the water."""
    setup = wired(films[name])
    parameters = setup.parameters
    assert parameters.foreground == told
    lengths = (parameters.half_length_px, parameters.tail_length_px, parameters.sigma_d_px2)
    assert lengths == pytest.approx((24.0, 28.0, 25.0 * 0.36))
    step = Run(FISH, setup, tracker="guided", seed=0).finish()
    assert np.hypot(*(step.state.estimate - pose(FRAMES - 1)[:2])) < 5.0


def test_a_form_says_whether_the_fish_stands_out(films: dict[str, FrameSequence]) -> None:
    """The fish itself is well suited; with thresholds that nothing meets it is not at all, and it is said why."""
    setup = wired(films["orange"])
    nothing = revise(setup.parameters, {"lowest_hue": 90, "highest_hue": 91})
    good, bad = (FISH.video.suits(films["orange"], setup.footage, it) for it in (setup.parameters, nothing))
    assert (good.grade, bad.grade) == ("well", "not at all")
    assert not good.advice
    assert "0 % of the body is told from the water by its colour" in bad.remark
    assert bad.remark.endswith("the outline is partly 63 px or more from any edge")
    assert bad.advice[0].startswith("widen the range of hues")


def test_a_fish_of_most_of_the_picture_is_taken(tmp_path: Path) -> None:
    """The tolerance of edges grows with the fish as far as it can be set."""
    with FilmWriter(tmp_path / "large.mp4", 15.0) as writer:
        writer.write(np.full((80, 400, 3), WATER, np.uint8))
    with closing(open_sequence(tmp_path / "large.mp4")) as sequence:
        large = mark(head=[390.0, 40.0], root=[10.0, 40.0], tip=[1.0, 40.0])
        assert FISH.video.on_video(sequence, large).parameters.sigma_d_px2 == 400.0


def measured(truth: tuple[float, float], estimate: tuple[float, float]) -> Mapping[str, object]:
    """Return what is measured of a heading and a bend, rad."""
    target = FishTarget.of(np.array([100.0, 100.0, *truth]), FishShape(40.0, 10.0, 40.0), np.zeros(2))
    state = replace(begin_at(target, 10), mean=np.array([100.0, 100.0, 0.0, 0.0, *estimate]))
    return FISH.measured.measure(Frame(0, 0.0, target=target), state)  # type: ignore[misc]


def test_a_bend_is_off_by_half_a_turn_at_most() -> None:
    """A bend that is not limited may go round: what counts is how far apart the two tails are."""
    found = measured((0.0, 0.5), (0.0, 0.5 - np.deg2rad(233.0)))
    assert found["bend_error"] == pytest.approx(127.0)


def test_the_true_heading_is_beside_the_estimated_one() -> None:
    """A heading of 179 degrees is 3 from one of -178, in the plot as well, which has both in one band."""
    found = measured((np.deg2rad(179.0), 0.0), (np.deg2rad(-178.0), 0.0))
    assert (found["heading_error"], found["true_heading"]) == pytest.approx((3.0, -181.0))


def test_lost_is_outside_the_silhouette_and_on_a_recording_outside_the_box() -> None:
    """A point beside the body within its box is lost in the tank; on a recording the box decides."""
    fish = FishTarget.of(np.array([100.0, 100.0, np.pi / 4, 0.0]), FishShape(40.0, 10.0, 40.0), np.zeros(2))
    box, place, recorded = Target(fish.position, fish.size, extent=fish.extent), fish.position, RecordedFishParameters()
    for (x, y), target, parameters, lost in (
        ((120.0, 80.0), fish, None, True),
        ((109.0, 91.0), fish, None, True),  # within a goldfish of 15 px half width, beside this one
        ((120.0, 120.0), fish, None, False),
        ((120.0, 80.0), box, recorded, False),
        ((140.0, 100.0), box, recorded, True),
        ((np.nan, 100.0), box, recorded, True),
        ((140.0, 100.0), Target(place), recorded, False),
    ):
        moved = replace(begin_at(fish, 1), mean=np.array([x, y, 0.0, 0.0, 0.0, 0.0]))
        assert bool(judge_state(FISH, moved, target, parameters)[1]) == lost


def test_the_verdict_is_by_the_silhouette(films: dict[str, FrameSequence]) -> None:
    """In the tank one frame outside the fish is no success; on a recording a quarter of the frames may miss the box."""
    run = whole_run(FISH, values={"highest_hue": 3, "value_low": 255}, tracker="guided", frames=4)
    for row in run.diagnostics:
        target = run.source.frame(row.frame, run.timeline.history).target
        assert row.lost != target.holds(np.array(row.estimate))
    boxes = {frame: (*(pose(frame)[:2] - 20), 41.0, 41.0) for frame in range(FRAMES)}
    recorded = Run(FISH, wired(films["orange"], TruthTable(boxes)), tracker="guided")
    recorded.finish()
    summary = recorded.summary()
    assert (summary.verdict.success, summary.verdict.lost_frames, summary.measures["inside_share"]) == (True, 0, 1.0)


def drawn(frames: int, **values: Value) -> dict[str, Any]:
    run = Run(FISH, FISH.simulate(), frames=3, timeline=(Change(0, values),))
    return dict(FISH.draw(run.seek(frames - 1), run.diagnostics).worlds[0].primitives)


@pytest.mark.parametrize("mode", [1, 2, 3, 4])
def test_the_ghost_moves_along_the_mode(mode: int) -> None:
    """Its tail is that of a fish at rest, head upwards, after so many deviations along the eigenvector."""
    diffusion = GUIDANCE.parse("").diffusion("document")
    change = 1.5 * np.sqrt(diffusion.eigenvalues[mode - 1]) * diffusion.modes[:, mode - 1]
    theta = -np.pi / 2 + change[2]
    place = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]]) @ change[:2]
    tail = drawn(3, mode_sways=False, shown_mode=mode, along_mode=1.5)["ghost tail"]
    expected = tail_line(np.array([*place, theta, change[3]]), FishShape(40.0, 15.0, 40.0))
    assert tail.positions[:, :2] == pytest.approx(expected, abs=1e-4)


def test_the_ghost_can_be_dragged_before_anything_is_played() -> None:
    """It sways from where it is dragged to: in frame 0 it is there."""
    assert drawn(1, shown_mode=3, along_mode=1)["label"].text == "turn -8°, bend +11°"


def test_a_fish_that_fills_the_picture_is_told_by_its_colour() -> None:
    """Where nothing is around it, nothing around it is alike."""
    image = np.full((20, 40, 3), (235, 105, 40), np.uint8)
    fish = FishBody(head=(39.0, 10.0), root=(0.0, 10.0), tip=(0.0, 10.0), half_width=20.0)
    assert _appearance(image, fish.target)["foreground"] == "colour"
