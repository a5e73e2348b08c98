"""What holds for every experiment holds for the project's own."""

import pytest

from pftrack.experiments import EXPERIMENTS
from pftrack.testing import Check, experiment_checks

ELSEWHERE = "another process gives the same numbers"
"""`tests/test_same_bits.py` shows as much of every tracker; one experiment remains here."""


def marks(name: str, check: Check) -> tuple[pytest.MarkDecorator, ...]:
    return (pytest.mark.slow,) if check.name == ELSEWHERE and name != "sine" else ()


CHECKS = [
    pytest.param(check, id=f"{name}: {check}", marks=marks(name, check))
    for name in EXPERIMENTS.own
    for check in experiment_checks(EXPERIMENTS[name])
]


MANY = [
    pytest.param(check, id=f"{name}: {check}")
    for name in EXPERIMENTS.own
    for check in experiment_checks(EXPERIMENTS[name], thorough=True)
    if check.name.startswith("bands of many runs")
]


@pytest.mark.slow
@pytest.mark.parametrize("check", MANY)
def test_bands_of_many_runs_are_to_be_believed(check: Check) -> None:
    """Over forty seeds of the default scene and two presets, or it is declared; `tools.coverage` has the figures."""
    check()


def test_what_another_process_comes_to_is_a_check() -> None:
    """It has the name by which it is chosen here, once for each experiment."""
    assert [param.values[0].name for param in CHECKS].count(ELSEWHERE) == len(EXPERIMENTS.own)


@pytest.mark.parametrize("check", CHECKS)
def test_it_keeps_what_every_experiment_promises(check: Check) -> None:
    """Every check that `pftrack.testing` has for an experiment passes."""
    check()
