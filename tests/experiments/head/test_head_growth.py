"""A growing face is drawn as it is: its points, colours by uncertainty, ellipsoids, and the mean face as a wire."""

import json
from dataclasses import replace

import numpy as np
import pytest

from pftrack.core.model.drawing import Ellipsoids, Links, Mesh, Primitive
from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.experiments.head.experiment import UNCERTAINTY, front, points_of, surface_of
from pftrack.runs.run import Run
from pftrack.vision.face import FEATURES, mean_model
from tests.making import whole_run

HEAD = find("head")
VALUES = {"face_model": "growing", "person": 102, "image_width_px": 320, "feature_noise_px": 3}


@pytest.fixture(scope="module")
def run() -> Run:
    return whole_run(HEAD, seed=1, frames=40, values=VALUES)


def worlds(run: Run, frame: int) -> dict[str, Primitive]:
    (world,) = HEAD.draw(run.seek(frame), run.diagnostics).worlds
    return world.primitives


def mesh(primitives: dict[str, Primitive], name: str) -> Mesh:
    found = primitives[name]
    assert isinstance(found, Mesh)
    return found


def test_the_mean_head_becomes_the_persons(run: Run) -> None:
    """The surface begins as that of the mean face and ends as that of the model that the tracker uses."""
    first, last = mesh(worlds(run, 0), "surface").vertices, mesh(worlds(run, 39), "surface").vertices
    model = run.current.state.memory.model
    np.testing.assert_allclose(first, front(mean_model()).vertices_mm, atol=1e-4)
    np.testing.assert_allclose(last, front(model).vertices_mm, atol=1e-4)
    assert np.abs(last - first).max() > 1.0
    wire = worlds(run, 39)["mean face"]
    assert isinstance(wire, Links)
    assert np.array_equal(wire.segments, front(mean_model()).vertices_mm.astype(np.float32)[front(mean_model()).edges])


def test_it_is_coloured_by_how_sure_it_is(run: Run) -> None:
    """On the picture and in the world alike; surer with time, and least sure far from what is seen."""
    step = run.seek(39)
    drawing = HEAD.draw(step, run.diagnostics)
    later, before = mesh(worlds(run, 39), "surface"), mesh(worlds(run, 1), "surface")
    assert later.layer == UNCERTAINTY
    assert np.array_equal(later.colour, mesh(drawing.primitives, "head").colour)
    assert isinstance(later.colour, np.ndarray)
    assert isinstance(before.colour, np.ndarray)
    apart = np.linalg.norm(later.vertices[:, None] - step.state.memory.model.points_mm, axis=2).min(axis=1)
    # Viridis grows in green with the amount.
    assert later.colour[apart < 8, 1].mean() < before.colour[apart < 8, 1].mean() - 25
    assert later.colour[apart > 40, 1].mean() > later.colour[apart < 8, 1].mean() + 20
    # Far away nothing was seen, and it stays as unsure as it was.
    assert np.abs(later.colour[apart > 60].astype(int) - before.colour[apart > 60]).max() < 12


def test_points_carry_their_uncertainty(run: Run) -> None:
    """An ellipsoid for each of the eleven points, with the covariance of what is published."""
    ellipsoids = worlds(run, 39)["model ellipsoids"]
    assert isinstance(ellipsoids, Ellipsoids)
    memory = run.current.state.memory
    assert len(ellipsoids.centres) == len(FEATURES)
    np.testing.assert_allclose(ellipsoids.centres, memory.model.points_mm, atol=1e-4)
    np.testing.assert_allclose(ellipsoids.covariances, memory.growth.covariances, rtol=1e-4, atol=1e-4)


def test_a_lost_face_says_nothing_of_itself(run: Run) -> None:
    """It has the colour of what is lost, without ellipsoids."""
    step = run.seek(39)
    lost = replace(step.state, memory=replace(step.state.memory, lost_frames=2))
    (world,) = HEAD.draw(replace(step, state=lost), run.diagnostics).worlds
    assert "model ellipsoids" not in world.primitives
    assert mesh(world.primitives, "surface").is_uniform


def test_the_surface_is_taken_away_with_its_outside_out(run: Run) -> None:
    """In the frame of other programs, y up and z to the viewer, all triangles face away from the head's axis."""
    surface = surface_of(run.seek(39).state)
    corners = surface.vertices_mm[surface.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inside = np.array([0.0, 0.0, -90.0])
    assert ((normals * (corners.mean(axis=1) - inside)).sum(axis=1) > 0.0).all()


def test_the_points_are_taken_away_with_what_is_known_of_them(run: Run) -> None:
    """With standard deviations, the share of the own face, and the frames learned from; a model that stays has none."""
    state = run.seek(39).state
    said, growth = json.loads(points_of(state)), state.memory.growth
    variances = np.square([said["standard_deviations"][name] for name in FEATURES])
    np.testing.assert_allclose(variances, growth.covariances.diagonal(axis1=1, axis2=2), atol=1e-3)
    assert said["own_share"] == pytest.approx(growth.weight, abs=1e-4)
    assert said["frames"] == growth.own.frames
    assert 10 < growth.own.frames <= 39
    plain = Run(HEAD, HEAD.simulate(), frames=1, timeline=(Change(0, {**VALUES, "face_model": "mean"}),))
    assert not {"standard_deviations", "own_share"} & set(json.loads(points_of(plain.current.state)))
