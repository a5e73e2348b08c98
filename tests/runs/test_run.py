"""Runs: the same numbers whichever way one comes."""

import json
import math
import os
import pickle
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pftrack.core import files
from pftrack.core.model.measures import Measure
from pftrack.core.model.recipe import Change
from pftrack.core.model.series import Series
from pftrack.core.model.tracker import diagnose
from pftrack.core.refusal import ConflictError, ParameterError
from pftrack.experiments import EXPERIMENTS, find
from pftrack.experiments.experiment import Experiment, Measured
from pftrack.runs import checkpoint
from pftrack.runs.checkpoint import STATE_BYTES, Checkpoint, Keyframes, bytes_of
from pftrack.runs.run import Run
from tests.making import whole_run

BALL = find("ball")
CHANGES = (
    Change(10, {"occlusion_width_px": 70, "sample_count": 200}),
    Change(23, {"frame_rate_hz": 20, "image_noise_sd": 4}),
    Change(31, {"tracker": "s-spf", "smoothing_lag_frames": 4, "learn_dynamics": True}),
)


def begun(name: str = "ball", **options: object) -> Run:
    experiment = EXPERIMENTS[name]
    return Run(experiment, experiment.simulate(), **{"seed": 3, "frames": 45, **options})


def test_change_before_one_to_come_keeps_the_timeline_in_order() -> None:
    """A change made while others are still to come does not bring them forward, and replays to the same numbers."""
    run = begun(frames=24, timeline=(Change(20, {"sample_count": 100}),))
    run.seek(4)
    run.change({"gamma_px": 9})
    assert run.parameters_at(5).sample_count == 800
    assert (run.parameters_at(20).sample_count, run.parameters_at(20).gamma_px) == (100, 9)
    run.finish()
    assert run.timeline.changes == (Change(5, {"gamma_px": 9}), Change(20, {"sample_count": 100}))
    assert run.estimates_sha256 == whole_run(BALL, seed=3, frames=24, timeline=run.timeline.changes).estimates_sha256


def test_a_branch_from_the_last_frame_has_nothing_to_change() -> None:
    """A change there would count from a frame that the run does not have, and no recipe may hold it."""
    run = whole_run(BALL, frames=5)
    sentence = "frame must be 0 to 3, since a change counts from the next frame on, got 4"
    with pytest.raises(ParameterError, match=sentence):
        run.branch(4, {"sample_count": 100})
    assert run.branch(4).position == 4
    # A branch leaves the later changes of its run behind.
    branch = begun(timeline=CHANGES).branch(0, {"sample_count": 100})
    assert branch.timeline.changes == (Change(1, {"sample_count": 100}),)


def test_what_is_only_drawn_changes_in_the_past_and_at_the_end() -> None:
    """It changes no number, so nothing has to be computed again; what is to change later stays."""
    fish = find("fish")
    run = whole_run(fish, frames=4)
    before = run.estimates_sha256
    run.change({"shown_mode": 2})
    run.seek(1)
    run.change({"shown_mode": 4})
    assert run.timeline.changes == (Change(2, {"shown_mode": 4}), Change(3, {"shown_mode": 2}))
    assert run.estimates_sha256 == before
    with pytest.raises(ConflictError, match="branch"):
        run.change({"shown_mode": 1, "sample_count": 100})
    assert whole_run(fish, frames=4, timeline=run.timeline.changes).estimates_sha256 == before


def test_bad_changes_change_nothing() -> None:
    """A refused change leaves timeline and parameters as they were; a run with bad options does not begin.

    Changes before the next frame is computed add up, the later value counting.
    """
    run = begun()
    run.seek(5)
    for values in ({"gamma_px": 7, "sample_count": 0}, {"tracker": "magic"}, {"nothing": 1}, {"gamma_min_px": 30}):
        with pytest.raises(ParameterError):
            run.change(values)
    for options in ({"frames": 0}, {"frames": 10**9}, {"seed": -1}, {"timeline": (Change(-1, {}),)}):
        with pytest.raises(ParameterError):
            begun(**options)
    with pytest.raises(ParameterError, match="before the run starts"):
        run.change({"image_width_px": 640})
    assert (run.timeline.changes, run.parameters_at(6)) == ((), run.parameters_at(0))
    run.change({"gamma_px": 7, "sample_count": 100})
    run.change({"gamma_px": 8})
    assert run.timeline.changes == (Change(6, {"gamma_px": 8.0, "sample_count": 100}),)
    assert len(run.advance().state.particles) == 100
    # A change that would make a later one invalid is refused as well.
    run = begun(timeline=(Change(20, {"gamma_max_px": 5.0}),))
    with pytest.raises(ParameterError, match="gamma_min_px must be at most gamma_max_px"):
        run.change({"gamma_min_px": 6})
    assert (run.timeline.changes, run.parameters_at(1).gamma_min_px) == ((Change(20, {"gamma_max_px": 5.0}),), 4)


