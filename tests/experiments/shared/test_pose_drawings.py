"""What is drawn of a solid: the camera that sees it, where it is, where it truly is and where a second run has it."""

from functools import cache

import numpy as np
import pytest

from pftrack.core.arrays import Floats
from pftrack.core.geometry import rotation
from pftrack.core.model.drawing import COLOURS, Drawing, Frustum, Links, Mesh, Text
from pftrack.core.model.recipe import Change
from pftrack.core.numerics.matrices import pinhole
from pftrack.experiments import find
from pftrack.experiments.head.parameters import AS_PUBLISHED
from pftrack.experiments.prism.scene import NAMES, VERTICES_MM
from pftrack.experiments.shared.pose.drawing import heights, place_points
from pftrack.runs.run import Run
from pftrack.vision.face import FEATURES
from tests.experiments.head.heads import Pictures, empty, pictures

BOTH = pytest.mark.parametrize("name", ["prism", "head"])


@cache
def run_of(name: str, upper: str = "affine", frame: int = 25) -> Run:
    experiment = find(name)
    changes = (Change(0, {**AS_PUBLISHED, "upper_layer": upper} if name == "head" else {"upper_layer": upper}),)
    run = Run(experiment, experiment.simulate(), seed=2, frames=30, timeline=changes)
    run.seek(frame)
    return run


def drawn(run: Run) -> Drawing:
    return run.experiment.draw(run.current, run.diagnostics)


def leant(points: Floats, camera: Frustum) -> Floats:
    """Return where points of a drawing stand: on the way from their pixel to the camera."""
    share = points[:, 2:] / camera.apex[2]
    return np.column_stack([points[:, :2] + share * (camera.apex[:2] - points[:, :2]), points[:, 2]])


def camera_of(drawing: Drawing) -> Frustum:
    camera = drawing.primitives["camera"]
    assert isinstance(camera, Frustum)
    return camera


def links(drawing: Drawing, name: str) -> Floats:
    return drawing.primitives[name].segments.astype(np.float64)


@BOTH
def test_camera_pixel_and_point_are_in_line_and_the_solid_has_its_proportions(name: str) -> None:
    """With the pinhole every point stands where it is in the camera's frame, on one scale for all three directions.

    The camera stands a focal length before the principal point, and its rays end in the picture's corners.
    """
    run = run_of(name, "perspective")
    state, drawing, (width, height) = run.current.state, drawn(run), run.source.size
    camera = camera_of(drawing)
    assert drawing.apex is camera.apex
    assert camera.apex == pytest.approx([width / 2, height / 2, state.solid.focal_px])
    assert camera.corners[[0, 2]] == pytest.approx(np.array([[-0.5, -0.5, 0], [width - 0.5, height - 0.5, 0]]))
    points = place_points(state, state.solid.points_mm)
    there = state.solid.points_mm @ rotation(state.estimate).T + state.translation_mm
    assert points[:, :2] == pytest.approx(pinhole(there, state.solid.focal_px) + state.solid.principal_px)
    # From the camera, x right, y down and z away from it, px.
    seen = (leant(points, camera) - camera.apex) * [1.0, 1.0, -1.0]
    scale = np.linalg.norm(seen) / np.linalg.norm(there)
    assert np.abs(seen - scale * there).max() < 0.01
    assert scale == pytest.approx(state.solid.focal_px / there[:, 2].mean(), rel=0.4)


def test_the_true_prism_keeps_its_edges_lengths() -> None:
    """Drawn over an affine estimate it is still the prism: every edge that is seen is as long as one of its edges."""
    run = run_of("prism")
    drawing, state = drawn(run), run.current.state
    edges = links(drawing, "true edges")
    ends = leant(edges.reshape(-1, 3), camera_of(drawing)).reshape(-1, 2, 3)
    px_per_mm = -float(np.diff(heights(state, np.array([80.0, 81.0])))[0])
    lengths_mm = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / px_per_mm
    true_mm = np.array([20.0, 30.0, np.hypot(5.0, 20.0)])
    assert len(edges) >= 7
    assert np.abs(lengths_mm[:, None] - true_mm).min(axis=1).max() < 1e-3


@BOTH
def test_the_solid_is_before_its_picture_and_before_the_camera(name: str) -> None:
    """Nothing of it dips into the picture, however it is turned in the scene."""
    run = Run(find(name), find(name).simulate(), seed=2, frames=61)
    for frame in range(0, 61, 10):
        run.seek(frame)
        drawing = drawn(run)
        for item in drawing.primitives.values():
            if isinstance(item, Mesh):
                assert 0 < item.vertices[:, 2].min() <= item.vertices[:, 2].max() < camera_of(drawing).apex[2]
            elif isinstance(item, Links):
                assert item.segments[..., 2].min(initial=np.inf) > 0


