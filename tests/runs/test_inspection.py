"""Looking into a run: places, particles, and where they come from."""

import numpy as np
import pytest

from pftrack.core.refusal import ParameterError
from pftrack.experiments import find
from pftrack.experiments.prism.scene import NAMES
from pftrack.runs.inspection import GENERATIONS, Inspection
from pftrack.runs.run import Run
from tests.making import whole_run

BALL, PRISM = find("ball"), find("prism")


@pytest.fixture(scope="module")
def steps() -> tuple[Run, list]:
    """Return a run of 45 frames and its steps."""
    run = Run(BALL, BALL.simulate(), tracker="h-spf", seed=3, frames=45)
    return run, list(run)


def test_a_particle_is_followed_to_its_ancestors(steps: tuple[Run, list]) -> None:
    """Its path goes over the places of its ancestors, as the states of those frames have them, and the run stays."""
    run, known = steps
    run.seek(40)
    found = Inspection(run).at_particle(17)
    assert run.position == 40
    own, cloud = found.particle, known[40].state.particles
    assert (own.count, own.weight) == (800, np.exp(cloud.log_weights[17]))
    assert own.sampler in {"prediction", "observation"}
    assert len(own.ancestors) == GENERATIONS - 1
    assert own.path.shape == (GENERATIONS, 2)
    assert own.descendants[0] == (known[41].state.particles.ancestors == 17).sum()
    place = 17
    for step, ancestor, where in zip(known[39:10:-1], own.ancestors, own.path[1:], strict=True):
        place = int(known[step.frame.index + 1].state.particles.ancestors[place])
        assert place == ancestor
        assert (where == step.state.particles.states[place, :2]).all()


def test_a_pinned_particle_is_followed_to_and_fro(steps: tuple[Run, list]) -> None:
    """Frames back it is its ancestor; frames on its heaviest child; too far away, or without children, it is nobody."""
    run, known = steps
    run.seek(20)
    assert Inspection(run).follow(5, 20) == 5
    assert Inspection(run).follow(5, 21) == known[21].state.particles.ancestors[5]
    parents = known[20].state.particles.ancestors
    child = Inspection(run).follow(int(parents[5]), 19)
    siblings = np.flatnonzero(parents == parents[5])
    assert child in siblings
    assert known[20].state.particles.log_weights[child] == known[20].state.particles.log_weights[siblings].max()
    barren = int(np.setdiff1d(np.arange(800), parents)[0])
    assert Inspection(run).follow(barren, 19) is None
    run.seek(0)
    assert Inspection(run).follow(0, GENERATIONS) is None


def test_a_place_is_asked_with_the_values_in_force(steps: tuple[Run, list]) -> None:
    """A change that counts from the next frame on shows in what the likelihood says of this one, at once."""
    run, known = steps
    branch = run.branch(10)
    looked, place = Inspection(branch), np.array([5.0, 5.0])
    before = looked.at_place(place)
    assert before.title == "colour of the pixel"
    assert {part.name: value for part, value in before.state}["u"] == 5.0
    branch.change({"background_level": 0.5})
    assert looked.at_place(place).log_likelihood > before.log_likelihood
    assert looked.map((320, 240)).range[0] == pytest.approx(np.log(0.5))
    near = looked.nearest(known[10].state.particles.states[3, :2])
    assert (known[10].state.particles.states[near, :2] == known[10].state.particles.states[3, :2]).all()


def test_each_feature_has_a_genealogy_of_its_own() -> None:
    """Features that follow their own past descend from their own particles alone; those from the solid begin a line."""
    run = whole_run(PRISM, tracker="alpha-0", seed=3, frames=12, values={"joint_sample_count": 500})
    looked, cloud = Inspection(run), PRISM.trackers["alpha-0"].cloud(run.current.state)
    found = looked.at_particle(170)
    own = found.particle
    assert (own.filter, own.number, own.count, own.sampler) == (NAMES[3], 20, 50, "the feature's own past")
    assert own.rank <= 50
    assert (len(own.ancestors), own.begins) == (11, None)
    assert np.array_equal(own.path[1], cloud.states[170, 2:])
    assert found.log_likelihood == cloud.log_likelihoods[170]
    lineage = looked.genealogy(170)
    assert (lineage.places.shape, looked.genealogy().places.shape) == ((12, 50), (12, 400))
    assert set(np.unique(lineage.places[0] // 50)) == {3}
    looked = Inspection(whole_run(PRISM, tracker="alpha-1", seed=3, frames=5, values={"joint_sample_count": 500}))
    own = looked.at_particle(7).particle
    assert (own.sampler, own.ancestors, own.begins) == ("the solid's pose", (), 4)
    assert list(looked.genealogy().frames) == [4]


def test_what_cannot_be_asked_is_refused(steps: tuple[Run, list]) -> None:
    """A missing particle and a tracker without a likelihood are refused; frame 0 has no frame before it."""
    steps[0].seek(0)
    looked = Inspection(steps[0])
    assert looked.at_estimate().log_likelihood is not None
    assert looked.at_particle(1).particle.ancestors == ()
    assert list(looked.genealogy().frames) == [0]
    with pytest.raises(ParameterError, match="below 800"):
        looked.at_particle(800)
    sine = find("sine")
    signal = Inspection(Run(sine, sine.simulate(), tracker="kalman", frames=3))
    with pytest.raises(ParameterError, match="no likelihood of places"):
        signal.at_place(np.zeros(2))
    assert (signal.genealogy(), signal.map((10, 10))) == (None, None)
