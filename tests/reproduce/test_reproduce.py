"""Published results, computed again; the cheap ones always, the others in `make test-all`."""

import math
from typing import NamedTuple

import pytest

from pftrack.reproduce import RESULTS, reproduce, signals
from pftrack.reproduce.finding import Finding, claim, compare
from tests.pooling import fork_server, shared_fork_server

__all__ = ["fork_server", "shared_fork_server"]

CHEAP = "one-step"


class Computed(NamedTuple):
    """What came of a result, and what was told on the way: work done, out of that known so far."""

    findings: list[Finding]
    told: list[tuple[int, int]]


@pytest.fixture(scope="module")
def cheap() -> Computed:
    told: list[tuple[int, int]] = []
    return Computed(reproduce([CHEAP], progress=lambda done, known: told.append((done, known))), told)


def test_a_cheap_result_holds(cheap: Computed) -> None:
    """Every finding of the study lies within its tolerance."""
    assert cheap.findings
    assert [finding for finding in cheap.findings if finding.status != "pass"] == []


def test_another_holds_on_few_trials(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the Kalman filter on a sine a fifth of the trials is enough for its mean errors and its spread."""
    monkeypatch.setattr(signals, "QUICK_TRIALS_OF_KALMAN", 40)
    findings = reproduce(["kalman-sine"])
    assert len(findings) == 4
    assert [finding for finding in findings if finding.status != "pass"] == []


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in RESULTS if name != CHEAP])
def test_quick_results_hold(name: str) -> None:
    """No finding of the study, run with fewer trials, is outside its tolerance."""
    findings = reproduce([name], jobs=2)
    assert [finding for finding in findings if finding.status == "fail"] == []


def test_jobs_do_not_change_results(cheap: Computed) -> None:
    """Spread over processes the findings are the same as in one."""
    assert reproduce([CHEAP], jobs=2) == cheap.findings


def test_progress_is_told(cheap: Computed) -> None:
    """Every piece of work done is told, out of those known so far."""
    assert cheap.told == [(done, 6) for done in range(1, 7)]


def test_unknown_results_are_refused() -> None:
    """A result that there is not is refused with those that there are."""
    with pytest.raises(LookupError, match="no result 'cold-fusion'; there are kalman-sine"):
        reproduce(["cold-fusion"])


def test_findings_are_judged_honestly() -> None:
    """Outside the tolerance fails, no number fails, and an unconfirmed claim that does not hold is a known negative."""
    assert compare("x", 1.04, 1.0, 0.05, "here").status == "pass"
    assert compare("x", 1.06, 1.0, 0.05, "here").status == "fail"
    nothing = compare("x", math.nan, 1.0, 0.05, "here")
    assert nothing.status == "fail"
    assert nothing.as_dict()["ours"] is None
    assert compare("x", 1.06, 1.0, 0.05, "here", confirmed=False).status == "known-negative"
    assert compare("x", 1.04, 1.0, 0.05, "here", confirmed=False).status == "pass"
    assert claim("x", 1.0, holds=False, source="here").status == "fail"
    assert claim("x", 1.0, holds=False, source="here", confirmed=False).status == "known-negative"
    assert claim("x", 1.0, holds=True, source="here", confirmed=False).status == "pass"
