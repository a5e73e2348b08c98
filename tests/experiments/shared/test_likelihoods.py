"""What likelihoods say at chosen places, and what they say that it is made of."""

import math
from typing import Any

import numpy as np
import pytest

from pftrack.core.arrays import Floats
from pftrack.core.model.likelihood import Amount, Contributions, Histograms, Part, Patches, Residual
from pftrack.experiments import find
from pftrack.experiments.own.code import trust
from pftrack.experiments.own.extension import extend, widen
from pftrack.runs.inspection import Inspection
from pftrack.runs.run import Run


def looked_at(experiment: str, tracker: str, frame: int = 6) -> Run:
    """Return a run at a frame."""
    found = find(experiment)
    run = Run(found, found.simulate(), tracker=tracker, seed=5, frames=frame + 1)
    run.seek(frame)
    return run


class Asked:
    """The likelihood of condensation at a frame, asked at states."""

    def __init__(self, experiment: str) -> None:
        run = looked_at(experiment, "condensation")
        self.step, self.model = run.current, find(experiment).trackers["condensation"].model
        (before,) = run.replay(5, 5)
        self.before = self.model.prepare(before.state, self.step.frame, self.step.parameters)
        self.centre = self.model.centre(self.step.state)

    def number(self, state: Floats, parameters: object = None) -> float:
        used = parameters or self.step.parameters
        return float(self.model.evaluate(self.before, state[None], self.step.frame, used)[0])

    def parts(self, state: Floats) -> tuple[Part, ...]:
        return self.model.parts(state, self.step.frame, self.step.parameters, self.before)


def of_kind(parts: tuple[Part, ...], kind: type[Part]) -> list[Any]:
    return [part for part in parts if isinstance(part, kind)]


def test_a_pixel_of_the_ball_is_as_likely_as_its_share_of_red_says() -> None:
    """The number at a place follows from its residual, by the equation of the kernel.

    Outside the picture it is that of the background, without a share of red to tell or a patch to show.
    """
    asked = Asked("ball")
    for place in (asked.step.frame.target.position, np.array([10.0, 10.0])):
        (state,) = asked.model.put(asked.centre, place[None], asked.before)
        parts = asked.parts(state)
        ((red,), (rho,), (patch,)) = (of_kind(parts, kind) for kind in (Residual, Amount, Patches))
        off = (red.found - red.expected) / red.sd
        assert asked.number(state) == pytest.approx(math.log(rho.value + math.exp(-0.5 * off**2)), abs=1e-12)
        pixel = patch.found_rgb[5, 5].astype(float)
        assert red.found == pixel[0] / pixel.sum()
    outside = np.array([-50.0, 1e9, 0.0, 0.0])
    parts = asked.parts(outside)
    assert math.isnan(of_kind(parts, Residual)[0].found)
    assert of_kind(parts, Patches)[0].found_rgb.size == 0
    assert asked.number(outside) == pytest.approx(math.log(0.1))


def test_a_window_is_as_likely_as_its_histogram_is_like_the_models() -> None:
    """The number at a place follows from both histograms, by the coefficient of Bhattacharyya.

    With other parameters than those of the frame the likelihood is another one, though no step was taken.
    """
    asked = Asked("histogram")
    number, parts = asked.number(asked.centre), asked.parts(asked.centre)
    (counted,) = of_kind(parts, Histograms)
    rho, sharpness = (part.value for part in of_kind(parts, Amount))
    assert rho == pytest.approx(np.sqrt(np.multiply(counted.expected, counted.found)).sum(), abs=1e-12)
    assert number == pytest.approx(-sharpness * (1.0 - rho), abs=1e-12)
    assert sum(counted.expected) == pytest.approx(1.0)
    flat = asked.step.parameters.model_copy(update={"sharpness": 0.0, "colour_space": "lab"})
    assert asked.number(asked.centre, flat) == 0.0 > number


def test_an_innovation_is_told_beside_its_deviation() -> None:
    """The squared residuals of the ball's Kalman filter, in deviations, come to the normalised innovation squared."""
    run = looked_at("ball", "kalman")
    look = Inspection(run)
    residuals, (*gains, nis) = (of_kind(look.update_parts(), kind) for kind in (Residual, Amount))
    off = [(part.found - part.expected) / part.sd for part in residuals]
    (course,) = look.courses()
    assert (course.title, course.limit, course.first, len(course.values)) == (nis.title, nis.limit, 0, 7)
    assert math.isnan(course.values[0])
    assert course.values[6] == nis.value
    # Both axes are alike and independent of each other.
    assert nis.value == pytest.approx(np.square(off).sum(), rel=1e-6)
    assert nis.limit == pytest.approx(-2.0 * math.log(0.05))
    for part, gain, now in zip(residuals, gains, run.current.state.estimate, strict=True):
        assert 0.0 < gain.value < 1.0
        assert now == pytest.approx(part.expected + gain.value * (part.found - part.expected))


@pytest.mark.parametrize(("tracker", "chooses"), [("pf-asd", True), ("rb-pf", False)])
def test_features_have_their_shares_in_the_pose(tracker: str, chooses: bool) -> None:
    """Shares sum to 100 %, residuals are what the arrows show, and an alpha is given where there is a choice."""
    (part,) = Inspection(looked_at("prism", tracker)).update_parts()
    rows, arrows = np.array(part.rows), np.array(part.arrows)
    assert rows[:, 5].sum() == pytest.approx(100.0)
    assert np.isfinite(rows[:, 4]).all() == chooses
    assert arrows[:, 2:] - arrows[:, :2] == pytest.approx(5.0 * rows[:, :2])


def test_a_filter_in_a_file_is_asked_by_its_own_likelihood() -> None:
    """A file that defines one is asked for it; one that does not, for that which stands in for it."""
    own = "import numpy as np\ndef log_likelihood(states, frame, parameters):\n    return -0.5 * states[:, 0]\n"
    none = "import numpy as np\ndef should_resample(log_weights):\n    return True\n"
    for text, title in ((own, "the file's likelihood"), (none, "colour")):
        trust(text)
        experiment = extend("ball", {"mine": (text,)})
        run = Run(experiment, widen(experiment.simulate(), {"mine": (text,)}), tracker="mine", seed=5, frames=4)
        run.seek(3)
        finding = Inspection(run).at_place(np.array([40.0, 50.0]))
        assert finding.title.startswith(title)
        assert (finding.log_likelihood == -20.0) == (text == own)
        assert Inspection(run).genealogy() is not None


@pytest.mark.parametrize(("experiment", "tracker"), [("linkage", "ellipsoids"), ("hand", "beam")])
def test_hypotheses_are_laid_open_like_particles(experiment: str, tracker: str) -> None:
    """Each has a weight and a place among the others, and the step tells of each range or pose what became of it."""
    looked = Inspection(looked_at(experiment, tracker, 4))
    assert looked.at_particle(0).particle.count == len(looked.cloud)
    (part,) = of_kind(looked.update_parts(), Contributions)
    assert all(len(row) == len(part.columns) for row in part.rows)
    if experiment == "linkage":
        low, high, _, width, _ = np.array(part.rows).T
        assert width == pytest.approx(high - low)
