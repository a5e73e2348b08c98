"""The experiment on a fish: its trackers, recordings, losses, and the worlds of what was learned."""

import json
from dataclasses import replace
from functools import cache
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.marks import Mark
from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, FrameSequence, History, Target
from pftrack.core.numerics.compiled import read_only
from pftrack.core.refusal import ParameterError
from pftrack.experiments import find
from pftrack.experiments.fish.model import Edges, FishShape, FishState, body_points, find_edges, tail_corners, tail_line
from pftrack.experiments.fish.parameters import GUIDANCE
from pftrack.experiments.fish.scene import FishBody, FishSource, FishTarget, RecordedFishParameters, _appearance
from pftrack.experiments.fish.trackers import TRACKERS, begin_at, draw, step_frame
from pftrack.filters.learning.charts import body_velocity
from pftrack.filters.particles import ParticleSet
from pftrack.runs.loss import judge_state
from pftrack.runs.run import Run
from tests.experiments.head.heads import Pictures
from tests.making import whole_run

FISH = find("fish")
DEFAULTS = FISH.simulate().parameters
GUIDED_SD = GUIDANCE.parse("").diffusion("document").sd[2]


@cache
def seen(frame: int) -> Edges:
    history = History(((0, DEFAULTS),))
    return find_edges(FishSource(0, DEFAULTS).frame(frame, history), DEFAULTS)


def target(frame: int) -> FishTarget:
    return FishSource(0, DEFAULTS).target(frame, DEFAULTS)


@pytest.mark.parametrize("tracker", TRACKERS)
def test_the_fish_is_followed(tracker: str) -> None:
    """For two thirds of a second each tracker is within the fish, its heading and bend near the truth."""
    state, true, parameters = begin_at(target(0), 1000), target(10), revise(DEFAULTS, {"sample_count": 1000})
    for frame in range(1, 11):
        state = step_frame(tracker, state, seen(frame), parameters, 7, frame)
    assert true.holds(state.estimate)
    assert np.hypot(*(state.estimate - true.position)) < 6.0
    assert abs(np.remainder(state.mean[4] - true.theta + np.pi, 2 * np.pi) - np.pi) < 0.25
    assert state.distance < 8.0


def test_all_begin_at_the_truth_with_its_velocity() -> None:
    """Every particle is at the pose of frame 0, with the first frame's velocity in the body's frame."""
    begin, first = target(0), target(1)
    state = begin_at(begin, 5)
    velocity = body_velocity(first.position - begin.position, begin.theta)
    assert state.particles.states[:, :2] == pytest.approx(np.tile(begin.position, (5, 1)))
    assert state.particles.states[:, 2:4] == pytest.approx(np.tile(velocity, (5, 1)))
    assert np.cos(state.mean[4] - begin.theta) == pytest.approx(1.0)


def without_edges(state: FishState, tracker: str, **values: object) -> FishState:
    """A step in which all particles weigh the same."""
    parameters = revise(DEFAULTS, {"sample_count": 40_000, "bend_limited": False, **values})
    blank = seen(1)._replace(distances=read_only(np.zeros_like(seen(1).distances)))
    return step_frame(tracker, state, blank, parameters, 3, 1)


@pytest.mark.parametrize(
    ("steps", "mean", "within", "sd"),
    [
        ("learned", GUIDANCE.parse("").step_mean, 0.1, GUIDANCE.parse("").step_sd),
        ("wide", np.zeros(4), 0.6, [30.0, 30.0, np.pi / 4, np.pi / 4]),
    ],
)
def test_the_ordinary_filter_draws_its_steps(steps: str, mean: Any, within: float, sd: Any) -> None:
    """Steps of place, heading and bend have the learned mean and deviation (eq. 8), or wide ones."""
    begin = begin_at(target(0), 10)
    after = without_edges(begin, "ordinary", walk_steps=steps).particles.states[:, [0, 1, 4, 5]] - begin.pose
    assert after.mean(axis=0) == pytest.approx(mean, abs=within)
    assert after.std(axis=0) == pytest.approx(sd, rel=0.02)


@pytest.mark.parametrize("correlated", [True, False])
def test_the_guided_filter_draws_the_learned_changes(correlated: bool) -> None:
    """Changes of velocity in the body's frame, heading and bend have the learned covariance (eqs 16 and 18)."""
    begin = begin_at(target(0), 10)
    state = without_edges(begin, "guided", correlated_changes=correlated)
    changes = state.particles.states[:, 2:] - begin.mean[2:]
    wanted = GUIDANCE.parse("").diffusion("document", correlated=correlated).covariance
    sd = np.sqrt(np.diagonal(wanted))
    assert changes.mean(axis=0) / sd == pytest.approx(np.zeros(4), abs=0.02)
    assert np.cov(changes.T) / np.outer(sd, sd) == pytest.approx(wanted / np.outer(sd, sd), abs=0.02)
    assert state.changes[:, 0] == pytest.approx(changes[:, 1])


