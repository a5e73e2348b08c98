import numpy as np
import pytest

from pftrack.core.model.drawing import COLOURS, Ellipse, Links, Picture, Points, Polyline
from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.runs.run import Run
from pftrack.vision.rendering import render


@pytest.mark.parametrize("name", ["ball", "prism"])
def test_a_second_run_is_drawn_in_its_colour(name: str) -> None:
    """Where there is another run to compare with, its belief is drawn on a layer of its own; else there is none."""
    experiment = find(name)
    first, last = (*experiment.trackers, *experiment.trackers)[:: len(experiment.trackers) * 2 - 1]
    one, two = (
        Run(experiment, experiment.simulate(), tracker=tracker, seed=1, frames=4).finish() for tracker in (first, last)
    )
    past = [one.diagnostics] * 4
    assert "second run" in experiment.shown_layers
    assert all(item.layer != "second run" for item in experiment.draw(one, past).primitives.values())
    drawing = experiment.draw(one, past, two.diagnostics)
    shown = [item for item in drawing.primitives.values() if item.layer == "second run"]
    assert shown
    assert {item.colour for item in shown} == {COLOURS["second"]}  # type: ignore[union-attr]
    assert render(drawing).shape == (drawing.height, drawing.width, 3)


def test_a_second_run_of_a_ball_is_a_cross_at_its_estimate() -> None:
    """Its middle is where the other run believes the ball to be."""
    run, _ = ball_drawing()
    other = run.branch(5, {"tracker": "apf"}).seek(20).diagnostics
    cross = run.experiment.draw(run.current, run.diagnostics, other).primitives["second"]
    assert isinstance(cross, Links)
    assert np.allclose(cross.segments[..., :2].mean(axis=(0, 1)), other.estimate)


def ball_drawing(**values: object) -> tuple[Run, dict]:
    ball = find("ball")
    run = Run(ball, ball.simulate(), seed=1, frames=40, timeline=(Change(0, values),))
    return run, ball.draw(run.seek(20), run.diagnostics).primitives


def test_particles_are_drawn_where_they_are() -> None:
    """Particles stand at their positions, lifted by weight, coloured by the sampler that drew them."""
    run, drawn = ball_drawing()
    particles = run.current.state.particles
    points = drawn["particles"]
    assert isinstance(points, Points)
    assert np.allclose(points.positions[:, :2], particles.states[:, :2], atol=1e-3)
    assert points.positions[:, 2].argmax() == particles.log_weights.argmax()
    samples = run.current.diagnostics.vector("samples")
    assert samples is not None
    orange = (points.colours == (230, 159, 0)).all(axis=1).sum()
    assert orange == samples[0]
    assert drawn["weights"].colours.shape == points.colours.shape


def test_of_many_particles_an_even_selection_is_drawn() -> None:
    """No more than 5,000 particles are drawn, spread over the whole set."""
    _, drawn = ball_drawing(sample_count=30_000)
    assert len(drawn["particles"].positions) == 5000


def test_marks_mean_what_they_say() -> None:
    """Truth and gate surround the truth, the trail ends at the estimate, the path through time rises backwards."""
    run, drawn = ball_drawing(smoothing_lag_frames=5)
    truth = run.current.frame.target.position
    assert isinstance(drawn["truth"], Ellipse)
    assert np.allclose(drawn["truth"].centre[:2], truth)
    assert drawn["truth"].half_axes[0, 0] == 5
    assert drawn["gate"].half_axes[0, 0] == 15
    assert isinstance(drawn["trail"], Polyline)
    assert np.allclose(drawn["trail"].positions[-1, :2], run.current.state.estimate)
    assert len(drawn["trail"].positions) == 21
    assert (np.diff(drawn["space-time"].positions[:, 2]) < 0).all()
    assert len(drawn["smoothed"].positions) == 6
    assert isinstance(drawn["picture"], Picture)
