import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pftrack.core.numerics import machine
from pftrack.experiments import find
from pftrack.runs.record import Saved, read_saved, save
from pftrack.runs.reproduction import departure, difference
from pftrack.runs.run import Run
from tests.making import whole_run


@pytest.fixture(scope="module")
def run() -> Run:
    return whole_run(find("sine"), seed=4, frames=12)


@pytest.fixture
def saved(run: Run, tmp_path: Path) -> Saved:
    save(run, tmp_path / "run.pft")
    return read_saved(tmp_path / "run.pft")


def other(saved: Saved, estimates: np.ndarray | None, **more: Any) -> Saved:
    """Return a file of other estimates."""
    return Saved(saved.record.model_copy(update={"estimates_sha256": "0" * 64, **more}), estimates)


def test_the_same_numbers_do_not_differ(run: Run, saved: Saved) -> None:
    """A run and its own file are equal, and the file says on what it was computed."""
    assert difference(run, saved) is None
    assert saved.record.computed_on == machine.describe_platform()
    assert saved.estimates.shape == (12, 1)


def test_the_first_frame_that_differs_is_named(run: Run, saved: Saved) -> None:
    """Other numbers are told with the first frame, by how much at most, and what was different about the machine."""
    estimates = saved.estimates.copy()
    estimates[5:] += 0.25
    estimates[7] = np.nan
    apart = difference(run, other(saved, estimates, computed_on={**machine.describe_platform(), "numpy": "1.0"}))
    assert (apart.frame, apart.largest) == (5, pytest.approx(0.25))
    assert apart.sentence.startswith("the numbers differ from the saved ones from frame 5 on, by up to 0.25; ")
    assert f"numpy 1.0 (here {machine.describe_platform()['numpy']})" in apart.sentence
    assert json.loads(json.dumps(apart.as_dict()))["first_frame"] == 5


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_differs_by_no_number(run: Run, saved: Saved, value: float) -> None:
    """Where a number stands against none, the frame is told but no distance; JSON has no such number either."""
    apart = difference(run, other(saved, np.where(np.arange(12)[:, None] == 3, value, saved.estimates)))
    assert (apart.frame, apart.largest) == (3, None)
    assert apart.sentence.startswith("the numbers differ from the saved ones from frame 3 on; ")
    assert json.loads(json.dumps(apart.as_dict(), allow_nan=False))["largest"] is None
    both = np.full((2, 1), value)
    assert departure(both.tolist(), other(saved, both)) is None


def test_numbers_that_are_not_there_or_of_another_shape_are_told_apart_by_their_hash(run: Run, saved: Saved) -> None:
    """Without estimates of the same components, as of another version, the sentence does without a frame."""
    for estimates in (None, np.zeros((12, 3))):
        apart = difference(run, other(saved, estimates))
        assert (apart.frame, apart.largest) == (None, None)
        assert apart.sentence.startswith("the numbers differ from the saved ones; ")
