"""Checkpoints: what was computed comes back, and nothing else."""

import os
import pickle
import zlib
from pathlib import Path

import pytest

from pftrack.core.model.recipe import Change
from pftrack.experiments import EXPERIMENTS
from pftrack.runs import checkpoint
from pftrack.runs.run import Run

FRAMES, FAR = 24, 17


def begun(
    name: str = "ball", tracker: str | None = None, *timeline: Change, seed: int = 3, frames: int = FRAMES
) -> Run:
    experiment = EXPERIMENTS[name]
    return Run(experiment, experiment.simulate(), tracker=tracker, seed=seed, frames=frames, timeline=timeline)


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    """The checkpoint of a ball's run that stands at frame 17."""
    run = begun()
    run.seek(FAR)
    path = tmp_path / "run.states"
    checkpoint.write(run.checkpoint(), path)
    return path


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


def test_coming_back_repeats_no_step(kept: Path) -> None:
    """The furthest frame of a checkpoint is reached without a step."""
    run = begun()
    found = checkpoint.read(kept, "pftrack")
    assert found is not None
    run.recall(found)
    assert [step.diagnostics.frame for step in run.seeking(FAR)] == [FAR]


@pytest.mark.parametrize(
    "other",
    [
        begun(seed=4),
        begun("ball", "apf"),
        begun("ball", None, Change(FAR, {"sample_count": 90})),
    ],
)
def test_another_run_does_not_take_it(kept: Path, other: Run) -> None:
    """A checkpoint of another seed, tracker or past is left alone."""
    found = checkpoint.read(kept, "pftrack")
    assert found is not None
    assert not other.recall(found)
    assert other.computed == 0


def test_other_numbers_are_not_believed(kept: Path) -> None:
    """A checkpoint from which one more step leads elsewhere than it says is left alone."""
    found = checkpoint.read(kept, "pftrack")
    states = dict(found.states)
    states[16] = states[8]
    run = begun()
    assert not run.recall(checkpoint.Checkpoint(found.recipe, found.diagnostics, states))
    assert run.computed == 0


def test_a_run_that_has_not_moved_has_nothing_to_recall() -> None:
    """A checkpoint of frame 0 alone, or of states without the furthest frame, is left alone."""
    assert not begun().recall(begun().checkpoint())
    far = begun()
    far.seek(FAR)
    whole = far.checkpoint()
    cut = {frame: state for frame, state in whole.states.items() if frame < FAR}
    assert not begun().recall(checkpoint.Checkpoint(whole.recipe, whole.diagnostics, cut))


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
