"""What holds for every experiment holds for the project's own."""

import pytest

from pftrack.experiments import EXPERIMENTS
from pftrack.testing import Check, experiment_checks

CHECKS = [
    pytest.param(check, id=f"{name}: {check}")
    for name in EXPERIMENTS.own
    for check in experiment_checks(EXPERIMENTS[name])
]


@pytest.mark.parametrize("check", CHECKS)
def test_it_keeps_what_every_experiment_promises(check: Check) -> None:
    """Every check that `pftrack.testing` has for an experiment passes."""
    check()