def test_the_new_velocity_moves_the_place_in_the_new_direction() -> None:
    """Eq. 17 holds for every particle of the guided filter, and the ordinary filter's velocity is its own step."""
    begin = begin_at(target(0), 10)
    for tracker in TRACKERS:
        states = without_edges(begin, tracker, sample_count=500).particles.states
        along, across, cosine, sine = states[:, 2], states[:, 3], np.cos(states[:, 4]), np.sin(states[:, 4])
        expected = np.column_stack([cosine * along - sine * across, sine * along + cosine * across])
        assert states[:, :2] - begin.mean[:2] == pytest.approx(expected, abs=1e-9)


def test_constant_velocity_keeps_the_velocity_in_the_picture() -> None:
    """Whatever the body turns, the mean step is that of the frame before (eq. 9)."""
    begin = begin_at(target(0), 10)
    states = without_edges(begin, "constant-velocity").particles.states
    assert (states[:, :2] - begin.mean[:2]).mean(axis=0) == pytest.approx(target(0).velocity, abs=0.1)


def test_lengths_go_with_the_body() -> None:
    """For a fish of half the size steps and accelerations are half as long, and angles the same."""
    small = DEFAULTS.model_copy(update={"half_length_px": 20.0})
    for tracker in TRACKERS:
        whole, half = draw(tracker, DEFAULTS), draw(tracker, small)
        assert half.mean == pytest.approx(whole.mean * [0.5, 0.5, 1.0, 1.0])
        assert half.root == pytest.approx(whole.root * np.array([0.5, 0.5, 1.0, 1.0])[:, None])


@pytest.mark.parametrize(("tracker", "sd"), [("ordinary", GUIDANCE.parse("").step_sd[2]), ("guided", GUIDED_SD)])
@pytest.mark.parametrize("heading", [np.pi - 1e-5, 1e-5 - np.pi])
def test_a_heading_is_averaged_on_the_circle(heading: float, tracker: str, sd: float) -> None:
    """A fish that swims to the left has headings on both sides of half a turn, and a small spread all the same."""
    left = FishTarget.of(np.array([300.0, 200.0, heading, 0.0]), target(0).shape, np.zeros(2))
    state = without_edges(begin_at(left, 10), tracker)
    assert state.spread[2] == pytest.approx(sd, rel=0.05)
    assert abs(abs(state.mean[4]) - np.pi) < 0.02


def test_turning_the_picture_turns_the_guided_particles() -> None:
    """Particles of a fish that is turned and moved are the particles, turned and moved: the chart's invariance."""
    begin, turn, shift = begin_at(target(0), 10), 1.1, np.array([30.0, -20.0])

    def moved(states: NDArray[np.float64]) -> NDArray[np.float64]:
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        return np.hstack([states[:, :2] @ rotation.T + shift, states[:, 2:] + [0.0, 0.0, turn, 0.0]])

    particles = ParticleSet.uniform(np.asfortranarray(moved(begin.particles.states)))
    other = replace(begin, particles=particles)
    here, there = (without_edges(state, "guided", sample_count=500).particles.states for state in (begin, other))
    assert there == pytest.approx(moved(here), abs=1e-9)


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        (GUIDANCE.built_in.replace('"fish"', '"ball"'), "learned must be a learned motion"),
        (GUIDANCE.built_in.replace('"version": 1', '"version": 9'), "learned must be a learned motion"),
        (GUIDANCE.built_in[:200], "learned must be a learned motion"),
        (json.dumps({**json.loads(GUIDANCE.built_in), "step_mean": [1e30] * 4}), "step_mean"),
    ],
    ids=["another experiment", "another version", "a part", "absurd means"],
)
def test_a_learned_file_of_something_else_is_refused(bad: str, said: str) -> None:
    """In a sentence that names the parameter; steps that no angle survives are refused as absurd accelerations are."""
    with pytest.raises(ParameterError, match=said):
        revise(DEFAULTS, {"learned": bad})
    assert revise(DEFAULTS, {"learned": GUIDANCE.built_in}).learned == GUIDANCE.built_in


SHAPE = FishShape(24.0, 10.0, 28.0)
WATER, ORANGE = (110, 125, 140), (235, 105, 40)
FRAMES = 8


def pose(frame: int) -> NDArray[np.float64]:
    return np.array([100.0 + 2.5 * frame, 90.0, 0.1 + 0.02 * frame, 0.3])


def film(colour: tuple[int, int, int]) -> FrameSequence:
    shown = np.full((FRAMES, 180, 240, 3), WATER, np.uint8)
    for frame, picture in enumerate(shown):
        for corners in (body_points(pose(frame), SHAPE, 60), tail_corners(pose(frame), SHAPE)):
            cv2.fillPoly(picture, [np.rint(corners).astype(np.int32)], colour)
    return Pictures(list(shown), frame_rate_hz=15.0)


