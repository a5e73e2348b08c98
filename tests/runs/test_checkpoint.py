"""Checkpoints: what was computed comes back, and nothing else."""

import os
import pickle
import zlib
from dataclasses import replace
from pathlib import Path

import pytest

from pftrack.core.model.recipe import Change
from pftrack.experiments import EXPERIMENTS
from pftrack.runs import checkpoint
from pftrack.runs.checkpoint import Checkpoint
from pftrack.runs.run import Run

FAR = 17


def begun(name: str = "ball", tracker: str | None = None, *timeline: Change, seed: int = 3, frames: int = 24) -> Run:
    experiment = EXPERIMENTS[name]
    return Run(experiment, experiment.simulate(), tracker=tracker, seed=seed, frames=frames, timeline=timeline)


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    """The checkpoint of a ball's run that stands at frame 17."""
    run = begun()
    run.seek(FAR)
    checkpoint.write(run.checkpoint(), tmp_path / "run.states")
    return tmp_path / "run.states"


@pytest.fixture
def found(kept: Path) -> Checkpoint:
    """What was read of it."""
    read = checkpoint.read(kept, "pftrack")
    assert read is not None
    return read


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_a_run_goes_on_to_the_same_numbers(name: str, tmp_path: Path) -> None:
    """A run that takes over a checkpoint stands where the other stood, and ends with its numbers, to the bit."""
    run, path = begun(name, frames=8), tmp_path / "run.states"
    run.seek(5)
    checkpoint.write(run.checkpoint(), path)
    again = begun(name, frames=8)
    found = checkpoint.read(path, "pftrack")
    assert found is not None
    assert again.recall(found)
    assert repr(again.diagnostics) == repr(run.diagnostics)  # as text, in which "not a number" equals itself
    again.seek(2)
    again.finish()
    run.finish()
    assert again.estimates_sha256 == run.estimates_sha256


def test_coming_back_repeats_no_step(found: Checkpoint) -> None:
    """The furthest frame of a checkpoint is reached without a step."""
    run = begun()
    run.recall(found)
    assert [step.diagnostics.frame for step in run.seeking(FAR)] == [FAR]


@pytest.mark.parametrize(
    "other", [begun(seed=4), begun("ball", "apf"), begun("ball", None, Change(FAR, {"sample_count": 90}))]
)
def test_another_run_does_not_take_it(found: Checkpoint, other: Run) -> None:
    """A checkpoint of another seed, tracker or past is left alone."""
    assert (other.recall(found), other.computed) == (False, 0)


def test_what_leads_elsewhere_or_nowhere_is_not_believed(found: Checkpoint) -> None:
    """A checkpoint with other numbers, without the furthest frame, or of frame 0 alone, is left alone."""
    elsewhere = {**found.states, 16: found.states[8]}
    cut = {frame: state for frame, state in found.states.items() if frame < FAR}
    for wrong in (replace(found, states=elsewhere), replace(found, states=cut), begun().checkpoint()):
        run = begun()
        assert (run.recall(wrong), run.computed) == (False, 0)


def test_a_damaged_file_is_none(kept: Path) -> None:
    """A file that was cut short, changed, written by another version or is missing is no checkpoint."""
    whole = kept.read_bytes()
    changed = bytearray(whole)
    changed[-100] ^= 1
    for data in (whole[:-1], bytes(changed), whole.replace(b"checkpoint 1", b"checkpoint 0"), b""):
        kept.write_bytes(data)
        assert checkpoint.read(kept, "pftrack") is None
    kept.unlink()
    assert checkpoint.read(kept, "pftrack") is None


class Intruder:
    """Makes a folder when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, ...]:
        return os.mkdir, (str(self.path),)


def test_a_file_calls_nothing(kept: Path, tmp_path: Path) -> None:
    """Whatever a file holds, reading it builds values of known classes and calls nothing else."""
    body = pickle.dumps(("recipe", (), {0: Intruder(tmp_path / "made")}))
    kept.write_bytes(checkpoint.HEAD + zlib.crc32(body).to_bytes(4, "big") + body)
    assert checkpoint.read(kept, "pftrack") is None
    assert not (tmp_path / "made").exists()
