"""What is run on the driver's head, and how its curves are compared; the figures are with those of all studies."""

from pathlib import Path

import numpy as np
import pytest

from pftrack.reproduce import head

FRAMES = 24


def made_up(pitch_deg: float, seed: int = 0, model: head.Model = "mean") -> head.TrialResult:
    ratios = np.tile(np.linspace(0.1, 0.9, 30)[:, None], (1, 11))
    return head.TrialResult(
        head.Trial("pf-asd", model, seed), np.array([pitch_deg, 2.0, 0.4]), 2.8, ratios, np.arange(30) > 20
    )


def test_drivers_are_as_far_from_the_mean_face_as_the_reference_has_them() -> None:
    """To a fifth of a mm, which is as near as an unknown order of draws lets one come."""
    assert [head.distance_mm(driver) for driver in (99, 101, 102)] == pytest.approx([2.2, 3.9, 3.6], abs=0.2)


def test_trials_do_not_hang_on_what_else_sees_the_video(monkeypatch: pytest.MonkeyPatch) -> None:
    """A trial that shares its pictures with others measures what it measures alone, to the bit."""
    monkeypatch.setattr(head, "SCRIPT_FRAMES", FRAMES)  # the first ones, at the usual speed
    mixture, upper = head.Trial("pf-asd", "mean", 0), head.Trial("alpha-1", "individual", 3)
    first, second = head.run_trials(head.VideoTrials(99, (mixture, upper), FRAMES))
    (alone,) = head.run_trials(head.VideoTrials(99, (upper,), FRAMES))
    assert np.array_equal(alone.errors_deg, second.errors_deg)
    assert alone.feature_px == second.feature_px
    assert (alone.ratios == 1.0).all()
    assert first.ratios.shape == (FRAMES - 1, 11)


def test_success_is_counted_below_the_threshold() -> None:
    """A rate is the share of trials whose error on the axis is smaller."""
    courses = [made_up(pitch) for pitch in (1.0, 1.5, 2.0, 2.5)]
    rates = head.success_rates(courses, 0, np.array([0.5, 1.5, 2.2, 3.0]))
    assert rates.tolist() == [0.0, 0.25, 0.75, 1.0]


def test_a_curve_is_compared_by_its_place() -> None:
    """Errors that are half a degree smaller give a curve that lies half a degree elsewhere.

    One with errors of five degrees fails.
    """
    pitches: dict[head.Model, list[float]] = {"mean": [1.75] * 20, "individual": [1.45] * 17 + [1.9] * 3}
    for moved, wanted in ((0.0, 0.0), (0.5, 0.25)):
        trials = {model: [made_up(pitch - moved) for pitch in all_] for model, all_ in pitches.items()}
        findings = {finding.result: finding for finding in head.curves(trials)}
        pitch = findings["head: success curve of pitch, mean model, by how much it lies elsewhere, degrees"]
        assert pitch.ours == pytest.approx(wanted, abs=0.02)
        assert pitch.verdict == "reproduced"

    findings = head.curves({"mean": [made_up(5.0)] * 20, "individual": [made_up(1.45)] * 20})
    assert any(one.fails for one in findings if "pitch, mean" in one.result)


def test_figures_can_be_drawn(tmp_path: Path) -> None:
    """Alpha of every feature, and a curve for either face model on each axis."""
    figures = head.draw({"mean": [made_up(1.7)], "individual": [made_up(1.4, model="individual")]})
    for name, figure in figures.items():
        figure.savefig(tmp_path / f"{name}.png")
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000
    assert len([panel for panel in figures["figure-4.15-alpha"].axes if panel.get_visible()]) == 11
    assert [len(panel.lines) for panel in figures["figure-4.16-success-by-threshold"].axes] == [2, 2, 2]
