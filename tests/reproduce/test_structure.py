"""What is claimed for the shape of prism and face, on few trials; the figures are with those of all studies."""

import numpy as np

from pftrack.reproduce.structure import Trial, draw, grow, online, run_trial

PRISM = [Trial("prism", seed) for seed in range(2)]


def test_weights_beat_equal_ones_and_the_recursion_beats_both() -> None:
    """Hidden points spoil the singular values, not the variational method; the recursion knows the perspective too."""
    courses = [run_trial(trial) for trial in PRISM]
    assert all(one.recursive[-1] < 0.5 * one.batch < 0.1 * one.svd for one in courses)
    assert all((np.diff(one.energies) > 0.0).all() for one in courses)


def test_forgetting_by_information_keeps_what_was_seen() -> None:
    """In the last step the online error is less than half of that with the common forgetting."""
    for trial in PRISM:
        common, own = online(trial, 0.5, "common"), online(trial, 1.0, "by-information")
        assert own.steps[-1] < 0.5 * common.steps[-1]
        assert len(own.steps) == 360 - 90 + 1


def test_a_face_that_grows_gives_the_better_pose() -> None:
    """From the mean face the own one comes within a third of its distance, and the pose by it is better."""
    outcome = grow(Trial(99, 0))
    assert outcome.own_mm < outcome.mean_mm / 3.0
    assert outcome.pose_deg[1] < outcome.pose_deg[0]
    assert outcome.weight[-1] > 0.9


def test_figures_are_drawn() -> None:
    """Figures 4.21 to 4.24 are those of the prism, 4.26 and 4.27 those of the face."""
    trial = PRISM[0]
    common, own = [online(trial, 0.5, "common")], [online(trial, 1.0, "by-information")]
    courses = [run_trial(trial)]
    assert [name.split("-")[1] for name in draw("prism", courses, common, own)] == ["4.21", "4.22", "4.23", "4.24"]
    assert {name.split("-")[1] for name in draw("face", courses, common, own)} == {"4.26", "4.27"}