def test_the_end() -> None:
    """After the last frame there is none, neither to compute nor to change."""
    run = whole_run(BALL, seed=3, frames=3)
    with pytest.raises(ConflictError, match="frame 2"):
        run.advance()
    with pytest.raises(ConflictError):
        run.change({"gamma_px": 7})
    for frame in (-1, 3):
        with pytest.raises(ParameterError, match="between 0 and 2"):
            run.seek(frame)


def test_keyframes_stay_within_their_budget() -> None:
    """When the budget is used up every other keyframe goes; frame 0 always stays.

    A state that is offered again, as by a checkpoint, takes no more of it.
    """
    states = [step.state for step in begun(frames=40)]
    keyframes = Keyframes(interval=1, budget_bytes=300_000)
    for frame, state in enumerate(states):
        keyframes.offer(frame, state)
    assert keyframes.latest(0)[0] == 0
    held = {keyframes.latest(frame)[0] for frame in range(40)}
    assert 2 <= len(held) <= 10
    assert all(np.array_equal(keyframes.latest(k)[1].estimate, states[k].estimate) for k in held)
    keyframes = Keyframes(interval=1, budget_bytes=3 * (STATE_BYTES + bytes_of(states[1], set())))
    for frame in (0, 0, 0, 1, 1, 2):
        keyframes.offer(frame, states[frame])
    assert list(keyframes.states) == [0, 1, 2]


def test_the_memory_of_any_state_is_counted() -> None:
    """Lists, mappings, numbers of NumPy, objects of any class and what leads back to itself; views count as wholes.

    What states share counts once, and a chain of states as long as a run is counted without recursion.
    """
    whole, other = np.zeros(100), np.zeros(10)
    state = SimpleNamespace(
        a=[whole[:3], whole[3:], np.float64(1.0), "text", None], b={"c": (other, SimpleNamespace), "d": np.int64(2)}
    )
    vars(state)["again"] = [state]
    known: set[int] = set()
    assert bytes_of(state, known) == whole.nbytes + other.nbytes
    assert bytes_of({"a": whole[5:], "b": state}, known) == 0
    particles = begun(frames=3).current.state.particles
    without = bytes_of(replace(particles), set())
    assert bytes_of(particles, set()) == without + particles.weights.nbytes
    chain: object = None
    for _ in range(20_000):
        chain = SimpleNamespace(before=chain, array=np.zeros(1))
    assert bytes_of(chain, set()) == 20_000 * 8


def test_steps_are_replayed_while_the_run_stays_where_it_is() -> None:
    """Steps of the past are repeated to the bit, also by seeking to and fro; the run and its numbers stay as they are.

    The summary is of all frames, where lost means further than three radii.
    """
    run = begun(timeline=CHANGES)
    steps = list(run)
    before = run.estimates_sha256, list(run.diagnostics)
    for frame in (7, 8, 40, 23, 0, 31, 20):
        step, known = run.seek(frame), steps[frame]
        assert (run.position, step.tracker) == (frame, known.tracker)
        assert np.array_equal(step.state.particles.states, known.state.particles.states)
        assert np.array_equal(step.state.particles.log_weights, known.state.particles.log_weights)
        assert np.array_equal(step.frame.image_rgb, known.frame.image_rgb)
    for first, last in ((0, 2), (9, 13), (20, 24), (19, 19), (44, 44)):
        replayed = list(run.replay(first, last))
        assert [step.frame.index for step in replayed] == list(range(first, last + 1))
        assert all((step.state.estimate == steps[step.frame.index].state.estimate).all() for step in replayed)
    assert (run.position, run.computed) == (20, 44)
    assert (run.estimates_sha256, run.diagnostics) == before
    for first, last in ((-1, 3), (4, 3), (0, 45)):
        with pytest.raises(ParameterError):
            list(run.replay(first, last))
    summary, errors = run.summary().as_dict(), np.array([row.error for row in run.diagnostics])
    assert (summary["lost_frames"], summary["mean_error_px"]) == ((errors > 15).sum(), pytest.approx(errors.mean()))


# Checkpoints: what was computed is restored, and nothing else.

FAR = 17


@pytest.fixture(scope="module")
def found() -> Checkpoint:
    """The checkpoint of a ball's run at frame 17."""
    run = begun()
    run.seek(FAR)
    return run.checkpoint()


@pytest.fixture
def kept(found: Checkpoint, tmp_path: Path) -> Path:
    """Its file."""
    checkpoint.write(found, tmp_path / "run.states")
    return tmp_path / "run.states"


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_a_run_goes_on_to_the_same_numbers(name: str, tmp_path: Path) -> None:
    """A run that takes over a checkpoint is at its frame without a step, and ends with the same numbers, to the bit."""
    run, path = begun(name, frames=6), tmp_path / "run.states"
    run.seek(4)
    checkpoint.write(run.checkpoint(), path)
    again = begun(name, frames=6)
    found = checkpoint.read(path, "pftrack")
    assert again.recall(found)
    assert repr(again.diagnostics) == repr(run.diagnostics)  # as text, in which "not a number" equals itself
    assert [step.diagnostics.frame for step in again.seeking(4)] == [4]
    again.seek(2)
    again.finish()
    run.finish()
    assert again.estimates_sha256 == run.estimates_sha256


