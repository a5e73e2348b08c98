"""Fitting: what is found is where the evidence is largest, and is kept only where the other half agrees."""

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import pftrack
from pftrack.analysis.fitting import fit, fittable
from pftrack.analysis.search import maximise
from pftrack.core.refusal import RefusedError
from pftrack.runs.run import Run

TRUE_SD = 0.1
"""Standard deviation of the noise of the default signal."""


def signal(tracker: str = "kalman", seed: int = 31, **values: float) -> Run:
    return pftrack.run("sine", tracker=tracker, seed=seed, **values)


@pytest.mark.parametrize("peak", [(700.0,), (3.0, 0.05), (0.5, 20.0, 4.0)])
def test_the_largest_place_is_found(peak: tuple[float, ...]) -> None:
    """The top of a bell over logarithms is found, up to the tolerance, from a beginning that is decades away."""
    begin = (1.0,) * len(peak)

    def bell(place: tuple[float, ...]) -> float:
        return -sum(math.log(it / top) ** 2 for it, top in zip(place, peak, strict=True))

    found, value = maximise(bell, begin, [(1e-4, 1e4)] * len(peak), evaluations=150)
    assert value >= bell(begin)
    assert np.log(found) == pytest.approx(np.log(peak), abs=0.05)


def test_the_noise_of_a_linear_model_is_found() -> None:
    """The exact evidence has its peak at the noise that was there, and the bands then hold what they say."""
    run = signal(assumed_noise_sd=0.4)
    told: list[tuple[int, int]] = []
    found = fit(run, ["assumed_noise_sd"], on_step=lambda done, most: told.append((done, most)))
    assert found.numbers[0].after == pytest.approx(TRUE_SD, rel=0.1)
    assert found.kept
    assert found.values == {"assumed_noise_sd": found.numbers[0].after}
    used, kept_back = found.halves
    assert (used.first, used.last + 1, kept_back.last) == (1, kept_back.first, run.computed)
    assert kept_back.after.log_evidence > kept_back.before.log_evidence
    assert kept_back.before.coverage["95"] == 1.0
    before, after = kept_back.before, kept_back.after
    assert (before.nis or 0.0) < 0.2
    assert 0.7 < (after.nis or 0.0) < 1.3
    assert (before.nees or 0.0) < (after.nees or 0.0)
    assert 0.85 < kept_back.after.coverage["95"] < 1.0  # frames in a row are alike, so one run tells little
    assert all(before < after for (before, _), (after, _) in pairwise(told))
    assert told[-1][0] == found.runs <= told[-1][1]
    assert run.parameters_at(run.position).assumed_noise_sd == 0.4

    grid = np.geomspace(0.08, 0.125, 9)
    rows = [signal(assumed_noise_sd=sd).diagnostics[1 : used.last + 1] for sd in grid]
    best = grid[np.argmax([sum(row.log_evidence for row in each) for each in rows])]
    assert found.numbers[0].after == pytest.approx(best, rel=0.05)


@pytest.mark.parametrize(
    ("run", "names"),
    [
        (lambda: signal(assumed_noise_sd=0.4), ("process_noise_sd", "assumed_noise_sd")),
        (lambda: pftrack.run("ball", tracker="kalman", frames=61), ("process_noise_px", "measurement_noise_px")),
    ],
    ids=["signal", "ball"],
)
def test_both_methods_find_the_same_place(run: Callable[[], Run], names: tuple[str, ...]) -> None:
    """Expectation maximisation, where nothing is said, ends where the search ends, and no lower."""
    chosen, searched = fit(run(), names), fit(run(), names, method="search")
    assert (chosen.method, searched.method) == ("em", "search")
    assert chosen.rounds < searched.rounds == searched.runs - 2
    assert [it.after for it in chosen.numbers] == pytest.approx([it.after for it in searched.numbers], rel=0.03)
    frames = chosen.halves[0].last
    assert frames * chosen.halves[0].after.log_evidence > frames * searched.halves[0].after.log_evidence - 0.002
    assert f"expectation maximisation in {chosen.rounds} steps" in chosen.procedure
    assert searched.procedure.endswith(f"over {searched.rounds} settings.")


def test_tracks_are_fitted_by_expectation_maximisation() -> None:
    """Each axis of each track of a corner is a chain; one that begins or ends in between is not part of another."""
    run = pftrack.run("trajectories", tracker="lg", frames=41)
    found = fit(run)
    assert (found.method, [it.name for it in found.numbers]) == ("em", ["noise_variance_px2", "drive_variance_px2"])
    first = found.halves[0]
    assert first.after.log_evidence > first.before.log_evidence


