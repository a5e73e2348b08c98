"""The page of reproduced results agrees with the record beside it, and the record with what pftrack computes."""

import random
import re
from datetime import date

import pytest

from pftrack.reproduce import RESULTS
from pftrack.reproduce.finding import Finding, read_record
from pftrack.reproduce.pool import Pool
from tools.reproduction import PAGE, README, RECORD, SENTENCE, STUDIES, blocks, findings_of, sentence

ENTRIES = read_record(RECORD)
FISH, HISTOGRAM = (PAGE.parents[1] / "experiments" / name for name in ("fish.md", "histogram.md"))
PAGE_TEXT = PAGE.read_text(encoding="utf-8")

QUICK_S = 130
"""Processor time of the quick form: about a minute on two cores."""

AT_MOST_S = 60
"""Results that take longer in full are not among those that a test computes again."""


@pytest.mark.parametrize("name", ["run", "counts", "differences", "missing"])
def test_the_page_is_written_from_the_record(name: str) -> None:
    """Each generated table of the page is the one that the record gives; `python -m tools.reproduction` writes them."""
    found = re.search(rf"<!-- reproduction {name} -->\n(.*?)\n<!-- end -->", PAGE_TEXT, re.DOTALL)
    assert found is not None
    assert found[1].strip() == blocks(ENTRIES)[name]


def test_the_pages_count_as_the_record_does() -> None:
    """The sentence in the README has the counts of the record, and the page of the fish how many figures differ."""
    found = SENTENCE.search(README.read_text(encoding="utf-8"))
    assert found is not None
    assert found[0].split() == sentence(ENTRIES).split()
    fish = findings_of(ENTRIES, ["fish-offline", "fish", "fish-ablations"])
    differ, explained = sum(one.verdict == "differs" for one in fish), sum(one.explained for one in fish)
    counted = f"{differ} figures differ from the paper or the reference, {explained} for a known"
    assert counted in " ".join(FISH.read_text(encoding="utf-8").split())


def test_every_figure_has_a_study_a_reason_and_a_ground() -> None:
    """Each result belongs to one study. A figure that may differ does differ in the full form, for a known reason.

    Each tolerance has a ground. In the quick form all results take about a minute of two cores.
    """
    assert sorted(name for names in STUDIES.values() for name in names) == sorted(RESULTS)
    assert set(ENTRIES) <= set(RESULTS)
    full = [one for name, entry in ENTRIES.items() if entry.form == "full" for one in findings_of(ENTRIES, [name])]
    assert [one.result for one in full if one.known and one.verdict != "differs"] == []
    assert [one.result for one in full if one.verdict in {"differs", "better", "not run"} and not one.reason] == []
    assert [one.result for one in findings_of(ENTRIES) if one.tolerance is not None and not one.ground] == []
    assert sum(result.quick_s for result in RESULTS.values()) <= QUICK_S


def beside_references() -> set[tuple[str, str]]:
    """Return hand-written numbers, each with the reference in brackets behind it."""
    pages = "\n".join(page.read_text(encoding="utf-8") for page in (PAGE, FISH, HISTOGRAM))
    written = re.sub(r"<!-- reproduction \w+ -->.*?<!-- end -->", "", pages, flags=re.DOTALL)
    return set(re.findall(r"(-?\d*\.?\d+)\** \((-?\d*\.?\d+)\)", written))


def rounds_to(value: float, text: str) -> bool:
    """Return whether a number rounds to the digits of a text."""
    return abs(value - float(text)) <= 0.5001 * 10 ** -len(text.partition(".")[2])


def test_hand_written_tables_have_the_numbers_of_the_record() -> None:
    """A number with a reference beside it is a finding of the record, with that reference."""
    known = [one for one in findings_of(ENTRIES) if one.reference is not None]
    pairs = beside_references()
    assert len(pairs) > 60
    assert [
        f"{ours} ({reference})"
        for ours, reference in sorted(pairs)
        if not any(rounds_to(one.ours, ours) and rounds_to(one.reference or 0.0, reference) for one in known)
    ] == []


@pytest.mark.slow
def test_a_tenth_of_the_record_is_computed_again() -> None:
    """Some results, others every day, give the stored findings again, apart from times."""
    cheap = [name for name, entry in ENTRIES.items() if entry.seconds <= AT_MOST_S]
    seed = date.today().isoformat()  # noqa: DTZ011 - any day will do
    chosen = random.Random(seed).sample(cheap, max(1, len(ENTRIES) // 10))
    for name in chosen:
        with Pool(2) as pool:
            again = RESULTS[name].compute(pool, ENTRIES[name].form == "full")
        assert _untimed(again) == _untimed(ENTRIES[name].findings), f"{name} (seed {seed})"


def _untimed(found: "list[Finding] | tuple[Finding, ...]") -> list[dict[str, object]]:
    return [one.as_dict() for one in found if not one.timed]
