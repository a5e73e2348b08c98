"""Findings are judged honestly, by statements that are checked when they are read."""

import math
from pathlib import Path
from typing import Any, get_args

import pytest

from pftrack.reproduce import finding
from pftrack.reproduce.finding import References, Statement, describe_verdicts, not_run

STUDIES = sorted(
    path for path in Path(finding.__file__).parent.glob("*.yaml") if path.stem not in {"grounds", "results"}
)
AGAIN = {"known": {"reason": "so it is", "explained": False}}


def near(**more: Any) -> Statement:
    """A reference of 1, with a tolerance of 0.05."""
    return Statement(result="x", source="here", reference=1.0, tolerance=0.05, ground="stated", **more)


def at_least(**more: Any) -> Statement:
    return Statement(result="x", source="here", least=1.0, **more)


KNOWN, EASIER, HERE = {"known": "another scene"}, {"reason": "an easier scene"}, {"own": True}


@pytest.mark.parametrize(
    ("statement", "ours", "verdict", "fails"),
    [
        (near(), 1.04, "reproduced", False),
        (near(), 1.06, "differs", True),
        (near(), math.nan, "differs", True),
        (near(**KNOWN), 1.06, "differs", False),
        (at_least(), 0.9, "differs", True),
        (at_least(), math.nan, "differs", True),
        (at_least(**KNOWN), 0.9, "differs", False),
        (at_least(**KNOWN), 1.0, "reproduced", False),
        # A figure on the good side of its tolerance is better, for a stated reason; on the bad side it fails as ever.
        (near(better="higher", **EASIER), 1.2, "better", False),
        (near(better="higher", **EASIER), 0.8, "differs", True),
        (near(better="lower", **EASIER), 0.8, "better", False),
        # An own figure guards against mistakes: as it was it is counted apart, and otherwise it fails.
        (near(**HERE), 1.0, "our own figure", False),
        (near(**HERE), 2.0, "differs", True),
    ],
)
def test_findings_are_judged_honestly(statement: Statement, ours: float, verdict: str, fails: bool) -> None:
    """Outside the tolerance fails, no number fails, and an unconfirmed claim that does not hold differs as is known."""
    found = statement.judge(ours)
    assert (found.verdict, found.fails) == (verdict, fails)
    assert math.isfinite(ours) or found.as_dict()["ours"] is None
    with pytest.raises(ValueError, match="a reason must be stated"):
        near(better="higher")


def test_verdicts_are_counted_apart() -> None:
    """Each has its number, in one line, and so have differences with a known cause, without one, and unexpected."""
    found = [at_least().judge(1), at_least(own=True).judge(1), not_run("c")]
    counted = "1 reproduced, 1 our own figure, 1 not run; differences: 0 with a known cause, 0 without, 0 not expected"
    assert describe_verdicts(found) == counted
    found += [at_least(**known).judge(0) for known in ({"known": "another face"}, AGAIN, {})]
    assert describe_verdicts([*found, near().judge(2)]).endswith(
        "; differences: 1 with a known cause, 1 without, 2 not expected"
    )


def test_a_cell_of_a_table_has_its_figures_and_its_exemption() -> None:
    """Keys find the reference, its tolerance and the reason why this cell alone may differ, and fill the sentence."""
    known: Any = {"reason": "few particles", "of": [["guided", 100]]}
    stated = {"guided": {100: 18.0, 500: [23.0, 24.0]}}
    more = {"tolerance": {100: 2.0, 500: 0.5}, "ground": "chosen", "known": known}
    table = Statement(result="{0}, N = {1}", source="here", reference=stated, **more)
    many, few = table.judge(23.4, "guided", 500), table.judge(10.0, "guided", 100)
    assert (many.result, many.reference, many.tolerance, many.verdict) == ("guided, N = 500", 23.5, 0.5, "reproduced")
    assert (few.verdict, few.reason, few.fails, few.tolerance) == ("differs", "few particles", False, 2.0)
    assert table.judge(10.0, "guided", 500).fails
    assert table.judge(24.3, "guided", 500, wider=2.0).ground == finding.GROUNDS["fewer"]
    with pytest.raises(LookupError, match="states nothing for ordinary, 100"):
        table.judge(1.0, "ordinary", 100)


def test_tolerances_of_shares_and_ranges() -> None:
    """A share is compared by the runs of both sides: three standard errors of the difference, and 0.03.

    A range is its middle and half its width, and a figure may lie as far beside it as is allowed.
    """
    found = Statement(result="x", reference=0.5, runs=100).judge(0.5, runs=50)
    assert found.tolerance == pytest.approx(3 * math.sqrt(0.25 * (1 / 50 + 1 / 100)) + 0.03)
    assert found.ground == finding.GROUNDS["share"]

    stated = Statement(result="x", between=[62.0, 64.0], tolerance=1.5, ground="chosen")
    assert (stated.judge(65.5).tolerance, stated.judge(65.5).verdict) == (2.5, "reproduced")
    assert stated.judge(65.6).fails


def test_what_is_stated_can_be_read() -> None:
    """Every statement of every study is whole, and every ground of a tolerance has its words."""
    assert all(References(str(path)).statements for path in STUDIES)
    assert finding.GROUNDS.keys() == set(get_args(finding.Ground))


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ("result: x\n  reference: 1\n  tolerance: 0.1", "lacks the ground of its tolerance"),
        ("result: x\n  reference: {a: many}\n  ground: stated", "the reference of a must be a number, got 'many'"),
        ("source: y", "result"),
        ("1", "must map fields to values"),
    ],
)
def test_a_wrong_statement_is_refused_with_its_line(fields: str, told: str, tmp_path: Path) -> None:
    """The sentence names the file and the line, the statement and what is wrong."""
    text = f"right:\n  result: fine\nwrong:\n  {fields}\n"
    (tmp_path / "made.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=rf"made.yaml, line [345]: wrong.*{told}"):
        _ = References(str(tmp_path / "made.py")).statements
