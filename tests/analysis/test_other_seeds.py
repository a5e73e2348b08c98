from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from pftrack.analysis.other_seeds import Ensemble, ensemble, ensembling, other_seeds
from pftrack.core.model.recipe import Change
from pftrack.core.model.series import as_json
from pftrack.experiments import find
from pftrack.experiments.fish import model
from pftrack.runs.many import Trial, read_blocks
from pftrack.runs.run import Run

FRAMES = 24


def begin(experiment: str, tracker: str | None, seed: int = 3, **values: Any) -> Run:
    found = find(experiment)
    timeline = (Change(0, values),) if values else ()
    return Run(found, found.simulate(), tracker=tracker, seed=seed, frames=FRAMES, timeline=timeline)


def errors_of(run: Run) -> list[float]:
    run.finish()
    return [np.nan if row.error is None else row.error for row in run.diagnostics]


def lost_of(run: Run) -> list[float]:
    return [np.nan if row.lost is None else float(row.lost) for row in run.diagnostics]


def test_a_change_of_the_seed_is_other_random_numbers_on_the_same_scene() -> None:
    """Up to the change the runs are one; then the tracker draws others, and the scene, noise and all, is the same."""
    run = begin("ball", "h-spf", sample_count=50, image_noise_sd=5)
    run.finish()
    branch, own = (run.branch(8, {"seed": seed}) for seed in (77, run.seed))
    again = Run.from_recipe(branch.recipe, branch.experiment, branch.setup)
    for each in (branch, own, again):
        each.finish()
    assert branch.diagnostics[:9] == run.diagnostics[:9]
    assert branch.diagnostics[9].estimate != run.diagnostics[9].estimate
    assert again.estimates_sha256 == branch.estimates_sha256
    assert own.estimates_sha256 == run.estimates_sha256
    for frame in (9, 20):
        assert np.array_equal(run.seek(frame).frame.picture, branch.seek(frame).frame.picture)


@pytest.mark.parametrize(("frame", "seed"), [(0, 4), (5, -1), (5, 2**53), (5, True), (5, "7")])
def test_seeds_that_are_none_are_refused(frame: int, seed: Any) -> None:
    """A seed in the middle of a run is one that a run may have; in frame 0 the run's own is in force."""
    with pytest.raises(ValueError, match="seed must be"):
        begin("ball", "h-spf").timeline.insert(Change(frame, {"seed": seed}))


@pytest.mark.parametrize(
    ("experiment", "tracker", "changed"),
    [
        ("ball", "h-spf", {"sample_count": 60}),  # takes frames at once, but for the first after a change
        ("ball", "kalman", {"process_noise_px": 6}),  # takes them one by one
        ("histogram", "condensation", {"tracker": "apf"}),  # gives an account of its own
        ("linkage", "particles", {"sample_count": 30}),  # judges states and not estimates
        ("trajectories", "nlng", {"selected_track": 5}),  # takes all seeds at once, for the selected tracks alone
        ("trajectories", "lng", {"new_corners": True, "largest_cost": 3}),  # corners give their places to others
        ("trajectories", "lg", {"tracker": "lng"}),  # and one by one where the tracker changes
    ],
)
def test_runs_of_an_ensemble_are_runs_with_their_seeds(experiment: str, tracker: str, changed: dict[str, Any]) -> None:
    """Errors and verdicts of every frame are those of a run with that seed from frame 1 on, to the bit."""
    run = begin(experiment, tracker)
    run.seek(9)
    run.change(changed)
    found = ensemble(run, runs=2)
    assert found.seeds == other_seeds(run.seed, 2) == (4, 5)
    assert found.computed.tolist() == [2] * FRAMES
    for seed, errors, lost in zip(found.seeds, found.errors, found.lost, strict=True):
        live = begin(experiment, tracker)
        live.change({"seed": seed})
        live.seek(9)
        live.change(changed)
        np.testing.assert_array_equal(errors, errors_of(live))
        np.testing.assert_array_equal(lost, lost_of(live))


@pytest.mark.parametrize(
    ("experiment", "tracker"),
    [("ball", "h-spf"), ("histogram", "condensation")],  # the scene has noise, has none
)
def test_runs_on_other_scenes_are_runs_of_their_seeds(experiment: str, tracker: str) -> None:
    """Where each sees what its seed makes of the scene, they are the runs that have these seeds, to the bit."""
    run = begin(experiment, tracker)
    run.seek(9)
    run.change({"sample_count": 60})
    found = ensemble(run, runs=2, scene="other")
    for seed, errors in zip(found.seeds, found.errors, strict=True):
        live = begin(experiment, tracker, seed=seed)
        live.timeline = run.timeline
        np.testing.assert_array_equal(errors, errors_of(live))


