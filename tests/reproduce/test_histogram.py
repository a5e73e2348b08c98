"""The figures of a window by its colours."""

from pftrack.reproduce.histogram import Outcome, draw


def test_figures_are_drawn() -> None:
    """Success over particles and over lambda, of the rows that were computed."""
    rows = {"N = 25": [Outcome(0.5, 2.0)], "N = 300": [Outcome(1.0, 2.0)], "lambda = 200": [Outcome(0.0, 9.0)]}
    found = draw(rows, (0,))
    assert list(found) == ["histogram-success-by-particles", "histogram-success-by-lambda"]
