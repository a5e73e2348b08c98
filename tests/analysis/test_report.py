import pytest

from pftrack.analysis.alternatives import BASELINE, Alternative
from pftrack.analysis.counterfactuals import Finding, Report


def finding(alternative: Alternative, held: str, step_ms: float = 1.0) -> Finding:
    """Return a finding of runs by what became of them, such as "+-+"."""
    return Finding(alternative, {seed: it == "+" for seed, it in enumerate(held)}, 1000, step_ms)


GOOD, SAME, DEAR, UNKNOWN = (
    Alternative("noise", name, {name: 1}, name) for name in ("good", "same", "dear", "unknown")
)


def report(planned: int = 3, *, complete: bool = True) -> Report:
    findings = (
        finding(BASELINE, "+" + 9 * "-"),
        finding(SAME, "+" + 9 * "-", 2.0),
        finding(DEAR, 10 * "+", 5.0),
        finding(GOOD, 10 * "+", 2.0),
        finding(UNKNOWN, ""),
    )
    return Report(50, 40, 80, 10, planned, 10, findings, complete)


def test_changes_are_compared_on_common_seeds_and_corrected_for_all() -> None:
    """Nine seeds were won and none lost: p is 2 / 2^9, and as the smallest of three times three; of the rest 1."""
    compared = report().comparisons
    p = 2 / 2**9
    assert (compared[GOOD].won, compared[GOOD].lost, compared[GOOD].p_value) == (9, 0, p)
    assert compared[GOOD].corrected == pytest.approx(4 * p)  # four changes were tried
    assert compared[SAME].p_value == compared[SAME].corrected == compared[UNKNOWN].p_value == 1.0


def test_what_is_yet_to_be_tried_counts_for_the_correction() -> None:
    """Of forty changes four were tried: the smallest p-value counts forty times."""
    assert report(40, complete=False).comparisons[GOOD].corrected == pytest.approx(40 * 2 / 2**9)


def test_the_best_come_first_and_the_cheaper_of_equals() -> None:
    """No change leads; of two that always hold the cheaper is before; what nobody knows of is left out."""
    assert [it.alternative.title for it in report().best_first] == [BASELINE.title, "good", "dear", "same"]


def test_verdicts_and_sentence() -> None:
    """Better or worse is what the corrected test says, and all else is unclear."""
    found = report()
    assert [found.verdict(it) for it in found.best_first] == ["baseline", "better", "better", "unclear"]
    assert found.sentence == (
        "Of 10 other seeds with the same settings 1 hold. Best of the 3 changes: good: 10 of 10 hold."
    )
    worse = Report(50, 40, 80, 10, 1, 10, (finding(BASELINE, 9 * "+" + "-"), finding(SAME, 10 * "-")), True)
    assert worse.verdict(worse.findings[1]) == "worse"
    assert worse.sentence == (
        "Of 10 other seeds with the same settings 9 hold: it was bad luck. None of the 1 changes is clearly better."
    )


def test_the_seed_to_look_at_is_one_that_holds() -> None:
    """It is the first that holds, else the first; before any was tried there is none."""
    assert [finding(GOOD, held).seed for held in ("--+-+", "---", "")] == [2, 0, None]


def test_json_says_all_that_a_page_shows() -> None:
    """Shares, Wilson's interval of 10 of 10, cost, corrected p and verdict, best first."""
    told = report().as_dict()["findings"]
    assert told[0]["p_value"] is None
    best = told[1]
    assert (best["title"], best["holding"], best["runs"], best["share"]) == ("good", 10, 10, 1.0)
    assert (best["low"], best["high"]) == (pytest.approx(1 / (1 + 1.959964**2 / 10), abs=1e-6), 1.0)
    assert (best["step_ms"], best["verdict"], best["values"]) == (2.0, "better", {"good": 1})
