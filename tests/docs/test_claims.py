"""A page that says how good a judgement is gives the figures of cases that it was not made for as well."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LOSS = ("not calibrated", "0.25", "0.155", "0.134")
"""P(lost) on clips that it was not fitted to."""


@pytest.mark.parametrize("page", ["docs/how-to/why.md", "docs/explanation/loss.md"])
def test_both_kinds_of_figures_are_stated(page: str) -> None:
    """Neither those of our own cases nor those of others stand alone."""
    text = " ".join((ROOT / page).read_text("utf-8").split())
    assert [figure for figure in LOSS if figure not in text] == []
