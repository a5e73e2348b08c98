"""What likelihoods say at chosen places, and what they say that it is made of."""

import math

import numpy as np
import pytest

from pftrack.core.model.likelihood import Amount, Contributions, Histograms, Part, Patches, Residual
from pftrack.experiments import find
from pftrack.experiments.own.code import trust
from pftrack.experiments.own.extension import extend, widen
from pftrack.runs.inspection import Inspection
from pftrack.runs.run import Run


def looked_at(experiment: str, tracker: str, frame: int = 6) -> tuple[Run, object, object]:
    """Return a run at a frame, its tracker's likelihood, and the state before as that wants it."""
    found = find(experiment)
    run = Run(found, found.simulate(), tracker=tracker, seed=5, frames=frame + 1)
    run.seek(frame)
    likelihood = found.trackers[tracker].model
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
        (state,) = likelihood.put(centre, place[None], before)
        (number,) = likelihood.evaluate(before, state[None], step.frame, step.parameters)
        parts = likelihood.parts(state, step.frame, step.parameters, before)
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
    parts = likelihood.parts(state, step.frame, step.parameters, before)
    assert math.isnan(of_kind(parts, Residual)[0].found)
    assert of_kind(parts, Patches)[0].found_rgb.size == 0
    assert likelihood.evaluate(before, state[None], step.frame, step.parameters)[0] == pytest.approx(math.log(0.1))


def test_a_window_is_as_likely_as_its_histogram_is_like_the_models() -> None:
    """The number at a place follows from both histograms, by the coefficient of Bhattacharyya."""
    run, likelihood, before = looked_at("histogram", "condensation")
    step = run.current
    state = likelihood.centre(step.state)
    (number,) = likelihood.evaluate(before, state[None], step.frame, step.parameters)
    parts = likelihood.parts(state, step.frame, step.parameters, before)
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
    assert likelihood.evaluate(before, state, step.frame, flat)[0] == 0.0
    assert likelihood.evaluate(before, state, step.frame, step.parameters)[0] < 0.0


def test_an_innovation_is_told_beside_its_deviation() -> None:
    """The squared residuals of the ball's Kalman filter, in deviations, come to the normalised innovation squared."""
    found = find("ball")
    run = Run(found, found.simulate(), tracker="kalman", seed=5, frames=7)
    run.seek(6)
    parts = Inspection(run).update_parts()
    residuals = of_kind(parts, Residual)
    (*gains, nis) = of_kind(parts, Amount)
    off = [(part.found - part.expected) / part.sd for part in residuals]
    (course,) = Inspection(run).courses()
    assert (course.title, course.limit, course.first, len(course.values)) == (nis.title, nis.limit, 0, 7)
    assert math.isnan(course.values[0])
    assert course.values[6] == nis.value
    # Both axes are alike and independent of each other.
    assert nis.value == pytest.approx(np.square(off).sum(), rel=1e-6)
    assert nis.limit == pytest.approx(-2.0 * math.log(0.05))
    assert all(0.0 < gain.value < 1.0 for gain in gains)
    for part, gain, now in zip(residuals, gains, run.current.state.estimate, strict=True):
        assert now == pytest.approx(part.expected + gain.value * (part.found - part.expected))


def test_features_have_their_shares_in_the_pose() -> None:
    """Shares sum to 100 %, residuals are what the arrows show, and an alpha is given where there is a choice."""
    for tracker, chooses in (("pf-asd", True), ("rb-pf", False)):
        found = find("prism")
        run = Run(found, found.simulate(), tracker=tracker, seed=5, frames=7)
        run.seek(6)
        (part,) = Inspection(run).update_parts()
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


@pytest.mark.parametrize(
    ("experiment", "tracker"), [("linkage", "ellipsoids"), ("linkage", "ekf-mirrors"), ("hand", "beam")]
)
def test_hypotheses_are_laid_open_like_particles(experiment: str, tracker: str) -> None:
    """Each has a weight and a place among the others, and the step tells of each range or pose what became of it."""
    found = find(experiment)
    run = Run(found, found.simulate(), tracker=tracker, seed=5, frames=5)
    run.seek(4)
    looked = Inspection(run)
    assert looked.at_particle(0).particle.count == len(looked.cloud)
    (part,) = of_kind(looked.update_parts(), Contributions)
    assert all(len(row) == len(part.columns) for row in part.rows)
    if experiment == "linkage":
        low, high, _, width, _ = np.array(part.rows).T
        assert width == pytest.approx(high - low)


def test_joint_particles_of_a_pose_have_ancestors() -> None:
    """Each is all points at once, lies in the middle of them, and its path leads over the middles of its ancestors."""
    found = find("prism")
    run = Run(found, found.simulate(), tracker="rb-pf", seed=5, frames=5)
    run.change({"joint_sample_count": 300})
    run.seek(4)
    look = Inspection(run)
    cloud, lineage = look.cloud, look.genealogy()
    particle = look.nearest(cloud.places[7])
    assert particle is not None
    told = look.at_particle(particle)
    assert told.place is not None
    assert len(told.state) == 16
    assert told.place == pytest.approx(np.reshape([value for _, value in told.state], (8, 2)).mean(axis=0))
    assert told.particle.path.shape == (1 + len(told.particle.ancestors), 2)
    assert (lineage.counts[:-1] <= 300).all()