@pytest.mark.parametrize(("name", "upper"), [("prism", "affine"), ("head", "perspective")])
def test_the_ghost_of_a_second_run_has_the_pose_of_its_row(name: str, upper: str) -> None:
    """It is drawn in the pose that the other run's row tells, where this run's solid is, in the second run's colour."""
    run = run_of(name, upper)
    other = run.branch(10, {"tracker": "alpha-1"}).seek(run.position).diagnostics
    assert other.estimate != run.current.diagnostics.estimate
    drawing = run.experiment.draw(run.current, run.diagnostics, other)
    state, theta = run.current.state, np.deg2rad(other.estimate)
    if name == "prism":
        corners, ends = place_points(state, VERTICES_MM, theta), links(drawing, "second edges").reshape(-1, 3)
        assert len(ends) >= 18
        assert np.abs(ends[:, None] - corners).max(axis=2).min(axis=1).max() < 1e-3
    else:
        tip = state.memory.turn @ state.memory.model["nose"]
        line = place_points(state, tip + np.array([[0, 0, 0], [0, 0, -110.0]]), theta)
        assert links(drawing, "second look")[0] == pytest.approx(line, abs=1e-3)
    colours = [item.colour for item in drawing.primitives.values() if item.layer == "second run"]  # type: ignore[union-attr]
    assert set(colours) == {COLOURS["second"]}


def test_the_ghost_of_the_truth_is_where_the_face_is() -> None:
    """The head's lines in the true pose, moved so that its features lie where they truly are.

    From every feature a way leads from where it is tracked to its point on the solid.
    """
    run = run_of("head")
    drawing, state, target = drawn(run), run.current.state, run.current.frame.target
    seen = state.project(state.solid.points_mm, target.position)
    expected = seen[0] + (target.landmarks.points_px - seen).mean(axis=0)
    assert links(drawing, "true look")[0, 0, :2] == pytest.approx(expected, abs=1e-2)
    assert {drawing.primitives[name].layer for name in ("true lines", "true lines rim", "true look")} == {"truth"}
    ways = links(drawing, "ways")
    assert ways[:, 0, :2] == pytest.approx(state.feature_means, abs=1e-3)
    assert ways[:, 1] == pytest.approx(place_points(state, state.solid.points_mm), abs=1e-3)


@BOTH
def test_names_do_not_cover_each_other(name: str) -> None:
    """They stand in two columns beside the solid, with room between them, and a line leads to each feature."""
    run = run_of(name)
    drawing, state = drawn(run), run.current.state
    names = [item for item in drawing.primitives.values() if isinstance(item, Text) and item.layer == "names"]
    places = np.array([item.position for item in names])
    assert [item.text for item in names] == list(FEATURES if run.experiment.id == "head" else NAMES)
    assert np.array([item.point for item in names])[:, :2] == pytest.approx(state.feature_means, abs=1e-3)
    left, right = np.unique(places[:, 0])
    for x in (left, right):
        assert np.diff(np.sort(places[places[:, 0] == x, 1])).min() == pytest.approx(drawing.height / 18, abs=1e-3)
    solid = state.project(state.solid.points_mm)
    assert left < solid[:, 0].min() < solid[:, 0].max() < right
    assert links(drawing, "name lines")[:, 1, :2] == pytest.approx(state.feature_means, abs=1e-3)


def test_a_lost_face_is_said_and_seen_and_so_is_its_return() -> None:
    """The head turns vermilion and fades while it is looked for; that it is back is said for about a second."""
    head, shown = find("head"), pictures(50, width=320)
    setup = head.video.on_video(Pictures([*shown[:10], *[empty(shown[0])] * 20, *shown[10:50]]), None)
    run = Run(head, setup, seed=2)
    drawings = [head.draw(step, run.diagnostics) for step in run]
    found = [not row.searching for row in run.diagnostics]
    lost = found.index(False)
    again = found.index(True, lost)
    before, searching = drawings[lost - 1].primitives["head"], drawings[again - 1].primitives["head"]
    assert searching.colour == COLOURS["lost"]
    assert f"no face for {again - lost} frames, looking for it" in drawings[again - 1].caption
    assert "no face for 1 frame, looking for it" in drawings[lost].caption
    said = ["face found again" in drawing.caption for drawing in drawings[again:]]
    assert 0.8 < sum(said) / run.source.frame_rate_hz < 1.2
    assert all(said[: sum(said)])
    assert before.opacity > searching.opacity
    assert not np.array_equal(before.colour, COLOURS["lost"])
