"""The drawn head is the tracker's model, as the camera sees it."""

from dataclasses import replace

import numpy as np
import pytest

from pftrack.core.geometry import rotation
from pftrack.core.model.drawing import COLOURS
from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.experiments.head.experiment import HEAD_WORLD, head_world
from pftrack.experiments.head.parameters import AS_PUBLISHED
from pftrack.runs.run import Run

HEAD = find("head")


@pytest.mark.parametrize("upper", ["affine", "perspective"])
def test_the_drawn_head_is_the_model_before_its_camera(upper: str) -> None:
    """Points are the model's, on its surface; features are where the camera sees them, with their deviations in mm.

    The camera's arrow lies on its ray to the head's origin. A lost head has another colour and no features.
    """
    changes = (Change(0, {**AS_PUBLISHED, "upper_layer": upper, "image_width_px": 320}),)
    run = Run(HEAD, HEAD.simulate(), seed=3, frames=61, timeline=changes)
    step = run.seek(60)
    state = step.state
    (world,) = HEAD.draw(step, run.diagnostics).worlds
    assert world.world is HEAD_WORLD
    drawn, sight = dict(world.primitives), (rotation(state.estimate) @ state.memory.turn)[2]

    def seen(points_mm: np.ndarray) -> np.ndarray:
        return state.project(points_mm.astype(np.float64) @ state.memory.turn.T)

    points, features = drawn["points"].positions, drawn["features"]
    np.testing.assert_allclose(points, state.memory.model.points_mm, atol=1e-4)
    apart = np.linalg.norm(points[:, None] - drawn["surface"].vertices, axis=2).min(axis=1)
    assert apart.max() < 12.0
    ends = drawn["camera"].segments[0]
    np.testing.assert_allclose(seen(ends), np.tile(seen(np.zeros((1, 3))), (2, 1)), atol=0.01)
    assert (ends @ sight)[1] < (ends @ sight)[0] < 0, "it leads away from the head, towards the camera"
    np.testing.assert_allclose(seen(features.centres), state.feature_means, atol=0.5)
    np.testing.assert_allclose(np.einsum("i,nij,j->n", sight, features.covariances, sight), 0.0, atol=1e-4)
    spread, in_picture = (
        np.sqrt(np.trace(each, axis1=1, axis2=2)) for each in (features.covariances, state.feature_covariances)
    )
    np.testing.assert_allclose(spread, in_picture / state.solid.scale, rtol=0.3)
    lost = head_world(replace(state, memory=replace(state.memory, lost_frames=3)), step.frame.target).primitives
    assert "features" not in lost
    assert lost["surface"].colour == COLOURS["lost"]


def test_unknown_features_do_not_hide_the_head() -> None:
    """Features with a huge variance are not drawn, since their discs would cover the world."""
    step = Run(HEAD, HEAD.simulate(), tracker="rb-pf", seed=3, frames=4).seek(3)
    state, belief = step.state, step.state.belief
    wide = belief.covariances.copy()
    wide[2:] += 1e5 * np.eye(2)
    state = replace(state, belief=replace(belief, covariances=wide))
    assert len(head_world(state, step.frame.target).primitives["features"].centres) == 2
