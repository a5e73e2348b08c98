"""Published results, computed again; the cheap ones always, the others in `make test-all`."""

import pytest

from pftrack.core.refusal import RefusedError
from pftrack.reproduce import RESULTS, reproduce
from tests.pooling import fork_server, shared_fork_server

__all__ = ["fork_server", "shared_fork_server"]

CHEAP = ["one-step", "kalman-sine", "pose-filters", "hand-steps", "linkage-algebra", "linkage-strips"]
"""Computed in less than two seconds."""


def test_cheap_results_hold() -> None:
    """Every finding lies within its tolerance, or is better; all work is told as a share of its cost.

    Two processes have the findings of one. What was not asked for comes last, as not run.
    """
    told: list[float] = []
    findings = reproduce(CHEAP[:1], progress=lambda done, known: told.append(done / known))
    assert told == pytest.approx([done / 6 for done in range(1, 7)])
    others = reproduce(CHEAP[1:])
    assert [finding.result for finding in others if finding.verdict == "not run"] == [
        name for name in RESULTS if name not in CHEAP[1:]
    ]
    assert [finding.result for finding in (*findings, *others) if finding.verdict == "differs"] == []
    two = reproduce(["hand-steps"], jobs=2)
    assert [finding for finding in two if finding.verdict != "not run"] == [
        finding for finding in others if finding.result in {found.result for found in two} - RESULTS.keys()
    ]


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in RESULTS if name not in CHEAP])
def test_quick_results_hold(name: str) -> None:
    """No finding of the study, run with fewer trials, is outside its tolerance."""
    findings = reproduce([name], jobs=2)
    assert [finding for finding in findings if finding.fails] == []


def test_unknown_results_are_refused() -> None:
    """A result that there is not is refused with those that there are."""
    with pytest.raises(RefusedError, match=r"result must be one of kalman-sine, .*, got 'cold-fusion'"):
        reproduce(["cold-fusion"])
