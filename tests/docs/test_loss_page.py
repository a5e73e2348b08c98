"""The page of loss probabilities says what the record beside it holds, and what is declared holds there."""

from pftrack.experiments import EXPERIMENTS
from pftrack.experiments.shared.loss_probability import MOST_ERROR
from pftrack.reproduce.finding import read_record
from tools.loss_probability import PAGE, RECORD, page

ENTRIES = read_record(RECORD)


def test_the_tables_are_written_from_the_record() -> None:
    """`python -m tools.loss_probability table` writes them."""
    text = PAGE.read_text("utf-8")
    assert text == page(text, ENTRIES)


def test_all_that_is_declared_was_judged_and_is_calibrated() -> None:
    """The record has a calibration error of each tracker that declares a probability, and of no other one."""
    errors = {
        tuple(one.result.split(": ")[1].split(", ")): one.ours
        for one in ENTRIES["loss"].findings
        if "calibration error" in one.result and one.verdict != "not run"
    }
    declared = [
        (name, tracker) for name in EXPERIMENTS.own for tracker in EXPERIMENTS[name].quality.loss_probability.models
    ]
    assert sorted(errors) == sorted(declared)
    assert max(errors.values()) <= MOST_ERROR
