"""The head's model in its own world is the model that is assumed, seen from where the camera is."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pftrack.core.geometry import rotation
from pftrack.core.model.drawing import COLOURS
from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.experiments.head.experiment import HEAD_WORLD, head_world
from pftrack.experiments.head.parameters import AS_PUBLISHED
from pftrack.experiments.shared.pose.state import PoseState
from pftrack.runs.run import Run

HEAD = find("head")


@pytest.fixture(scope="module", params=["parallel", "pinhole"])
def run(request: pytest.FixtureRequest) -> Run:
    """A driver who has turned his head, seen by either camera model."""
    upper = {"parallel": "affine", "pinhole": "perspective"}[request.param]
    return Run(HEAD, HEAD.simulate(), seed=3, frames=200, timeline=(Change(0, {**AS_PUBLISHED, "upper_layer": upper}),))


def drawn(run: Run, frame: int) -> tuple[PoseState, dict[str, Any]]:
    step = run.seek(frame)
    (world,) = HEAD.draw(step, run.diagnostics).worlds
    assert world.world is HEAD_WORLD
    return step.state, dict(world.primitives)


def seen(state: PoseState, points_mm: np.ndarray) -> np.ndarray:
    """Where points of the model are seen in the picture, px."""
    return state.project(points_mm.astype(np.float64) @ state.memory.turn.T)


def test_the_points_are_those_of_the_model(run: Run) -> None:
    """In mm in the head's frame, and the surface passes by them."""
    state, primitives = drawn(run, 40)
    points = primitives["points"].positions
    np.testing.assert_allclose(points, state.memory.model.points_mm, atol=1e-4)
    apart = np.linalg.norm(points[:, None] - primitives["surface"].vertices, axis=2).min(axis=1)
    assert apart.max() < 12.0


def test_the_arrow_points_to_the_camera(run: Run) -> None:
    """All of it lies on the ray on which the camera sees the head's origin."""
    state, primitives = drawn(run, 60)
    ends = primitives["camera"].segments[0]
    np.testing.assert_allclose(seen(state, ends), np.tile(seen(state, np.zeros((1, 3))), (2, 1)), atol=0.01)
    depths = ends @ (rotation(state.estimate) @ state.memory.turn)[2]
    assert depths[1] < depths[0] < 0, "it leads away from the head, towards the camera"


def test_features_stand_where_the_camera_sees_them(run: Run) -> None:
    """At the depth of the model's point, with an uncertainty across the line of sight, in mm."""
    state, primitives = drawn(run, 60)
    features, sight = primitives["features"], (rotation(state.estimate) @ state.memory.turn)[2]
    np.testing.assert_allclose(seen(state, features.centres), state.feature_means, atol=0.5)
    np.testing.assert_allclose(np.einsum("i,nij,j->n", sight, features.covariances, sight), 0.0, atol=1e-4)
    spread, in_picture = (
        np.sqrt(np.trace(each, axis1=1, axis2=2)) for each in (features.covariances, state.feature_covariances)
    )
    np.testing.assert_allclose(spread, in_picture / state.solid.scale, rtol=0.3)


def test_a_lost_head_has_no_features(run: Run) -> None:
    """The model stays, in the colour of what is lost."""
    step = run.seek(20)
    state = replace(step.state, memory=replace(step.state.memory, lost_frames=3))
    primitives = head_world(state, step.frame.target).primitives
    assert "features" not in primitives
    assert primitives["surface"].colour == COLOURS["lost"]


def test_what_is_not_known_at_all_does_not_hide_the_head() -> None:
    """A tracker that has left the face believes its features to be anywhere; discs of that would cover the world."""
    step = Run(HEAD, HEAD.simulate(), tracker="rb-pf", seed=3, frames=10).seek(5)
    state, belief = step.state, step.state.belief
    wide = belief.covariances.copy()
    wide[2:] += 1e5 * np.eye(2)
    state = replace(state, belief=replace(belief, covariances=wide))
    features = head_world(state, step.frame.target).primitives["features"]
    assert len(features.centres) == 2
