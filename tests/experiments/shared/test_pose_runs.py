"""Runs of the experiments that estimate a pose: the same numbers whichever way one comes, and never NaN."""

import json
from collections.abc import Iterator

import numpy as np
import pytest

from pftrack.core.model.parameters import Value, declarations
from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.experiments.shared.pose.calibrated import AS_PUBLISHED
from pftrack.runs.run import Run
from tests.making import whole_run

HEAD, PRISM = find("head"), find("prism")
SMALL: dict[str, Value] = {"image_width_px": 160, "feature_noise_px": 1.5, "slack_px": 2.0, "initial_speed_px": 2.0}
"""A small picture, and what is assumed in px of it."""

FEW: dict[str, Value] = {"joint_sample_count": 300}


def begun(name: str, tracker: str, frames: int = 26, **values: Value) -> Run:
    experiment = find(name)
    initial = {**(SMALL if name == "head" else {}), **FEW, **values}
    return Run(
        experiment, experiment.simulate(), tracker=tracker, seed=4, frames=frames, timeline=(Change(0, initial),)
    )


@pytest.mark.parametrize("name", ["prism", "head"])
def test_a_branch_has_the_mixing_ratio_of_its_own_method(name: str) -> None:
    """From the frame in which a branch turns to prediction alone, every feature is drawn from it."""
    run = begun(name, "pf-asd")
    run.seek(10)
    branch = run.branch(10, {"tracker": "alpha-0"})
    assert set(branch.advance().diagnostics.series["alpha"]) == {0.0}


def numbers(value: object) -> Iterator[float]:
    if isinstance(value, dict):
        for item in value.values():
            yield from numbers(item)
    elif isinstance(value, list):
        for item in value:
            yield from numbers(item)
    elif isinstance(value, float):
        yield value


def extremes(name: str) -> list[tuple[str, Value]]:
    experiment = find(name)
    chosen: list[tuple[str, Value]] = []
    for declaration in declarations(type(experiment.simulate().parameters)):
        options: list[Value] = list(declaration.choices)
        if declaration.kind in {"integer", "number"} and declaration.name not in {"joint_sample_count", "person"}:
            assert declaration.minimum is not None
            assert declaration.maximum is not None
            kind = int if declaration.kind == "integer" else float
            options = [kind(declaration.minimum), kind(min(declaration.maximum, 1280))]
        elif declaration.kind == "boolean":
            options = [True]
        chosen += [(declaration.name, option) for option in options]
    return chosen


@pytest.mark.parametrize(("name", "field", "value"), [(n, f, v) for n in ("prism", "head") for f, v in extremes(n)])
def test_extreme_parameters_give_finite_estimates(name: str, field: str, value: Value) -> None:
    """At the bounds of every parameter the estimate is finite and what is written down is JSON."""
    run = begun(name, "pf-asd", **{"frames": 3, field: value})  # type: ignore[arg-type] # frames are no parameter
    run.finish()
    for row in run.diagnostics:
        assert np.isfinite([*row.estimate, *row.sigma]).all()
        assert np.isfinite(list(numbers(json.loads(json.dumps(row.as_dict(), allow_nan=False))))).all()


@pytest.mark.parametrize("count", [10, 100_000])
def test_joint_particles_may_be_few_or_many(count: int) -> None:
    """With the fewest and the most joint particles the estimate is finite."""
    run = begun("prism", "rb-pf", frames=3, joint_sample_count=count)
    assert np.isfinite(run.finish().diagnostics.estimate).all()


def test_series_say_what_they_are_called() -> None:
    """Yaw is minus theta_y, every feature has a number, and the truth beside the estimate is that of the frame."""
    row = begun("head", "pf-asd", frames=20).finish().diagnostics
    assert row.series["yaw_deg"] == pytest.approx(-row.estimate[1])
    assert row.series["pitch_deg"] == pytest.approx(-row.estimate[0])
    assert row.truth is not None
    assert row.series["yaw_deg_true"] == pytest.approx(-row.truth[1])
    assert row.error == pytest.approx(np.abs(np.subtract(row.estimate, row.truth)).mean())
    for name in ("alpha", "correlation", "feature_recognised", "feature_error_px", "feature_sd_px", "feature_visible"):
        assert len(row.series[name]) == 11
    assert set(row.series["within_50"]) <= {0.0, 1.0}


def test_alpha_rises_while_a_corner_hides() -> None:
    """Over the prism's course, alpha of a rear corner is higher while hidden, by Bando's figure."""
    run = whole_run(PRISM, tracker="pf-asd", seed=1, values=AS_PUBLISHED)
    alpha = np.array([row.series["alpha"] for row in run.diagnostics])[:, 1::2]
    visible = np.array([row.series["feature_visible"] for row in run.diagnostics])[:, 1::2] > 0
    assert alpha[~visible].mean() > alpha[visible].mean() + 0.15
    assert run.summary().verdict.mean_error == pytest.approx(1.85, abs=0.15)
    assert run.summary().verdict.success is True


def test_each_angle_has_its_own_deviation() -> None:
    """Yaw is a turn about y, pitch about x, roll about z, and so are their deviations."""
    row = begun("prism", "pf-asd", frames=40).finish().diagnostics
    spread = [row.series[f"{name}_deg_sd"] for name in ("pitch", "yaw", "roll")]
    assert spread == pytest.approx(row.sigma)
    assert len({round(value, 6) for value in row.sigma}) == 3
