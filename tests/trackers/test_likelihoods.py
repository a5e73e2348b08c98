"""What likelihoods say at chosen places, and what they say that it is made of."""

import math

import numpy as np
import pytest

from pftrack.experiments import find
from pftrack.model.part import Amount, Histograms, Part, Patches, Residual
from pftrack.runs.run import Run


def looked_at(experiment: str, tracker: str, frame: int = 6) -> tuple[Run, object, object]:
    """Return a run at a frame, its tracker's likelihood, and the state before as that wants it."""
    found = find(experiment)
    run = Run(found, found.simulate(), tracker=tracker, seed=5, frames=frame + 1)
    run.seek(frame)
    likelihood = found.trackers[tracker].likelihood
    assert likelihood is not None
    (before,) = run.replay(frame - 1, frame - 1)
    return run, likelihood, likelihood.prepare(before.state, run.current.frame, run.current.parameters)


def of_kind(parts: tuple[Part, ...], kind: type[Part]) -> list[Part]:
    return [part for part in parts if isinstance(part, kind)]


def test_a_pixel_of_the_ball_is_as_likely_as_its_share_of_red_says() -> None:
    """The number at a place follows from the residual that is told of it, by the equation of the kernel."""
    run, likelihood, before = looked_at("ball", "condensation")
    step = run.current
    centre = likelihood.centre(step.state)
    for place in (step.frame.target.position, np.array([10.0, 10.0])):
        (state,) = likelihood.anchor.put(before, centre, place[None])
        (number,) = likelihood.ask(before, state[None], step.frame, step.parameters)
        parts = likelihood.parts(before, state, step.frame, step.parameters)
        (red,) = of_kind(parts, Residual)
        (rho,) = of_kind(parts, Amount)
        off = (red.found - red.expected) / red.sd
        assert number == pytest.approx(math.log(rho.value + math.exp(-0.5 * off**2)), abs=1e-12)
        (patch,) = of_kind(parts, Patches)
        pixel = patch.found_rgb[5, 5].astype(float)
        assert red.found == pixel[0] / pixel.sum()


def test_outside_the_picture_nothing_is_found() -> None:
    """Outside, a likelihood is that of the background, and there is no share of red to tell and no patch to show."""
    run, likelihood, before = looked_at("ball", "condensation")
    step = run.current
    state = np.array([-50.0, 1e9, 0.0, 0.0])
    parts = likelihood.parts(before, state, step.frame, step.parameters)
    assert math.isnan(of_kind(parts, Residual)[0].found)
    assert of_kind(parts, Patches)[0].found_rgb.size == 0
    assert likelihood.ask(before, state[None], step.frame, step.parameters)[0] == pytest.approx(math.log(0.1))


def test_a_window_is_as_likely_as_its_histogram_is_like_the_models() -> None:
    """The number at a place follows from both histograms, by the coefficient of Bhattacharyya."""
    run, likelihood, before = looked_at("histogram", "condensation")
    step = run.current
    state = likelihood.centre(step.state)
    (number,) = likelihood.ask(before, state[None], step.frame, step.parameters)
    parts = likelihood.parts(before, state, step.frame, step.parameters)
    (counted,) = of_kind(parts, Histograms)
    rho, sharpness = (part.value for part in of_kind(parts, Amount))
    assert rho == pytest.approx(np.sqrt(np.multiply(counted.expected, counted.found)).sum(), abs=1e-12)
    assert number == pytest.approx(-sharpness * (1.0 - rho), abs=1e-12)
    assert sum(counted.expected) == pytest.approx(1.0)


def test_values_in_force_are_asked_for() -> None:
    """With other parameters than those of the frame the likelihood is another one, though no step was taken."""
    run, likelihood, before = looked_at("histogram", "condensation")
    step = run.current
    state = likelihood.centre(step.state)[None]
    flat = step.parameters.model_copy(update={"sharpness": 0.0, "colour_space": "lab"})
    assert likelihood.ask(before, state, step.frame, flat)[0] == 0.0
    assert likelihood.ask(before, state, step.frame, step.parameters)[0] < 0.0
