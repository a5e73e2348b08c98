import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from pftrack.core.numerics import machine
from pftrack.experiments import find
from pftrack.runs.record import Saved, read_saved, save
from pftrack.runs.reproduction import departure, difference
from pftrack.runs.run import Run
from tests.making import whole_run


@pytest.fixture
def run() -> Run:
    experiment = find("sine")
    return whole_run(experiment, seed=4, frames=12)


@pytest.fixture
def saved(run: Run, tmp_path: Path) -> Saved:
    save(run, tmp_path / "run.pft")
    return read_saved(tmp_path / "run.pft")


def test_the_same_numbers_do_not_differ(run: Run, saved: Saved) -> None:
    """A run and its own file are equal, and the file says on what it was computed."""
    assert difference(run, saved) is None
    assert saved.record.computed_on == machine.describe_platform()
    assert saved.estimates.shape == (12, 1)


def test_the_first_frame_that_differs_is_named(run: Run, saved: Saved) -> None:
    """Other numbers are told with the first frame, by how much at most, and what was different about the machine."""
    record = saved.record.model_copy(
        update={"estimates_sha256": "0" * 64, "computed_on": {**machine.describe_platform(), "numpy": "1.0"}}
    )
    estimates = saved.estimates.copy()
    estimates[5:] += 0.25
    estimates[7] = np.nan
    apart = difference(run, Saved(record, estimates))
    assert (apart.frame, apart.largest) == (5, pytest.approx(0.25))
    assert apart.sentence.startswith("the numbers differ from the saved ones from frame 5 on, by up to 0.25; ")
    assert f"numpy 1.0 (here {machine.describe_platform()['numpy']})" in apart.sentence
    assert json.loads(json.dumps(apart.as_dict()))["first_frame"] == 5


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_differs_by_no_number(run: Run, saved: Saved, value: float) -> None:
    """Where a number stands against none, the frame is told but no distance; JSON has no such number either."""
    record = saved.record.model_copy(update={"estimates_sha256": "0" * 64})
    estimates = saved.estimates.copy()
    estimates[3] = value
    apart = difference(run, Saved(record, estimates))
    assert (apart.frame, apart.largest) == (3, None)
    assert apart.sentence.startswith("the numbers differ from the saved ones from frame 3 on; ")
    assert json.loads(json.dumps(apart.as_dict(), allow_nan=False))["largest"] is None
    both = np.full((2, 1), value)
    assert departure(both.tolist(), Saved(record, both)) is None


def test_numbers_of_another_shape_are_not_compared(run: Run, saved: Saved) -> None:
    """A file whose estimates have other components, as of another version, is told apart by its hash alone."""
    record = saved.record.model_copy(update={"estimates_sha256": "0" * 64})
    apart = difference(run, Saved(record, np.zeros((12, 3))))
    assert (apart.frame, apart.largest) == (None, None)


def test_a_file_without_numbers_is_told_apart_by_its_hash(run: Run, saved: Saved) -> None:
    """Without saved estimates there is no frame to name, and the sentence does without."""
    other = dataclasses.replace(saved, estimates=None, record=saved.record.model_copy(update={"estimates_sha256": ""}))
    apart = difference(run, other)
    assert apart.frame is None
    assert apart.sentence.startswith("the numbers differ from the saved ones; ")
