"""The page of loss probabilities agrees with the record beside it, and declared probabilities are calibrated."""

from pftrack.experiments import EXPERIMENTS
from pftrack.experiments.shared.loss_probability import MOST_ERROR
from pftrack.reproduce.finding import read_record
from tools.loss_probability import PAGE, RECORD, page

ENTRIES = read_record(RECORD)


def test_the_pages_have_the_figures_of_the_record() -> None:
    """`python -m tools.loss_probability table` writes the tables; both pages say that recordings are another matter."""
    text = PAGE.read_text("utf-8")
    assert text == page(text, ENTRIES)
    for each in (PAGE, PAGE.parents[1] / "how-to" / "why.md"):
        assert "not calibrated" in " ".join(each.read_text("utf-8").split())


def test_every_declared_probability_is_calibrated() -> None:
    """The record has a calibration error of each tracker that declares a probability, and of no other."""
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
