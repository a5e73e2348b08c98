from dataclasses import replace

import pytest

from pftrack.analysis.alternatives import BASELINE, Alternative
from pftrack.analysis.counterfactuals import Finding, Report


def finding(alternative: Alternative, held: str, step_ms: float = 1.0) -> Finding:
    """Return a finding of runs by what became of them, such as "+-+"."""
    return Finding(alternative, {seed: it == "+" for seed, it in enumerate(held)}, 1000, step_ms)


NAMES = "good", "same", "dear", "unknown"
GOOD, SAME, DEAR, UNKNOWN = (Alternative("noise", name, {name: 1}, name) for name in NAMES)


def report(planned: int = 3, *, complete: bool = True) -> Report:
    findings = (
        finding(BASELINE, "+" + 11 * "-"),
        finding(SAME, "+" + 11 * "-", 2.0),
        finding(DEAR, 12 * "+", 5.0),
        finding(GOOD, 12 * "+", 2.0),
        finding(UNKNOWN, ""),
    )
    return Report(50, 40, 80, 80, 10, planned, 12, findings, complete)


def test_changes_are_compared_on_common_seeds_and_corrected_for_all() -> None:
    """Eleven seeds were won and none lost: p is 2 / 2^11, and as the smallest of four times four; of the rest 1."""
    compared = report().comparisons
    p = 2 / 2**11
    assert (compared[GOOD].won, compared[GOOD].lost, compared[GOOD].p_value) == (11, 0, p)
    assert compared[GOOD].corrected == pytest.approx(4 * p)  # four changes were tried
    assert report(40, complete=False).comparisons[GOOD].corrected == pytest.approx(40 * p)  # of forty
    assert compared[SAME].p_value == compared[SAME].corrected == compared[UNKNOWN].p_value == 1.0


def test_verdicts_and_sentence() -> None:
    """Better or worse is what the corrected test says, and all else is unclear.

    No change leads; of two that always hold the cheaper is before; a change without a run is left out.
    """
    found = report()
    assert [it.alternative.title for it in found.best_first] == [BASELINE.title, "good", "dear", "same"]
    assert [found.verdict(it) for it in found.best_first] == ["baseline", "better", "better", "unclear"]
    same = "other seeds with the same settings hold"
    assert found.sentence == f"1 of 12 {same}. Best of the 3 changes: good: 12 of 12 hold to the end."
    findings = finding(BASELINE, 11 * "+" + "-"), finding(SAME, 12 * "-")
    worse = Report(50, 40, 80, 80, 10, 1, 12, findings, True)
    assert worse.verdict(worse.findings[1]) == "worse"
    assert worse.sentence == f"11 of 12 {same}: it was bad luck. No change is clearly better."


@pytest.mark.parametrize(
    ("baseline", "good", "sentence"),
    [
        (10 * "-", 10 * "+", "Too few seeds to tell."),
        (12 * "-", 10 * "+", "0 of 12 other seeds with the same settings hold. Too few seeds to tell what helps."),
        (12 * "-", 12 * "+", "0 of 12 other seeds with the same settings hold. Best so far: good: 12 of 12 hold to"),
    ],
)
def test_below_eleven_seeds_nothing_is_said(baseline: str, good: str, sentence: str) -> None:
    """An early look says that there are too few seeds, and not that nothing helps or that it was bad luck."""
    few = replace(report(), findings=(finding(BASELINE, baseline), finding(GOOD, good)), is_complete=False)
    assert few.sentence.removesuffix(" the end.") == sentence
    assert few.verdict(few.findings[1]) == ("few" if len(good) < 11 else "better")


def test_a_cure_that_does_not_last_is_not_called_better() -> None:
    """A change that helps soon after the loss and not at the end stands below one that lasts; both shares are given."""

    def followed(alternative: Alternative, held: str, at_end: str) -> Finding:
        return replace(finding(alternative, held), at_end=finding(alternative, at_end).held)

    brief, good = (SAME, 12 * "+", "+" + 11 * "-"), (GOOD, 11 * "+" + "-", 10 * "+" + "--")
    findings = tuple(followed(*it) for it in ((BASELINE, 12 * "-", "+" + 11 * "-"), brief, good))
    found = replace(report(2), last=200, findings=findings)
    verdicts = [(it.alternative.title, found.verdict(it)) for it in found.best_first[1:]]
    assert verdicts == [("good", "better"), ("same", "brief")]
    told = found.as_dict()["findings"][2]
    assert (told["holding"], told["runs"], told["holding_at_end"], told["runs_to_end"]) == (12, 12, 1, 12)
    assert told["shares"] == "12 of 12 hold to frame 80, 1 of 12 to the end"
    assert told["words"] == "better for a while, but not later (p < 0.001)"


def test_json_says_all_that_a_page_shows() -> None:
    """Shares, Wilson's interval of 12 of 12, cost, corrected p and verdict, best first.

    The seed to look at is the first that holds, else the first; before any was tried there is none.
    """
    assert [finding(GOOD, held).seed for held in ("--+-+", "---", "")] == [2, 0, None]
    told = report().as_dict()["findings"]
    assert told[0]["corrected"] is None
    best = told[1]
    assert (best["title"], best["holding"], best["runs"], best["share"]) == ("good", 12, 12, 1.0)
    assert (best["low"], best["high"]) == (pytest.approx(1 / (1 + 1.959964**2 / 12), abs=1e-6), 1.0)
    assert (best["step_ms"], best["verdict"], best["values"]) == (2.0, "better", {"good": 1})
