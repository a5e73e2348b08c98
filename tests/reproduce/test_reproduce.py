"""Published results, computed again; the cheap ones always, the others in `make test-all`."""

import math
from typing import NamedTuple

import pytest

from pftrack.reproduce import RESULTS, reproduce, signals
from pftrack.reproduce.finding import (
    CHOSEN,
    PROTOCOL,
    Finding,
    Own,
    Unexplained,
    claim,
    compare,
    describe_verdicts,
    not_run,
)
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


def test_another_holds_on_few_trials(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the Kalman filter on a sine a fifth of the trials is enough for its mean errors and its spread."""
    monkeypatch.setattr(signals, "QUICK_TRIALS_OF_KALMAN", 40)
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
    with pytest.raises(LookupError, match="no result 'cold-fusion'; there are kalman-sine"):
        reproduce(["cold-fusion"])


def test_findings_are_judged_honestly() -> None:
    """Outside the tolerance fails, no number fails, and an unconfirmed claim that does not hold differs as is known."""
    assert compare("x", 1.04, 1.0, 0.05, "here", ground=PROTOCOL).verdict == "reproduced"
    assert compare("x", 1.06, 1.0, 0.05, "here", ground=PROTOCOL).fails
    nothing = compare("x", math.nan, 1.0, 0.05, "here", ground=PROTOCOL)
    assert nothing.fails
    assert nothing.as_dict()["ours"] is None
    expected = compare("x", 1.06, 1.0, 0.05, "here", ground=PROTOCOL, known="another scene")
    assert (expected.verdict, expected.fails, expected.reason) == ("differs", False, "another scene")
    assert compare("x", 1.04, 1.0, 0.05, "here", ground=PROTOCOL, known="another scene").verdict == "reproduced"
    assert claim("x", 1.0, holds=False, source="here").fails
    assert claim("x", 1.0, holds=False, source="here", known="why").verdict == "differs"
    assert not claim("x", 1.0, holds=False, source="here", known="why").fails
    assert claim("x", 1.0, holds=True, source="here", known="why").verdict == "reproduced"


def test_better_needs_a_reason_and_a_side() -> None:
    """A figure on the good side of its tolerance is better, for a stated reason; on the bad side it fails as ever."""
    why = "an easier scene"
    higher, lower = (
        compare("x", ours, 1.0, 0.05, "here", ground=PROTOCOL, better="higher", reason=why) for ours in (1.2, 0.8)
    )
    assert (higher.verdict, higher.reason, higher.fails) == ("better", why, False)
    assert lower.fails
    assert compare("x", 0.8, 1.0, 0.05, "here", ground=PROTOCOL, better="lower", reason=why).verdict == "better"
    with pytest.raises(ValueError, match="a reason must be stated"):
        compare("x", 1.2, 1.0, 0.05, "here", ground=PROTOCOL, better="higher")


def test_an_own_figure_is_no_reference() -> None:
    """It guards against mistakes: as it was it is counted apart, and otherwise it fails."""
    before = Own("this project")
    assert compare("x", 1.0, 1.0, 0.05, before, ground=PROTOCOL).verdict == "our own figure"
    assert claim("x", 1.0, holds=True, source=before).verdict == "our own figure"
    assert compare("x", 2.0, 1.0, 0.05, before, ground=PROTOCOL).fails


def test_verdicts_are_counted_apart() -> None:
    """Each has its number, in one line, and so have differences with a known cause, without one, and unexpected."""
    found = [claim("a", 1, holds=True, source="here"), claim("b", 1, holds=True, source=Own("ours")), not_run("c")]
    counted = "1 reproduced, 1 our own figure, 1 not run; differences: 0 with a known cause, 0 without, 0 not expected"
    assert describe_verdicts(found) == counted
    found += [claim("d", 1, holds=False, source="here", known=why) for why in ("another face", Unexplained("so it is"))]
    found += [claim("e", 1, holds=False, source="here"), compare("f", 1, 2, 0.1, "here", ground=CHOSEN)]
    assert describe_verdicts(found).endswith("; differences: 1 with a known cause, 1 without, 2 not expected")


def test_a_ground_is_named_for_each_tolerance() -> None:
    """There is no default, so that no tolerance is taken to be stated where it is not."""
    with pytest.raises(TypeError, match="ground"):
        compare("x", 1.0, 1.0, 0.05, "here")  # type: ignore[call-arg]
