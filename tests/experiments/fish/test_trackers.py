"""Trackers of a fish that bends."""

import json
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import History
from pftrack.core.numerics.compiled import read_only
from pftrack.core.refusal import ParameterError
from pftrack.experiments import find
from pftrack.experiments.fish.model import Edges, FishState, find_edges
from pftrack.experiments.fish.parameters import GUIDANCE
from pftrack.experiments.fish.scene import FishSource, FishTarget
from pftrack.experiments.fish.trackers import TRACKERS, begin_at, draw, step_frame
from pftrack.filters.learning.charts import body_velocity
from pftrack.filters.particles import ParticleSet

FISH = find("fish")
DEFAULTS = FISH.simulate().parameters


@cache
def seen(frame: int) -> Edges:
    history = History(((0, DEFAULTS),))
    return find_edges(FishSource(0, DEFAULTS).frame(frame, history), DEFAULTS)


def target(frame: int) -> FishTarget:
    return FishSource(0, DEFAULTS).target(frame, DEFAULTS)


def advanced(tracker: str, state: FishState, frames: int = 1, **values: object) -> FishState:
    parameters = revise(DEFAULTS, {"sample_count": 2000, **values})
    for frame in range(1, frames + 1):
        state = step_frame(tracker, state, seen(frame), parameters, 7, frame)
    return state


@pytest.mark.parametrize("tracker", TRACKERS)
def test_the_fish_is_followed(tracker: str) -> None:
    """For two thirds of a second each tracker is within the fish, its heading and bend near the truth."""
    state = advanced(tracker, begin_at(target(0), 2000), 10)
    true = target(10)
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


