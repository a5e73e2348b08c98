"""Published results, computed again; the cheap ones always, the others in `make test-all`."""

from typing import NamedTuple

import pytest

from pftrack.core.refusal import RefusedError
from pftrack.reproduce import RESULTS, reproduce
from pftrack.reproduce.finding import Finding
from tests.pooling import fork_server, shared_fork_server

__all__ = ["fork_server", "shared_fork_server"]

CHEAP = "one-step"


class Computed(NamedTuple):
    """What came of a result, and what was told on the way: work done, out of that known so far."""

    findings: list[Finding]
    told: list[tuple[float, float]]


@pytest.fixture(scope="module")
def cheap() -> Computed:
    told: list[tuple[float, float]] = []
    return Computed(reproduce([CHEAP], progress=lambda done, known: told.append((done, known))), told)


def test_a_cheap_result_holds(cheap: Computed) -> None:
    """Every finding of the study lies within its tolerance."""
    assert cheap.findings
    assert [finding for finding in cheap.findings if finding.verdict in {"differs", "better"}] == []


def test_another_holds_on_few_trials() -> None:
    """Of the Kalman filter on a sine a fifth of the trials is enough for its mean errors and its spread."""
    findings = reproduce(["kalman-sine"])
    computed = [finding for finding in findings if finding.verdict != "not run"]
    assert [finding.verdict for finding in computed] == ["reproduced"] * 4
    assert [finding.result for finding in findings[4:]] == [name for name in RESULTS if name != "kalman-sine"]


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in RESULTS if name != CHEAP])
def test_quick_results_hold(name: str) -> None:
    """No finding of the study, run with fewer trials, is outside its tolerance."""
    findings = reproduce([name], jobs=2)
    assert [finding for finding in findings if finding.fails] == []


def test_jobs_do_not_change_results(cheap: Computed) -> None:
    """Spread over processes the findings are the same as in one."""
    assert reproduce([CHEAP], jobs=2) == cheap.findings


def test_progress_is_told(cheap: Computed) -> None:
    """Every piece of work done is told, as a share of what all is taken to cost."""
    assert [done / total for done, total in cheap.told] == pytest.approx([done / 6 for done in range(1, 7)])


def test_unknown_results_are_refused() -> None:
    """A result that there is not is refused with those that there are."""
    with pytest.raises(RefusedError, match=r"result must be one of kalman-sine, .*, got 'cold-fusion'"):
        reproduce(["cold-fusion"])
