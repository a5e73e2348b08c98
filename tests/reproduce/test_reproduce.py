"""Published results, computed again; the cheap ones always, the others in `make test-all`."""

import pytest

from pftrack.core.refusal import RefusedError
from pftrack.reproduce import RESULTS, reproduce
from tests.pooling import fork_server, shared_fork_server

__all__ = ["fork_server", "shared_fork_server"]

CHEAP = "one-step"


def test_a_cheap_result_holds_and_jobs_do_not_change_it() -> None:
    """Every finding lies within its tolerance, in one process or two, and all work is told as a share of its cost."""
    told: list[float] = []
    findings = reproduce([CHEAP], progress=lambda done, known: told.append(done / known))
    assert findings
    assert [finding for finding in findings if finding.verdict in {"differs", "better"}] == []
    assert told == pytest.approx([done / 6 for done in range(1, 7)])
    assert reproduce([CHEAP], jobs=2) == findings


def test_another_holds_on_few_trials() -> None:
    """A fifth of the trials is enough for the mean errors and the spread of the Kalman filter on a sine."""
    findings = reproduce(["kalman-sine"])
    assert [finding.verdict for finding in findings if finding.verdict != "not run"] == ["reproduced"] * 4
    assert [finding.result for finding in findings[4:]] == [name for name in RESULTS if name != "kalman-sine"]


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in RESULTS if name != CHEAP])
def test_quick_results_hold(name: str) -> None:
    """No finding of the study, run with fewer trials, is outside its tolerance."""
    findings = reproduce([name], jobs=2)
    assert [finding for finding in findings if finding.fails] == []


def test_unknown_results_are_refused() -> None:
    """A result that there is not is refused with those that there are."""
    with pytest.raises(RefusedError, match=r"result must be one of kalman-sine, .*, got 'cold-fusion'"):
        reproduce(["cold-fusion"])
