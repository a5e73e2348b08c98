"""The experiment keeps what every experiment promises, and finds the disc again."""

import pytest
from pftrack_turning import EXPERIMENT

from pftrack.runs.run import Run
from pftrack.testing import Check, experiment_checks


@pytest.mark.parametrize("check", experiment_checks(EXPERIMENT), ids=str)
def test_it_keeps_what_every_experiment_promises(check: Check) -> None:
    """The checks of `pftrack.testing` pass."""
    check()


def test_only_particles_that_turn_find_the_disc_where_it_comes_out() -> None:
    """After two laps one filter is at the disc, and the one that expects no turn is not."""
    turning, straight = (Run(EXPERIMENT, EXPERIMENT.simulate(), tracker=name).finish() for name in EXPERIMENT.trackers)
    assert turning.diagnostics.error < 5 < straight.diagnostics.error
