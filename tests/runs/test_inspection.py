"""Looking into a run: places, particles, and where they come from."""

from itertools import pairwise

import numpy as np
import pytest

from pftrack.core.model.likelihood import Cloud
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


def prism(tracker: str, frames: int) -> tuple[Run, list[Cloud]]:
    """Return a finished run of the prism, and the particles of its frames."""
    run = whole_run(PRISM, tracker=tracker, seed=3, frames=frames, values={"joint_sample_count": 500})
    found = [PRISM.trackers[tracker].cloud(step.state) for step in run.replay(0, frames - 1)]
    return run, [cloud for cloud in found if cloud is not None]


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
    place = 17
    for step, ancestor, where in zip(known[39:10:-1], own.ancestors, own.path[1:], strict=True):
        place = int(known[step.frame.index + 1].state.particles.ancestors[place])
        assert place == ancestor
        assert (where == step.state.particles.states[place, :2]).all()


def test_joint_particles_are_weighed_by_their_likelihood() -> None:
    """A weight is the likelihood that is told, times the parent's weight where no parents were drawn."""
    run, clouds = prism("rb-pf", 8)
    assert clouds[0].log_likelihoods is None
    for before, cloud in pairwise(clouds[1:]):
        prior = 0.0 if cloud.resampled else before.log_weights[cloud.ancestors]
        weighed = np.exp(cloud.log_likelihoods + prior - (cloud.log_likelihoods + prior).max())
        assert np.allclose(weighed / weighed.sum(), np.exp(cloud.log_weights), atol=1e-12)
    run.seek(6)
    assert Inspection(run).at_particle(3).log_likelihood == clouds[6].log_likelihoods[3]


def test_descendants_are_those_of_frames_that_were_computed(steps: tuple[Run, list]) -> None:
    """The particles of a frame have together as many descendants as there are particles, and the newest have none."""
    run, _ = steps
    run.seek(42)
    looked = Inspection(run)
    first = [looked.at_particle(particle).particle.descendants for particle in range(800)]
    assert np.sum(first, axis=0).tolist() == [800, 800]
    run.seek(44)
    assert Inspection(run).at_particle(0).particle.descendants == ()


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
    """Features that follow their own past descend from the particles of theirs alone, and were where these are."""
    run, clouds = prism("alpha-0", 12)
    for before, cloud in pairwise(clouds):
        assert np.array_equal(cloud.states[:, 2:], before.states[cloud.ancestors, :2])
        assert np.array_equal(cloud.ancestors // 50, np.arange(400) // 50)
    looked = Inspection(run)
    found = looked.at_particle(170)
    own = found.particle
    assert (own.filter, own.number, own.count, own.sampler) == (NAMES[3], 20, 50, "the feature's own past")
    assert own.rank <= 50
    assert (len(own.ancestors), own.begins) == (11, None)
    assert np.array_equal(own.path[1], clouds[-1].states[170, 2:])
    assert found.log_likelihood == clouds[-1].log_likelihoods[170]
    lineage = looked.genealogy(170)
    assert (lineage.places.shape, looked.genealogy().places.shape) == ((12, 50), (12, 400))
    assert set(np.unique(lineage.places[0] // 50)) == {3}


def test_particles_from_the_solid_have_no_parents() -> None:
    """Where all particles are drawn from the solid's pose each is the beginning of its line."""
    looked = Inspection(prism("alpha-1", 5)[0])
    own = looked.at_particle(7).particle
    assert (own.sampler, own.ancestors, own.begins) == ("the solid's pose", (), 4)
    assert list(looked.genealogy().frames) == [4]


def test_frame_0_has_no_frame_before(steps: tuple[Run, list]) -> None:
    """At the beginning the estimate can be asked, particles have no ancestors, and the genealogy is one frame long."""
    steps[0].seek(0)
    looked = Inspection(steps[0])
    assert looked.at_estimate().log_likelihood is not None
    assert looked.at_particle(1).particle.ancestors == ()
    assert list(looked.genealogy().frames) == [0]


def test_what_cannot_be_asked_is_refused(steps: tuple[Run, list]) -> None:
    """A particle that is not there and a tracker without a likelihood are refused by a sentence."""
    with pytest.raises(ParameterError, match="below 800"):
        Inspection(steps[0]).at_particle(800)
    sine = find("sine")
    signal = Inspection(Run(sine, sine.simulate(), tracker="kalman", frames=3))
    with pytest.raises(ParameterError, match="no likelihood of places"):
        signal.at_place(np.zeros(2))
    assert (signal.genealogy(), signal.map((10, 10))) == (None, None)
