"""Trackers of a fish that bends."""

import json
from dataclasses import replace
from functools import cache
from typing import Any

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


@pytest.mark.parametrize("tracker", TRACKERS)
def test_the_fish_is_followed(tracker: str) -> None:
    """For two thirds of a second each tracker is within the fish, its heading and bend near the truth."""
    state, true, parameters = begin_at(target(0), 2000), target(10), revise(DEFAULTS, {"sample_count": 2000})
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
        states = without_edges(begin, tracker).particles.states
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


def with_states(begin: FishState, states: NDArray[np.float64]) -> FishState:
    return replace(begin, particles=ParticleSet.uniform(np.asfortranarray(states)))


def test_turning_the_picture_turns_the_guided_particles() -> None:
    """Particles of a fish that is turned and moved are the particles, turned and moved: the chart's invariance."""
    begin, turn, shift = begin_at(target(0), 10), 1.1, np.array([30.0, -20.0])

    def moved(states: NDArray[np.float64]) -> NDArray[np.float64]:
        rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        return np.hstack([states[:, :2] @ rotation.T + shift, states[:, 2:] + [0.0, 0.0, turn, 0.0]])

    other = with_states(begin, moved(begin.particles.states))
    here, there = (without_edges(state, "guided").particles.states for state in (begin, other))
    assert there == pytest.approx(moved(here), abs=1e-9)


def test_a_heading_is_averaged_on_the_circle() -> None:
    """Particles on both sides of half a turn have their mean there, and a small deviation."""
    begin = begin_at(target(0), 10)
    states = begin.particles.states.copy()
    states[:, 4] = np.pi
    after = without_edges(with_states(begin, states), "guided")
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


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        ("nonsense", "learned must be a learned motion"),
        (GUIDANCE.built_in.replace('"fish"', '"ball"'), "learned must be a learned motion"),
        (GUIDANCE.built_in.replace('"version": 1', '"version": 9'), "learned must be a learned motion"),
        (GUIDANCE.built_in[:200], "learned must be a learned motion"),
        (json.dumps({**json.loads(GUIDANCE.built_in), "step_mean": [1e30] * 4}), "step_mean"),
        (json.dumps({**json.loads(GUIDANCE.built_in), "step_sd": [1e30] * 4}), "step_sd"),
    ],
    ids=["no JSON", "another experiment", "another version", "a part", "absurd means", "absurd deviations"],
)
def test_a_learned_file_of_something_else_is_refused(bad: str, said: str) -> None:
    """In a sentence that names the parameter; steps that no angle survives are refused as absurd accelerations are."""
    with pytest.raises(ParameterError, match=said):
        revise(DEFAULTS, {"learned": bad})
    assert revise(DEFAULTS, {"learned": GUIDANCE.built_in}).learned == GUIDANCE.built_in


@pytest.mark.parametrize("heading", [np.pi - 1e-5, 1e-5 - np.pi])
def test_the_spread_of_the_heading_is_on_the_circle(heading: float) -> None:
    """A fish that swims to the left has headings on both sides of half a turn, and a small spread all the same."""
    left = FishTarget.of(np.array([300.0, 200.0, heading, 0.0]), target(0).shape, np.zeros(2))
    state = without_edges(begin_at(left, 10), "ordinary")
    assert state.spread[2] == pytest.approx(GUIDANCE.parse("").step_sd[2], rel=0.05)
    assert abs(state.mean[4]) > 3.0
