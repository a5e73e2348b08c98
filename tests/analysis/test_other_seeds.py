from typing import Any

import numpy as np
import pytest

from pftrack.analysis.other_seeds import Ensemble, ensemble, ensembling, other_seeds
from pftrack.core.model.recipe import Change
from pftrack.core.model.series import as_json
from pftrack.experiments import find
from pftrack.runs.run import Run

FRAMES = 24


def begin(experiment: str, tracker: str | None, seed: int = 3, **values: Any) -> Run:
    found = find(experiment)
    timeline = (Change(0, values),) if values else ()
    return Run(found, found.simulate(), tracker=tracker, seed=seed, frames=FRAMES, timeline=timeline)


def errors_of(run: Run) -> list[float]:
    run.finish()
    return [np.nan if row.error is None else row.error for row in run.diagnostics]


def test_a_change_of_the_seed_is_other_random_numbers_on_the_same_scene() -> None:
    """Up to the change the runs are one; then the tracker draws others, and the scene, noise and all, is the same.

    What is not a seed is refused, and so is one in frame 0, where the run's own is in force.
    """
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
    for frame, seed in ((0, 4), (5, -1), (5, 2**53), (5, True), (5, "7")):
        with pytest.raises(ValueError, match="seed must be"):
            run.timeline.insert(Change(frame, {"seed": seed}))
    for frame in (9, 20):
        assert np.array_equal(run.seek(frame).frame.picture, branch.seek(frame).frame.picture)


@pytest.mark.parametrize(
    ("experiment", "tracker", "changed"),
    [
        ("ball", "h-spf", {"sample_count": 60}),  # takes frames at once, but for the first after a change
        ("ball", "kalman", {"process_noise_px": 6}),  # takes them one by one
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
        np.testing.assert_array_equal(lost, [np.nan if row.lost is None else row.lost for row in live.diagnostics])


def test_runs_on_other_scenes_are_runs_of_their_seeds() -> None:
    """Where each sees what its seed makes of the scene, they are the runs that have these seeds, to the bit."""
    run = begin("ball", "h-spf")
    run.seek(9)
    run.change({"sample_count": 60})
    found = ensemble(run, runs=2, scene="other")
    for seed, errors in zip(found.seeds, found.errors, strict=True):
        live = begin("ball", "h-spf", seed=seed)
        live.timeline = run.timeline
        np.testing.assert_array_equal(errors, errors_of(live))


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


def test_quantiles_and_share_by_hand() -> None:
    """The bands of ten runs are the first, fifth and ninth error by size; what is unknown stays unknown.

    Where fewer runs have reached a frame its figures are those of the first ones, which have.
    """
    order = np.random.default_rng(2).permutation(10)
    errors = np.array([[float(k + 1), np.nan, np.inf if k > 7 else 0.0] for k in order])
    lost = np.array([[float(k < 3), np.nan, 0.0] for k in range(10)])
    found = Ensemble(tuple(range(10)), errors, lost, np.full(3, 10), "px")
    np.testing.assert_array_equal(found.quantiles, [[1, np.nan, 0], [5, np.nan, 0], [9, np.nan, np.inf]])
    np.testing.assert_allclose(found.holding, [0.7, np.nan, 1.0])
    told = as_json(found.bands)
    nan = np.nan
    errors, lost = np.array([[1, 4], [2, 3], [9, nan], [8, nan]]), np.array([[0.0, 1], [0, 0], [1, nan], [1, nan]])
    partly = Ensemble((1, 2, 3, 4), errors, lost, np.array([4, 2]), "px")
    np.testing.assert_array_equal([partly.holding, *partly.quantiles], [[0.5, 0.5], [1, 3], [2, 3], [9, 4]])
    assert (told["runs"], told["frames"], told["high"], told["holding"][1]) == (10, 3, [9.0, None, None], None)
