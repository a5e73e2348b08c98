"""The experiment keeps what every experiment promises, and finds the disc again."""

import pytest
from pftrack_turning.experiment import EXPERIMENT

from pftrack.runs.run import Run
from pftrack.testing import Check, experiment_checks


@pytest.mark.parametrize("check", experiment_checks(EXPERIMENT), ids=str)
def test_it_keeps_what_every_experiment_promises(check: Check) -> None:
    """What `pftrack.testing` checks holds."""
    check()


def test_only_the_bank_finds_the_disc_where_it_comes_out() -> None:
    """After two laps the bank is at the disc, and the filter that goes straight on is not."""
    runs = [Run(EXPERIMENT, EXPERIMENT.simulate(), tracker=tracker) for tracker in ("bank", "straight")]
    bank, straight = (run.finish().diagnostics.error for run in runs)
    assert bank < 5 < straight
