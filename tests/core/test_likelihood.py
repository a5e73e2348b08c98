"""Models and trackers: what they need, and which parameters they read."""

from dataclasses import replace

import numpy as np
import pytest

from pftrack.core.arrays import Floats
from pftrack.core.model.likelihood import Cloud, Component, LikelihoodMap, lattice
from pftrack.core.model.model import Model
from pftrack.core.model.source import Frame
from pftrack.experiments import find
from pftrack.experiments.shared.filtered import Filter, PointModel
from pftrack.experiments.shared.sampling import LoopModel
from tests.making import whole_run

FRAME = Frame(3, 0.1, image_rgb=np.zeros((6, 8, 3), np.uint8))


class Hill(Model):
    title = "distance"
    axes = (1, 2)
    most_places = 12

    def components(self, parameters: object) -> tuple[Component, ...]:
        return Component("a"), Component("u", "px"), Component("v", "px")

    def log_likelihood(self, states: Floats, frame: Frame, parameters: object, known: Floats) -> Floats:
        return np.where(states[:, 0] > 0, -((states[:, 1:] - known) ** 2).sum(axis=1), np.nan)

    def centre(self, state: Floats) -> Floats:
        return state


HILL = Hill()


LATTICES = [((320, 240), 4800, (60, 80)), ((8, 6), 12, (3, 4)), ((3, 2), 99, (2, 3))]


@pytest.mark.parametrize(("size", "most", "cells"), LATTICES)
def test_a_lattice_covers_the_picture(size: tuple[int, int], most: int, cells: tuple[int, int]) -> None:
    """Places lie in the middles of equal cells, row after row, within the picture, and are not more than allowed."""
    places, found, step = lattice(size, most)
    assert found == cells
    assert len(places) == cells[0] * cells[1] <= most
    assert (places[0] == step // 2).all()
    assert (places < size).all()
    assert (np.diff(places.reshape(*cells, 2)[:, :, 0], axis=1) == step).all()


def test_a_map_asks_for_states_that_differ_in_their_place_alone() -> None:
    """Its greatest number is where the likelihood is greatest; one without places in the picture has no map.

    Colours tell a range of at most twenty apart: what is below is as good as impossible.
    """
    found = HILL.map(np.array([5.0, 1.0]), np.array([1.0, 0.0, 0.0]), FRAME, None, (8, 6))
    assert found.step_px == 2
    assert np.unravel_index(found.log_likelihoods.argmax(), (3, 4)) == (0, 2)
    assert found.log_likelihoods[0].tolist() == [-16.0, -4.0, 0.0, -4.0]
    found = LikelihoodMap(np.array([[-100.0, -10.0], [0.0, -np.inf]]), 1)
    assert (found.range, found.levels.tolist()) == ((-20.0, 0.0), [[0.0, 0.5], [1.0, 0.0]])
    signal = type("Signal", (Hill,), {"axes": None, "title": "measured value"})()
    with pytest.raises(ValueError, match="measured value has no place"):
        signal.map(np.zeros(2), np.zeros(3), FRAME, None, (8, 6))


def test_what_is_not_a_number_is_impossible() -> None:
    """A likelihood that is NaN counts as impossible, in a map as in an answer."""
    nowhere = np.array([-1.0, 0.0, 0.0])
    assert HILL.evaluate(np.zeros(2), nowhere[None], FRAME, None)[0] == -np.inf
    found = HILL.map(np.zeros(2), nowhere, FRAME, None, (8, 6))
    assert found.range == (0.0, 0.0)
    assert (found.levels == 0.0).all()


def test_each_filter_has_ranks_and_samplers_of_its_own() -> None:
    """Two filters have three particles each; the first has drawn one from above, the second two.

    The heaviest particle has rank 1, and equal ones share one.
    """
    log_weights, drawn = np.log([0.2, 0.5, 0.3, 0.1, 0.1, 0.8]), (1, 2, 2, 1)
    cloud = Cloud(np.zeros((6, 1)), log_weights, None, drawn, ("above", "below"), filters=("nose", "chin"))
    assert [cloud.filter(particle) for particle in range(6)] == ["nose"] * 3 + ["chin"] * 3
    assert [cloud.rank(particle) for particle in range(6)] == [3, 1, 2, 2, 2, 1]
    assert [cloud.sampler(each) for each in range(6)] == ["above", "below", "below", "above", "above", "below"]
    assert cloud.siblings(4) == slice(3, 6)
    alone = Cloud(np.zeros((4, 1)), np.log([0.1, 0.4, 0.4, 0.1]))
    assert [alone.rank(particle) for particle in range(4)] == [3, 1, 1, 3]
    assert (alone.sampler(0), alone.filter(3), alone.siblings(3)) == ("", "", slice(0, 4))


@pytest.mark.parametrize(
    ("base", "lacking"),
    [(PointModel, "components.*log_likelihood.*propagate"), (LoopModel, "motion.*pack.*pauses"), (Filter, "step")],
)
def test_what_lacks_a_function_is_refused_by_name(base: type, lacking: str) -> None:
    """It is refused when it is made, long before a run."""
    with pytest.raises(TypeError, match=f"Half .*{lacking}"):
        type("Half", (base,), {})()


def test_a_model_must_say_where_it_begins_and_what_is_likely() -> None:
    """Either of two functions will do for the beginning; a likelihood with a title is not impossible everywhere."""
    whole = {name: lambda *_: 1 for name in ("components", "log_likelihood", "propagate", "count")}
    begun, named = type("Begun", (PointModel,), whole)(), type("Named", (Model,), {"title": "distance"})()
    with pytest.raises(TypeError, match="the model Begun must define prior or start"):
        begun.start(None, FRAME, None, None)
    with pytest.raises(TypeError, match="the model Named must define log_likelihood"):
        named.evaluate(None, np.zeros((1, 2)), FRAME, None)
    with pytest.raises(TypeError, match="the model Named must define components"):
        named.components(None)


# Which parameters a tracker reads that joins an experiment of somebody else's.


def test_a_tracker_that_joins_reads_what_another_one_reads() -> None:
    """Parameters name their readers, and it has exactly those of the tracker that it is like; it runs and is drawn."""
    ball = find("ball")
    model = type(ball.simulate().parameters)
    own = replace(ball.trackers["condensation"], id="own", title="My own")
    for name in ball.trackers:
        joined = replace(ball.with_trackers(own, like=name), id="joined").declarations(model)
        read = {each.name for each in ball.declarations(model) if not each.trackers or name in each.trackers}
        assert {each.name for each in joined if not each.trackers or "own" in each.trackers} == read
    experiment = replace(ball.with_trackers(own, like="condensation"), id="joined")
    run = whole_run(experiment, tracker="own", frames=3)
    assert "My own" in experiment.draw(run.current, run.diagnostics).caption