def test_a_run_leaves_a_wrong_checkpoint_alone(found: Checkpoint) -> None:
    """One of another seed, tracker or past; one with other numbers, without the furthest frame, or of frame 0 alone."""
    for other in (begun(seed=4), begun(tracker="apf"), begun(timeline=(Change(FAR, {"sample_count": 90}),))):
        assert (other.recall(found), other.computed) == (False, 0)
    elsewhere = {**found.states, 16: found.states[8]}
    cut = {frame: state for frame, state in found.states.items() if frame < FAR}
    for wrong in (replace(found, states=elsewhere), replace(found, states=cut), begun().checkpoint()):
        run = begun()
        assert (run.recall(wrong), run.computed) == (False, 0)


class Intruder:
    """Makes a folder when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, ...]:
        return os.mkdir, (str(self.path),)


def test_a_wrong_file_holds_nothing_and_calls_nothing(kept: Path, tmp_path: Path) -> None:
    """A file that is cut short, changed, of another version or missing is not read; only known classes are built."""
    whole, body = kept.read_bytes(), pickle.dumps(("recipe", (), {0: Intruder(tmp_path / "made")}))
    changed = whole[:-100] + bytes([whole[-100] ^ 1]) + whole[-99:]
    foreign = checkpoint.HEAD + zlib.crc32(body).to_bytes(4, "big") + body
    for data in (whole[:-1], changed, whole.replace(b"checkpoint 1", b"checkpoint 0"), b"", foreign):
        kept.write_bytes(data)
        assert checkpoint.read(kept, "pftrack") is None
    assert not (tmp_path / "made").exists()
    kept.unlink()
    assert checkpoint.read(kept, "pftrack") is None


# Measuring: a series or a measure that fails is left out, with one warning.

SINE = find("sine")

OWN = (Series("own", "Own"), Series("sound", "Sound"))


def failing(*_: object) -> Any:
    raise KeyError("nothing there")


@pytest.fixture(autouse=True)
def _warned_of_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "_warned", set())


def measured(experiment: Experiment, frames: int = 6) -> Run:
    return whole_run(experiment, seed=3, frames=frames)


@pytest.mark.parametrize(
    ("measure", "kept", "warnings"),
    [
        (failing, set(), 1),
        (lambda *_: {"own": None, "sound": 2.0}, {"sound"}, 1),
        (lambda *_: {"own": np.zeros(3), "sound": 2.0}, {"sound"}, 1),
        (lambda *_: {"other": 1.0}, set(), 1),
        (lambda *_: {"own": math.nan}, {"own"}, 0),
    ],
    ids=["raises", "none", "array", "undeclared", "nan"],
)
def test_a_frame_that_cannot_be_measured(
    measure: Callable[..., Any], kept: set[str], warnings: int, caplog: pytest.LogCaptureFixture
) -> None:
    """What an experiment reports wrongly is missing from all frames, and the estimates are what they are without it."""
    run = measured(replace(SINE, measured=Measured(OWN, measure)))
    for row in run.diagnostics:
        assert row.series.keys() & {"own", "sound", "other"} == kept
        json.dumps(row.as_dict(), allow_nan=False)
    assert len(caplog.records) == warnings
    assert run.estimates_sha256 == measured(SINE).estimates_sha256


def test_a_tracker_that_cannot_be_measured(caplog: pytest.LogCaptureFixture) -> None:
    """The same for what a tracker reports; the experiment's own measurements stay."""
    name = SINE.default_tracker
    trackers = {**SINE.trackers, name: replace(SINE.trackers[name], measure=failing)}
    run = measured(replace(SINE, trackers=trackers, measured=Measured(OWN, lambda *_: {"own": 1.0})))
    assert all(row.series == {"own": 1.0} for row in run.diagnostics)
    (warning,) = caplog.records
    assert all(part in warning.getMessage() for part in (name, "frame 0"))


@pytest.mark.parametrize(
    "frames",
    [failing, lambda _: np.zeros(2), lambda course: np.full(len(course.errors), np.inf)],
    ids=["raises", "short", "infinite"],
)
@pytest.mark.filterwarnings("error")
def test_a_measure_that_fails_is_absent(frames: Callable[..., Any], caplog: pytest.LogCaptureFixture) -> None:
    """A run has its other measures and its verdict."""
    broken = Measure("broken", "Broken", "Fails.", "median", frames)
    run = measured(replace(BALL, measured=Measured(measures=(broken, *BALL.measured.measures))))
    expected = measured(BALL).summary()
    for _ in range(3):
        assert run.measures() == run.summary().measures == expected.measures
    assert run.summary().verdict == expected.verdict
    assert len(caplog.records) <= 1


def test_what_a_source_says_by_numpy_can_be_written() -> None:
    """Whether a target is hidden is often a NumPy boolean; its row is JSON all the same."""
    step = measured(find("ball"), frames=1).current
    target = replace(step.frame.target, hidden=np.bool_(1))
    row = diagnose(replace(step.frame, target=target), step.state, (0.0, False), 1.0)
    assert json.loads(json.dumps(row.as_dict()))["hidden"] is True