def test_what_a_picture_comes_to_is_made_once_for_all_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Five runs that see the same six pictures look once for the edges of each but the first, whose mark is known."""
    run = begin("fish", "guided")
    classify = Mock(wraps=model._classify_pixels)
    monkeypatch.setattr(model, "_classify_pixels", classify)
    ensemble(run, runs=5, frames=6)
    assert classify.call_count == 5


def test_few_runs_come_to_the_end_before_the_others_begin() -> None:
    """An ensemble grows by frames and then by runs, and what is known of a frame does not change but for those."""
    run = begin("ball", "h-spf", sample_count=60)
    grown = list(ensembling(run, other_seeds(run.seed, 5), FRAMES, rounds=(2, 9)))
    assert {tuple(sorted(set(each.computed.tolist()))) for each in grown} == {(2,), (2, 5), (5,)}
    half = next(each for each in grown if each.computed.tolist() == [2] * FRAMES)
    np.testing.assert_array_equal(half.errors[:2], grown[-1].errors[:2])
    mixed = next(each for each in grown if set(each.computed.tolist()) == {2, 5})
    for each, columns in ((half, mixed.computed == 2), (grown[-1], mixed.computed == 5)):
        np.testing.assert_array_equal(mixed.quantiles[:, columns], each.quantiles[:, columns])
        np.testing.assert_array_equal(mixed.holding[columns], each.holding[columns])


def test_a_trial_from_a_state_is_a_branch_with_its_seed() -> None:
    """It continues from a state with a change, in blocks of any length, to the numbers of the branch."""
    run = begin("ball", "h-spf", sample_count=50)
    run.finish()
    branch = run.branch(6, {"sample_count": 200, "seed": 9})
    one = Trial(branch.experiment, branch.source, branch.timeline, 9, branch.current.state)
    for first, last in ((7, 7), (8, 15), (16, 23)):
        for block in read_blocks(branch.source, branch.timeline.history, first, last):
            one.take(block)
    assert one.errors.tolist() == errors_of(branch)[7:]
    assert one.lost.tolist() == lost_of(branch)[7:]
    assert one.steps == 17


def test_quantiles_and_share_by_hand() -> None:
    """Of ten runs the first, fifth and ninth error by size; three of ten have lost; what is unknown stays unknown."""
    order = np.random.default_rng(2).permutation(10)
    errors = np.array([[float(k + 1), np.nan, np.inf if k > 7 else 0.0] for k in order])
    lost = np.array([[float(k < 3), np.nan, 0.0] for k in range(10)])
    found = Ensemble(tuple(range(10)), errors, lost, np.full(3, 10), "px")
    np.testing.assert_array_equal(found.quantiles, [[1, np.nan, 0], [5, np.nan, 0], [9, np.nan, np.inf]])
    np.testing.assert_allclose(found.holding, [0.7, np.nan, 1.0])
    told = as_json(found.bands)
    assert (told["runs"], told["frames"], told["high"], told["holding"][1]) == (10, 3, [9.0, None, None], None)


def test_runs_that_have_not_come_so_far_count_for_nothing() -> None:
    """Shares and quantiles of a frame are those of the runs, the first ones, that have come to it."""
    nan = np.nan
    errors = np.array([[1.0, 4.0], [2.0, 3.0], [9.0, nan], [8.0, nan]])
    lost = np.array([[0.0, 1.0], [0.0, 0.0], [1.0, nan], [1.0, nan]])
    found = Ensemble((1, 2, 3, 4), errors, lost, np.array([4, 2]), "px")
    np.testing.assert_array_equal(found.holding, [0.5, 0.5])
    np.testing.assert_array_equal(found.quantiles, [[1.0, 3.0], [2.0, 3.0], [9.0, 4.0]])


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"runs": 0}, "runs must be at least 1, got 0"),
        ({"frames": 0}, "frames must be at least 1, got 0"),
        ({"scene": "another"}, "scene must be one of same, other, got another"),
    ],
)
def test_an_ensemble_of_nothing_is_refused(wrong: dict[str, Any], message: str) -> None:
    """There are runs and frames in an ensemble, and one of two scenes."""
    with pytest.raises(ValueError, match=message):
        ensemble(begin("ball", "kalman"), **wrong)
