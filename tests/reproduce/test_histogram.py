"""What is claimed for a window by its colours, on few runs, and its figures."""

from pftrack.reproduce.histogram import Case, Outcome, draw, runs


def test_lambda_and_velocity_decide() -> None:
    """In scene 0 the lecture's filter comes through, with lambda 200 or without a prediction it does not."""
    assert runs(Case(0, "condensation", {}, 2)).success == 1.0
    assert runs(Case(0, "condensation", {"sharpness": 200}, 2)).success == 0.0
    assert runs(Case(0, "greedy", {}, 1)).success == 0.0


def test_figures_are_drawn() -> None:
    """Success over particles and over lambda, of the rows that were computed."""
    rows = {"N = 25": [Outcome(0.5, 2.0)], "N = 300": [Outcome(1.0, 2.0)], "lambda = 200": [Outcome(0.0, 9.0)]}
    found = draw(rows, (0,))
    assert list(found) == ["histogram-success-by-particles", "histogram-success-by-lambda"]
