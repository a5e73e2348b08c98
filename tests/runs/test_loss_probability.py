"""The probability of a loss is told from the rows: of runs of any age, as they go on, and by the tracker in force."""

import json
from pathlib import Path

import numpy as np
import pytest

from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.experiments.shared.loss_probability import Scenes, read_declaration
from pftrack.runs.loss_probability import LossAccount, loss_probabilities
from pftrack.runs.run import Run
from tools.loss_probability import describe_models, write_models

BALL = find("ball")
FRAMES = 40


def _run(values: dict[str, Value] | None = None, frames: int = FRAMES) -> Run:
    timeline = (Change(0, values or {}),)
    return Run(BALL, BALL.simulate(), tracker="h-spf", seed=0, frames=frames, timeline=timeline)


@pytest.fixture(scope="module")
def lost() -> Run:
    run = _run({"occlusion_width_px": 100, "distracter_radius_px": 18})
    run.finish()
    return run


def test_it_is_high_where_the_ball_is_lost_and_low_where_it_is_held(lost: Run) -> None:
    """Behind a wide pillar the ball is lost and the tracker says so; without one it says that it follows."""
    told = loss_probabilities(lost)
    assert np.isnan(told[0])
    truly = np.array([row.lost is True for row in lost.diagnostics])
    assert told[truly].mean() > 0.8
    held = _run({"occlusion_width_px": 0, "distracter_radius_px": 0})
    held.finish()
    assert not any(row.lost for row in held.diagnostics)
    assert loss_probabilities(held)[1:].max() < 0.2


def test_a_run_that_goes_on_is_told_the_same(lost: Run) -> None:
    """Frame by frame, in pieces and at once come to the same bits, and a branch begins again."""
    run, account = _run({"occlusion_width_px": 100, "distracter_radius_px": 18}), LossAccount()
    for frame in (3, 4, 20, FRAMES - 1):
        run.seek(frame)
        found = account.follow(run)
    assert np.array_equal(found, loss_probabilities(lost), equal_nan=True)
    assert np.array_equal(account.follow(run), found, equal_nan=True)
    branch = run.branch(10, {"sample_count": 50})
    assert np.array_equal(account.follow(branch), found[:11], equal_nan=True)


def test_a_tracker_that_takes_over_begins_anew() -> None:
    """Its first frame has no probability, and one without a model has none at all."""
    run = _run()
    run.seek(9)
    run.change({"tracker": "apf"})
    run.finish()
    told = loss_probabilities(run)
    assert np.flatnonzero(np.isnan(told)).tolist() == [0, 10]


def test_a_file_of_probabilities_comes_back(tmp_path: Path) -> None:
    """Written and read again, models tell the same; what is no such file, or of another tracker, is refused."""
    path, scenes = tmp_path / "loss_probability.json", Scenes({})
    models = BALL.quality.loss_probability.models
    described = describe_models(models, {"kalman": 0.5}, {"experiment": "ball"})
    path.write_text(write_models(described), "utf-8")
    again = read_declaration(path, BALL.trackers, scenes)
    assert (again.models, again.refused) == (models, {"kalman": 0.5})
    raw = json.loads(path.read_text("utf-8"))
    for wrong in ({}, raw | {"version": 2}, raw | {"trackers": {"nobody": raw["trackers"]["h-spf"]}}):
        path.write_text(json.dumps(wrong), "utf-8")
        with pytest.raises(ValueError, match="is not a file of loss probabilities"):
            read_declaration(path, BALL.trackers, scenes)
