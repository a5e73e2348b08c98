"""The project's own experiments pass every check of `pftrack.testing`."""

import pytest

from pftrack.experiments import EXPERIMENTS
from pftrack.testing import Check, experiment_checks

ALIKE = {
    "head": ["alpha-1", "alpha-0"],
    "fish": ["constant-velocity"],
    "prism": ["alpha-1", "alpha-0"],
    "linkage": ["ekf-truncated", "ellipsoids-literal"],
}
"""Trackers that are another one's code with a setting of their own: with them checks repeat themselves."""


def marks(name: str, check: Check) -> tuple[pytest.MarkDecorator, ...]:
    """Return the mark of a slow check.

    Bands need several runs of each tracker; `tests/tools/test_coverage.py` compares what was measured of them with what
    is declared. `tests/test_same_bits.py` holds that another process gives the same numbers for every tracker, so only
    one experiment is checked for it here.
    """
    elsewhere = check.name == "another process gives the same numbers" and name != "sine"
    alike = check.name.endswith(tuple(f"({tracker})" for tracker in ALIKE.get(name, [])))
    return (pytest.mark.slow,) if elsewhere or alike or check.name.startswith("bands ") else ()


CHECKS = [
    pytest.param(check, id=f"{name}: {check}", marks=marks(name, check))
    for name in EXPERIMENTS.own
    for check in experiment_checks(EXPERIMENTS[name], thorough=True)
]


@pytest.mark.parametrize("check", CHECKS)
def test_it_keeps_what_every_experiment_promises(check: Check) -> None:
    """Every check of `pftrack.testing` passes."""
    check()