def test_what_is_measured_is_not_fitted() -> None:
    """The colours by which a centroid is found are not offered."""
    run = pftrack.run("ball", tracker="kalman", frames=2)
    offered = fittable(run.experiment, "kalman", type(run.setup.parameters))
    assert [it.name for it in offered] == ["process_noise_px", "measurement_noise_px"]


def test_particles_are_fitted_with_common_random_numbers() -> None:
    """What is found is near the exact answer."""
    found = fit(signal("condensation", sample_count=200, assumed_noise_sd=0.3, frames=121), ["assumed_noise_sd"])
    assert found.seeds > 1
    assert found.kept
    assert found.numbers[0].after == pytest.approx(TRUE_SD, rel=0.15)


def test_motion_is_fitted_where_a_likelihood_lacks_a_constant() -> None:
    """A ball that is lost at once since particles are thrown about is held with the noise that is found."""
    run = pftrack.run("ball", tracker="condensation", frames=81, occlusion_width_px=5, process_noise_px=15)
    found = fit(run, ["process_noise_px"])
    assert found.kept
    assert "lost its target in 76 of 80 frames" in found.caution
    assert run.summary().verdict.lost_frames == 76
    assert pftrack.run(run.recipe, **found.values).summary().verdict.lost_frames < 10


@pytest.mark.parametrize(
    ("tracker", "frames", "values", "name", "most"),
    [
        ("guided", 61, {"diffusion_scale": 6, "sample_count": 300}, "diffusion_scale", 3),
        ("condensation", 81, {"red_spread": 0.5, "sample_count": 200}, "red_spread", 0.1),
    ],
)
def test_motion_and_sharpness_are_fitted(tracker: str, frames: int, values: Any, name: str, most: float) -> None:
    """Six times too wide accelerations are narrowed; a flat likelihood becomes sharp, unlike by evidence alone."""
    found = fit(pftrack.run("ball", tracker=tracker, frames=frames, occlusion_width_px=5, **values), [name])
    assert found.kept
    assert found.numbers[0].after < most


def test_what_is_found_is_judged_by_luck_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs over both halves have no random numbers that a trial had, and a gain within two errors is not kept.

    The same run is fitted alike again.
    """
    begun: list[tuple[int, int]] = []

    def begin(*parts: Any, seed: int, frames: int, **more: Any) -> Run:
        begun.append((frames, seed))
        return Run(*parts, seed=seed, frames=frames, **more)

    run = signal("condensation", sample_count=20, assumed_noise_sd=0.3, frames=61)
    again = fit(run, ["assumed_noise_sd"])
    monkeypatch.setattr("pftrack.runs.many.Run", begin)
    found = fit(run, ["assumed_noise_sd"])
    trials, judging = ({seed for frames, seed in begun if frames == end} for end in (31, 61))
    assert again.as_dict() == found.as_dict()
    assert len(trials) == found.seeds > 1
    assert len(judging) == 2 * found.seeds
    assert trials.isdisjoint(judging)
    assert not replace(found, gain=0.19, gain_error=0.1).kept
    assert replace(found, gain=0.21, gain_error=0.1).kept


def test_the_gain_is_a_mean_over_frames_with_the_error_of_ten_blocks() -> None:
    """Frames in a row are alike, so the error is that of the mean of ten stretches."""
    run = signal(assumed_noise_sd=0.4, frames=101)
    found = fit(run, ["assumed_noise_sd"])
    half = found.halves[1]
    gains = np.array(found.gains)
    assert (half.first, half.last, len(gains)) == (51, 100, 50)
    assert found.gain == pytest.approx(gains.mean())
    stretches = gains.reshape(10, 5).mean(axis=1)
    assert found.gain_error == pytest.approx(math.sqrt(np.square(stretches - gains.mean()).sum() / 9 / 10))


def test_what_is_right_is_left_alone() -> None:
    """Values that were true are not replaced by what suits the first half by chance."""
    found = fit(signal(seed=5))
    assert [it.name for it in found.numbers] == ["process_noise_sd", "assumed_noise_sd"]
    assert not found.kept
    assert found.values == {}
    assert found.verdict.startswith("Not ")


@pytest.mark.parametrize(
    ("run", "names", "message"),
    [
        (lambda: signal(frames=30), (), "at least 41 frames.* and 30 are computed"),
        (signal, ("dimension",), "Kalman filter has no number 'dimension' that can be fitted; there are process"),
        (lambda: pftrack.run("histogram", frames=50, tracker="greedy"), (), "does not distinguish settings"),
        (lambda: signal("condensation", frames=50), ("assumed_noise_sd",), "Condensation is not linear in these"),
    ],
)
def test_what_cannot_be_fitted_says_why(run: Callable[[], Run], names: tuple[str, ...], message: str) -> None:
    """A short run, an unknown number, a tracker without evidence, and one without a linear model."""
    with pytest.raises(RefusedError, match=message):
        fit(run(), names, method="em")