def mark(**changes: object) -> Mark:
    target = FishTarget.of(pose(0), SHAPE, np.zeros(2))
    made = FISH.video.marks[0].of_target(target)
    return FISH.video.mark({**made.model_dump(mode="json"), **changes})


def wired(sequence: FrameSequence) -> Setup:
    return FISH.video.on_video(sequence, mark())


@pytest.mark.parametrize(("colour", "told"), [(ORANGE, "colour"), ((60, 68, 75), "dark")])
def test_a_recording_is_followed_by_colour_or_by_darkness(colour: tuple[int, int, int], told: str) -> None:
    """The mark gives shape and scale; a colourful fish is found by its hues, another by being darker than the water."""
    setup = wired(film(colour))
    parameters = setup.parameters
    assert parameters.foreground == told
    lengths = (parameters.half_length_px, parameters.tail_length_px, parameters.sigma_d_px2)
    assert lengths == pytest.approx((24.0, 28.0, 25.0 * 0.36))
    step = Run(FISH, setup, tracker="guided", seed=0).finish()
    assert np.hypot(*(step.state.estimate - pose(FRAMES - 1)[:2])) < 5.0


def test_a_form_says_whether_the_fish_stands_out() -> None:
    """The fish itself is well suited; with thresholds that nothing meets it is not at all, and it is said why."""
    sequence = film(ORANGE)
    setup = wired(sequence)
    nothing = revise(setup.parameters, {"lowest_hue": 90, "highest_hue": 91})
    good, bad = (FISH.video.suits(sequence, setup.footage, it) for it in (setup.parameters, nothing))
    assert (good.grade, bad.grade) == ("well", "not at all")
    assert not good.advice
    assert "0 % of the body is told from the water by its colour" in bad.remark
    assert bad.remark.endswith("the outline is partly 63 px or more from any edge")
    assert bad.advice[0].startswith("widen the range of hues")


def test_a_fish_of_most_of_the_picture_is_taken() -> None:
    """The tolerance of edges grows with the fish as far as it can be set."""
    sequence = Pictures([np.full((80, 400, 3), WATER, np.uint8)])
    large = mark(head=[390.0, 40.0], root=[10.0, 40.0], tip=[1.0, 40.0])
    assert FISH.video.on_video(sequence, large).parameters.sigma_d_px2 == 400.0


def test_angles_are_off_by_half_a_turn_at_most() -> None:
    """A bend that is not limited may go round; a heading of 179 degrees is 3 from -178, and is plotted beside it."""
    target = FishTarget.of(np.array([100.0, 100.0, np.deg2rad(179.0), 0.5]), FishShape(40.0, 10.0, 40.0), np.zeros(2))
    mean = np.array([100.0, 100.0, 0.0, 0.0, np.deg2rad(-178.0), 0.5 - np.deg2rad(233.0)])
    assert FISH.measured.measure is not None
    found = FISH.measured.measure(Frame(0, 0.0, target=target), replace(begin_at(target, 10), mean=mean))
    names = ("bend_error", "heading_error", "true_heading")
    assert [found[name] for name in names] == pytest.approx([127.0, 3.0, -181.0])


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


def drawn(frames: int, **values: Value) -> dict[str, Any]:
    run = whole_run(FISH, values=values, frames=frames)
    return dict(FISH.draw(run.current, run.diagnostics).worlds[0].primitives)


@pytest.mark.parametrize("mode", [1, 4])
def test_the_ghost_moves_along_the_mode(mode: int) -> None:
    """Its tail is that of a fish at rest, head upwards, after so many deviations along the eigenvector.

    It sways from where it is dragged to, so in frame 0 it is there.
    """
    diffusion = GUIDANCE.parse("").diffusion("document")
    change = 1.5 * np.sqrt(diffusion.eigenvalues[mode - 1]) * diffusion.modes[:, mode - 1]
    theta = -np.pi / 2 + change[2]
    place = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]]) @ change[:2]
    tail = drawn(3, mode_sways=False, shown_mode=mode, along_mode=1.5)["ghost tail"]
    expected = tail_line(np.array([*place, theta, change[3]]), FishShape(40.0, 15.0, 40.0))
    assert tail.positions[:, :2] == pytest.approx(expected, abs=1e-4)
    assert drawn(1, shown_mode=3, along_mode=1)["label"].text == "turn -8°, bend +11°"


def test_a_fish_that_fills_the_picture_is_told_by_its_colour() -> None:
    """Where nothing is around it, nothing around it is alike."""
    image = np.full((20, 40, 3), (235, 105, 40), np.uint8)
    fish = FishBody(head=(39.0, 10.0), root=(0.0, 10.0), tip=(0.0, 10.0), half_width=20.0)
    assert _appearance(image, fish.target)["foreground"] == "colour"
