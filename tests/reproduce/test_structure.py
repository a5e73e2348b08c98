"""What is claimed for the shape of prism and face, on few trials; the figures are with those of all studies."""

import numpy as np
import pytest

from pftrack.reproduce.structure import OnlineResult, Trial, TrialResult, draw, grow, online, run_trial

PRISM = [Trial("prism", seed) for seed in range(2)]


@pytest.fixture(scope="module")
def courses() -> list[TrialResult]:
    return [run_trial(trial) for trial in PRISM]


@pytest.fixture(scope="module")
def forgetting() -> list[tuple[OnlineResult, OnlineResult]]:
    """What is online with the common forgetting, and with that by information."""
    return [(online(trial, 0.5, "common"), online(trial, 1.0, "by-information")) for trial in PRISM]


def test_weights_beat_equal_ones_and_the_recursion_beats_both(courses: list[TrialResult]) -> None:
    """Hidden points spoil the singular values, not the variational method; the recursion knows the perspective too."""
    assert all(one.recursive[-1] < 0.5 * one.batch < 0.1 * one.svd for one in courses)
    assert all((np.diff(one.energies) > 0.0).all() for one in courses)


def test_forgetting_by_information_keeps_what_was_seen(forgetting: list[tuple[OnlineResult, OnlineResult]]) -> None:
    """In the last step the online error is less than half of that with the common forgetting."""
    for common, own in forgetting:
        assert own.steps[-1] < 0.5 * common.steps[-1]
        assert len(own.steps) == 360 - 90 + 1


def test_figures_are_drawn(courses: list[TrialResult], forgetting: list[tuple[OnlineResult, OnlineResult]]) -> None:
    """Figures 4.21 to 4.24 are those of the prism, 4.26 and 4.27 those of the face."""
    common, own = ([each] for each in forgetting[0])
    names = [draw(kind, courses[:1], common, own) for kind in ("prism", "face")]
    found = [[name.split("-")[1] for name in each] for each in names]
    assert (found[0], set(found[1])) == (["4.21", "4.22", "4.23", "4.24"], {"4.26", "4.27"})


def test_a_face_that_grows_gives_the_better_pose() -> None:
    """From the mean face the own one comes within a third of its distance, and the pose by it is better."""
    outcome = grow(Trial(99, 0))
    assert outcome.own_mm < outcome.mean_mm / 3.0
    assert outcome.pose_deg[1] < outcome.pose_deg[0]
    assert outcome.weight[-1] > 0.9