def moments(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return values.mean(axis=0), np.cov(values.T)


def test_the_ordinary_filter_draws_the_learned_steps() -> None:
    """Steps of place, heading and bend have the learned mean and standard deviation, one by one (eq. 8)."""
    begin = begin_at(target(0), 10)
    after = without_edges(begin, "ordinary").particles.states[:, [0, 1, 4, 5]]
    mean, covariance = moments(after - begin.pose)
    learned = GUIDANCE.parse("")
    assert mean == pytest.approx(learned.step_mean, abs=0.1)
    assert np.sqrt(np.diagonal(covariance)) == pytest.approx(learned.step_sd, rel=0.02)


def test_wide_steps_are_those_of_the_document() -> None:
    """30 px and a quarter of half a turn, without mean."""
    begin = begin_at(target(0), 10)
    after = without_edges(begin, "ordinary", walk_steps="wide").particles.states[:, [0, 1, 4, 5]]
    mean, covariance = moments(after - begin.pose)
    assert mean == pytest.approx(np.zeros(4), abs=0.6)
    assert np.sqrt(np.diagonal(covariance)) == pytest.approx([30.0, 30.0, np.pi / 4, np.pi / 4], rel=0.02)


@pytest.mark.parametrize("correlated", [True, False])
def test_the_guided_filter_draws_the_learned_changes(correlated: bool) -> None:
    """Changes of velocity in the body's frame, heading and bend have the learned covariance (eqs 16 and 18)."""
    begin = begin_at(target(0), 10)
    state = without_edges(begin, "guided", correlated_changes=correlated)
    mean, covariance = moments(state.particles.states[:, 2:] - begin.mean[2:])
    wanted = GUIDANCE.parse("").diffusion("document", correlated=correlated).covariance
    scale = np.sqrt(np.outer(np.diagonal(wanted), np.diagonal(wanted)))
    assert mean / np.sqrt(np.diagonal(wanted)) == pytest.approx(np.zeros(4), abs=0.02)
    assert covariance / scale == pytest.approx(wanted / scale, abs=0.02)
    assert state.changes[:, 0] == pytest.approx(state.particles.states[:, 3] - begin.mean[3])


def test_the_new_velocity_moves_the_place_in_the_new_direction() -> None:
    """Eq. 17 holds for every particle of the guided filter, and the ordinary filter's velocity is its own step."""
    begin = begin_at(target(0), 10)
    for tracker in TRACKERS:
        states = without_edges(begin, tracker).particles.states
        step = states[:, :2] - begin.mean[:2]
        cosine, sine = np.cos(states[:, 4]), np.sin(states[:, 4])
        along, across = states[:, 2], states[:, 3]
        assert step[:, 0] == pytest.approx(cosine * along - sine * across, abs=1e-9)
        assert step[:, 1] == pytest.approx(sine * along + cosine * across, abs=1e-9)


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


def test_turning_the_picture_turns_the_guided_particles() -> None:
    """Particles of a fish that is turned and moved are the particles, turned and moved: the chart's invariance."""
    begin = begin_at(target(0), 10)
    turn, shift = 1.1, np.array([30.0, -20.0])
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    moved = begin.particles.states.copy()
    moved[:, :2] = moved[:, :2] @ rotation.T + shift
    moved[:, 4] += turn
    other = FishState(ParticleSet.uniform(np.asfortranarray(moved)), begin.changes, begin.mean, begin.spread, 0.0)
    here, there = (without_edges(state, "guided").particles.states for state in (begin, other))
    assert there[:, :2] == pytest.approx(here[:, :2] @ rotation.T + shift, abs=1e-9)
    assert there[:, 2:4] == pytest.approx(here[:, 2:4], abs=1e-9)
    assert there[:, 4:] == pytest.approx(here[:, 4:] + [turn, 0.0], abs=1e-9)


def test_a_heading_is_averaged_on_the_circle() -> None:
    """Particles on both sides of half a turn have their mean there, and a small deviation."""
    begin = begin_at(target(0), 10)
    states = begin.particles.states.copy()
    states[:, 4] = np.pi
    at = FishState(ParticleSet.uniform(np.asfortranarray(states)), begin.changes, begin.mean, begin.spread, 0.0)
    after = without_edges(at, "guided")
    assert abs(abs(after.mean[4]) - np.pi) < 0.02
    assert after.spread[2] == pytest.approx(GUIDANCE.parse("").diffusion("document").sd[2], rel=0.05)


def test_a_picture_without_fish_leaves_particles_as_they_are_drawn() -> None:
    """Where nothing has the colour all weigh the same, and the tracker goes on."""
    parameters = revise(DEFAULTS, {"lowest_hue": 90, "highest_hue": 91, "sample_count": 200})
    blank = find_edges(FishSource(0, DEFAULTS).frame(0, History(((0, DEFAULTS),))), parameters)
    assert not blank.edges.any()
    state = step_frame("guided", begin_at(target(0), 200), blank, parameters, 0, 1)
    assert state.particles.effective_sample_size == pytest.approx(200, abs=3)
    assert state.distance == 63.0


def test_a_learned_file_of_something_else_is_refused() -> None:
    """No JSON, another experiment, or another version is refused in a sentence that names the parameter."""
    text = GUIDANCE.built_in
    for bad in ("nonsense", text.replace('"fish"', '"ball"'), text.replace('"version": 1', '"version": 9'), text[:200]):
        with pytest.raises(ParameterError, match="learned must be a learned motion"):
            revise(DEFAULTS, {"learned": bad})
    assert revise(DEFAULTS, {"learned": text}).learned == text


@pytest.mark.parametrize("heading", [np.pi - 1e-5, 1e-5 - np.pi])
def test_the_spread_of_the_heading_is_on_the_circle(heading: float) -> None:
    """A fish that swims to the left has headings on both sides of half a turn, and a small spread all the same."""
    left = FishTarget.of(np.array([300.0, 200.0, heading, 0.0]), target(0).shape, np.zeros(2))
    state = without_edges(begin_at(left, 10), "ordinary")
    assert state.spread[2] == pytest.approx(GUIDANCE.parse("").step_sd[2], rel=0.05)
    assert abs(state.mean[4]) > 3.0


@pytest.mark.parametrize("name", ["step_mean", "step_sd"])
def test_absurd_learned_steps_are_refused(name: str) -> None:
    """Steps that no angle survives are refused as absurd accelerations are."""
    raw = json.loads(GUIDANCE.built_in)
    raw[name] = [1e30] * 4
    with pytest.raises(ParameterError, match=name):
        revise(DEFAULTS, {"learned": json.dumps(raw)})
