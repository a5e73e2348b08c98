"""What is claimed for the shape of the prism, on one trial, and the figures of prism and face."""

import numpy as np

from pftrack.reproduce.structure import Trial, draw, online, run_trial


def test_the_claims_hold_and_are_drawn() -> None:
    """Weights beat equal ones, the recursion beats both, and forgetting by information keeps what was seen.

    Figures 4.21 to 4.24 are those of the prism, 4.26 and 4.27 those of the face.
    """
    trial = Trial("prism", 0)
    course, common, own = run_trial(trial), online(trial, 0.5, "common"), online(trial, 1.0, "by-information")
    assert course.recursive[-1] < 0.5 * course.batch < 0.1 * course.svd
    assert (np.diff(course.energies) > 0.0).all()
    assert own.steps[-1] < 0.5 * common.steps[-1]
    names = [draw(kind, [course], [common], [own]) for kind in ("prism", "face")]
    found = [[name.split("-")[1] for name in each] for each in names]
    assert (found[0], set(found[1])) == (["4.21", "4.22", "4.23", "4.24"], {"4.26", "4.27"})
