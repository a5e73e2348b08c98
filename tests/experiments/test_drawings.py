"""The drawings of experiments show estimates in their places."""

from typing import Any

import numpy as np
import pytest

from pftrack.core.model import drawing as shapes
from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.experiments.hand.shape import joints
from pftrack.experiments.linkage.draw import chain_of
from pftrack.experiments.linkage.scene import places
from pftrack.experiments.shared.sketch import raised, with_depth
from pftrack.output.displays import draw_likelihood
from pftrack.runs.inspection import Inspection
from pftrack.runs.run import Run


def at(name: str, frame: int, tracker: str | None = None, **values: Value) -> tuple[Run, dict[str, Any]]:
    """Return a run at a frame, and its drawing."""
    found = find(name)
    run = Run(found, found.simulate(), tracker=tracker, seed=1, frames=frame + 1, timeline=(Change(0, values),))
    return run, dict(found.draw(run.seek(frame), run.diagnostics).primitives)


def test_a_ball_is_drawn_with_particles_and_path() -> None:
    """Particles stand on stems as high as their weights, coloured by their sampler, and at most 5,000 are drawn.

    Truth and gate surround the true place, the trail ends at the estimate, and the paths recede evenly in time behind
    the picture, with outlines of past frames and an axis. A second run is a cross at its estimate.
    """
    run, drawn = at("ball", 20, smoothing_lag_frames=5)
    particles, points = run.current.state.particles, drawn["particles"]
    assert np.allclose(points.positions[:, :2], particles.states[:, :2], atol=1e-3)
    relative = np.exp(particles.log_weights - particles.log_weights.max())
    assert np.allclose(points.positions[:, 2], 1.0 + shapes.LIFT * 320 * relative, atol=1e-3)
    assert points.stems
    orange = (points.colours == (230, 159, 0)).all(axis=1).sum()
    assert orange == run.current.diagnostics.vector("samples")[0]
    assert drawn["weights"].colours.shape == points.colours.shape
    assert len(at("ball", 2, sample_count=30_000)[1]["particles"].positions) == 5000
    assert np.allclose(drawn["truth"].centre[:2], run.current.frame.target.position)
    assert [drawn[name].half_axes[0, 0] for name in ("truth", "gate")] == [5, 15]
    assert np.allclose(drawn["trail"].positions[-1, :2], run.current.state.estimate)
    assert len(drawn["trail"].positions) == 21
    assert np.allclose(drawn["space-time"].positions[:, 2], np.arange(-20, 1) * 1.25 * 320 / 60, atol=1e-3)
    assert np.array_equal(drawn["true space-time"].positions[:, 2], drawn["space-time"].positions[:, 2])
    assert len(drawn["smoothed"].positions) == 6
    corners = drawn["past frames"].segments[:, 0].reshape(3, 4, 3)
    assert np.allclose(corners[:, :, 2], -np.array([[20], [40], [60]]) * 1.25 * 320 / 60)
    assert np.allclose(np.ptp(corners[:, :, :2], axis=1), (320, 240))
    assert np.allclose(drawn["axis"].segments[0, :, 2], (-400, shapes.LIFT * 320))
    words = {item.text: item.position[2] for item in drawn.values() if isinstance(item, shapes.Text)}
    assert np.allclose([words["60 frames ago"], words["weight"]], [-400, shapes.LIFT * 320])
    other = run.branch(5, {"tracker": "apf"}).seek(20).diagnostics
    cross = run.experiment.draw(run.current, run.diagnostics, other).primitives["second"]
    assert np.allclose(cross.segments[..., :2].mean(axis=(0, 1)), other.estimate)


def test_only_the_highest_of_neighbouring_stems_is_drawn() -> None:
    """A thousand particles in one place cost a display one stem."""
    places = np.array([[10.2, 20, 3], [10.9, 20, 9], [12.3, 20, 5], [np.nan, 20, 4]], np.float32)
    stems = raised(shapes.Points(places, np.zeros((4, 3), np.uint8), 2.0, stems=True), 320, 240)
    np.testing.assert_allclose(stems.segments[:, 1], places[1:])


