"""The page of reproduced results says what the record beside it holds, and the record is what pftrack computes."""

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


@pytest.mark.parametrize("name", blocks(ENTRIES))
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


def test_every_result_belongs_to_a_study() -> None:
    """The table of counts leaves no result out and has none twice, and the record knows no others."""
    assert sorted(name for names in STUDIES.values() for name in names) == sorted(RESULTS)
    assert set(ENTRIES) <= set(RESULTS)


def test_no_exemption_is_without_need_or_reason() -> None:
    """What may differ does differ in the full form, and its reason is told."""
    full = [one for name, entry in ENTRIES.items() if entry.form == "full" for one in findings_of(ENTRIES, [name])]
    assert [one.result for one in full if one.known and one.verdict != "differs"] == []
    assert [one.result for one in full if one.verdict in {"differs", "better", "not run"} and not one.reason] == []


def test_every_tolerance_has_a_ground() -> None:
    """A figure that is compared says why it may be so far from its reference, and only what is stated says it is.

    What all results are known to cost in the quick form is about a minute of two cores.
    """
    assert [one.result for one in findings_of(ENTRIES) if one.tolerance is not None and not one.ground] == []
    assert sum(result.quick_s for result in RESULTS.values()) <= QUICK_S


def beside_references() -> set[tuple[str, str]]:
    """Return the numbers that people have written, each with its reference in brackets behind it."""
    pages = "\n".join(page.read_text(encoding="utf-8") for page in (PAGE, FISH, HISTOGRAM))
    written = re.sub(r"<!-- reproduction \w+ -->.*?<!-- end -->", "", pages, flags=re.DOTALL)
    return set(re.findall(r"(-?\d*\.?\d+)\** \((-?\d*\.?\d+)\)", written))


def rounds_to(value: float, text: str) -> bool:
    """Whether a number is what a text says, to the digits that it has."""
    return abs(value - float(text)) <= 0.5001 * 10 ** -len(text.partition(".")[2])


def test_the_tables_that_people_wrote_have_the_numbers_of_the_record() -> None:
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
    """Some results, others every day, come to the very findings that are kept, but for times."""
    cheap = [name for name, entry in ENTRIES.items() if entry.seconds <= AT_MOST_S]
    seed = date.today().isoformat()  # noqa: DTZ011 - any day will do
    chosen = random.Random(seed).sample(cheap, max(1, len(ENTRIES) // 10))
    for name in chosen:
        with Pool(2) as pool:
            again = RESULTS[name].compute(pool, ENTRIES[name].form == "full")
        assert _untimed(again) == _untimed(ENTRIES[name].findings), f"{name} (seed {seed})"


def _untimed(found: "list[Finding] | tuple[Finding, ...]") -> list[dict[str, object]]:
    return [one.as_dict() for one in found if not one.timed]