def test_the_posterior_of_a_signal_is_a_surface() -> None:
    """It is highest over the estimates, falls to the sides as a Gaussian, and is lower where that is wider."""
    run, drawn = at("sine", 30, "kalman")
    slices = drawn["density"].vertices.reshape(61, 17, 3)
    assert np.allclose(slices[::2, 8, 1], 200 - 125 * np.array([row.estimate[0] for row in run.diagnostics]), atol=0.01)
    heights = slices[:, :, 2] - 1.0
    assert np.allclose(heights[:, 5] / heights[:, 8], np.exp(-0.5 * 1.125**2), rtol=1e-3)
    deviations = np.array([max(row.sigma[0], 0.008) for row in run.diagnostics])
    usual = 0.5 * shapes.LIFT * 720 * np.minimum(np.median(deviations) / deviations, 2.0)
    assert np.allclose(heights[::2, 8], usual, rtol=0.05)


def test_a_likelihood_is_drawn_as_a_relief() -> None:
    """The picture shows it in colours, and as heights where there is depth."""
    run, _ = at("ball", 20)
    found = Inspection(run).map((320, 240))
    shown = draw_likelihood(run.experiment.draw(run.current, run.diagnostics), found)
    picture = shown.primitives["picture"]
    assert np.array_equal(picture.relief, found.levels.astype(np.float32))
    assert (picture.relief.min(), picture.relief.max()) == (0.0, 1.0)
    flat = shapes.from_front(shown, run.experiment.display.layers).primitives["picture"]
    assert flat.image_rgb is picture.image_rgb
    assert flat.relief is None


def test_a_body_of_points_stands_before_its_camera() -> None:
    """Each point lies on the ray of its pixel, and relative depths are those of the estimate."""
    run, drawn = at("structure", 60)
    state, apex = run.current.state, drawn["camera"].apex
    assert apex[2] == pytest.approx(state.focal_px)
    inside = state.placed.points @ state.placed.camera[:, :3].T + state.placed.camera[:, 3]
    crosses = drawn["shape crosses"].segments.reshape(-1, 4, 3).mean(axis=1)
    assert len(crosses) == len(inside)
    away = apex[2] - crosses[:, 2:]
    rays = np.column_stack([(crosses[:, :2] - apex[:2]) / apex[2], np.ones(len(crosses))]) * away
    assert np.allclose(rays, away[0, 0] / inside[0, 2] * inside, rtol=1e-3, atol=1e-2)


def test_a_chain_stands_out_of_the_picture() -> None:
    """Depths of the joints relative to the root are those of the estimate and of the truth."""
    run, drawn = at("linkage", 3)
    state, frame = run.current.state, run.current.frame
    chain, true = chain_of(state.mean, state), places(frame.target)
    for name, depths in (("estimate", chain[:, 2] - chain[0, 2]), ("true", true[:, 2])):
        expected = 0.3 * max(frame.picture.shape) - depths
        assert np.allclose(drawn[f"{name} joints"].positions[:, 2], expected, atol=1e-2)
    assert drawn["estimate joints"].stems


def test_a_hand_stands_before_its_picture() -> None:
    """Around each joint of the chosen hand lies a part of its body; from the front it is not drawn."""
    run, drawn = at("hand", 2)
    state, hand = run.current.state, run.experiment
    found = joints(state.beam.members[0], state.scale, state.shape).reshape(-1, 3) + np.array([0, 0, 1.2 * state.scale])
    apart = np.linalg.norm(drawn["fingers in space"].vertices[:, None] - found, axis=2).min(axis=0)
    assert apart.max() < 1.05 * state.scale * state.shape.radii.max()
    flat = shapes.from_front(hand.draw(run.current, run.diagnostics), hand.display.layers)
    assert "fingers in space" not in flat.primitives


@pytest.mark.parametrize("name", ["ball", "sine"])
def test_a_page_without_a_scene_shows_depth_as_a_world(name: str) -> None:
    """The world holds everything before and behind the picture, and the picture loses it."""
    run, before = at(name, 20, "condensation")
    drawing, layers = run.experiment.draw(run.current, run.diagnostics), run.experiment.display.layers
    shown = with_depth(drawing, layers)
    assert shown.primitives.keys() == shapes.from_front(drawing, layers).primitives.keys()
    (drawn,) = shown.worlds
    frame, axis, stems = (drawn.primitives[each] for each in ("frame", "axis", "stems"))
    assert np.allclose(np.ptp(frame.positions, axis=0), (drawing.width, drawing.height, 0))
    assert np.allclose(axis.segments[..., 2], -before["axis"].segments[..., 2])
    assert stems.segments[..., 2].max() == 0.0 > stems.segments[..., 2].min()
    corners = np.vstack([frame.positions, axis.segments[0]]) - drawn.world.middle
    assert np.linalg.norm(corners, axis=1).max() < drawn.world.radius
