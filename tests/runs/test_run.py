"""Runs: the same numbers whichever way one comes."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pftrack.core.model.recipe import Change
from pftrack.core.model.tracker import Step
from pftrack.core.refusal import ConflictError, ParameterError
from pftrack.experiments import find
from pftrack.runs.checkpoint import STATE_BYTES, Keyframes, bytes_of
from pftrack.runs.run import Run
from tests.making import whole_run

BALL = find("ball")
CHANGES = (
    Change(10, {"occlusion_width_px": 70, "sample_count": 200}),
    Change(23, {"frame_rate_hz": 20, "image_noise_sd": 4}),
    Change(31, {"tracker": "s-spf", "smoothing_lag_frames": 4, "learn_dynamics": True}),
)


def ball(tracker: str = "h-spf", **options: object) -> Run:
    return Run(BALL, BALL.simulate(), tracker=tracker, **{"seed": 3, "frames": 45, **options})


def finished(**options: object) -> Run:
    run = ball(**options)
    run.finish()
    return run


def test_change_before_one_to_come_keeps_the_timeline_in_order() -> None:
    """A change made while others are still to come does not bring them forward, and replays to the same numbers."""
    run = ball(timeline=(Change(20, {"sample_count": 100}),))
    run.seek(4)
    run.change({"gamma_px": 9})
    assert run.parameters_at(5).sample_count == 800
    assert (run.parameters_at(20).sample_count, run.parameters_at(20).gamma_px) == (100, 9)
    run.finish()
    assert run.timeline.changes == (Change(5, {"gamma_px": 9}), Change(20, {"sample_count": 100}))
    assert run.estimates_sha256 == finished(timeline=run.timeline.changes).estimates_sha256


def test_change_at_odds_with_one_to_come_is_refused_whole() -> None:
    """A change that would make a later one invalid is refused, and nothing has changed."""
    to_come = (Change(20, {"gamma_max_px": 5.0}),)
    run = ball(timeline=to_come)
    with pytest.raises(ParameterError, match="gamma_min_px must be at most gamma_max_px"):
        run.change({"gamma_min_px": 6})
    assert (run.timeline.changes, run.parameters_at(1).gamma_min_px) == (to_come, 4)


@cache
def straight_through() -> tuple[list[Step], str]:
    """Return the steps of the run with changes, and the hash of its estimates."""
    run = ball(timeline=CHANGES)
    return list(run), run.estimates_sha256


@settings(max_examples=10)
@given(frames=st.lists(st.integers(0, 44), min_size=1, max_size=6))
def test_seeking_anywhere_gives_the_same_states(frames: list[int]) -> None:
    """Whatever way one seeks, forward and back, each frame's state is that of a run straight through."""
    straight, sha256 = straight_through()
    run = ball(timeline=CHANGES)
    for frame in frames:
        step = run.seek(frame)
        assert run.position == frame
        assert step.diagnostics.estimate == straight[frame].diagnostics.estimate
        assert np.array_equal(step.state.particles.states, straight[frame].state.particles.states)
        assert np.array_equal(step.state.particles.log_weights, straight[frame].state.particles.log_weights)
        assert np.array_equal(step.frame.image_rgb, straight[frame].frame.image_rgb)
        assert step.tracker == straight[frame].tracker
    run.finish()
    assert run.estimates_sha256 == sha256


def test_seeking_back_does_not_forget() -> None:
    """Going back keeps the head and all diagnostics; going on from there computes nothing anew."""
    run = finished(timeline=CHANGES)
    before = list(run.diagnostics)
    run.seek(7)
    assert run.computed == 44
    run.advance()
    assert run.diagnostics == before


def test_branch_shares_the_past_and_only_that() -> None:
    """A branch has the same frames up to its root and goes its own way from there; the trunk does not notice."""
    trunk = finished(timeline=CHANGES)
    sha = trunk.estimates_sha256
    branch = trunk.branch(20, {"tracker": "condensation", "sample_count": 100})
    assert branch.position == branch.computed == 20
    branch.finish()
    assert branch.diagnostics[:21] == trunk.diagnostics[:21]
    assert branch.diagnostics[21].estimate != trunk.diagnostics[21].estimate
    assert branch.timeline.changes == (CHANGES[0], Change(21, {"tracker": "condensation", "sample_count": 100}))
    assert trunk.estimates_sha256 == sha
    assert branch.estimates_sha256 == finished(timeline=branch.timeline.changes).estimates_sha256


def test_a_branch_from_the_last_frame_has_nothing_to_change() -> None:
    """A change there would count from a frame that the run does not have, and no recipe may hold it."""
    run, sentence = finished(frames=5), "frame must be 0 to 3, since a change counts from the next frame on, got 4"
    with pytest.raises(ParameterError, match=sentence):
        run.branch(4, {"sample_count": 100})
    assert run.branch(4).position == 4


def test_the_past_is_the_past() -> None:
    """A change at a frame that has been computed is refused and says to branch; nothing has changed."""
    run = finished(frames=14)
    run.seek(12)
    with pytest.raises(ConflictError, match="branch"):
        run.change({"gamma_px": 9})
    assert run.timeline.changes == ()


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
    """A refused change leaves timeline and parameters as they were."""
    run = ball()
    run.seek(5)
    for values in ({"gamma_px": 7, "sample_count": 0}, {"tracker": "magic"}, {"nothing": 1}, {"gamma_min_px": 30}):
        with pytest.raises(ParameterError):
            run.change(values)
    with pytest.raises(ParameterError, match="before the run starts"):
        run.change({"image_width_px": 640})
    assert (run.timeline.changes, run.parameters_at(6)) == ((), run.parameters_at(0))


def test_two_changes_of_one_frame_are_one() -> None:
    """Changes before the next frame is computed add up, the later value counting."""
    run = ball()
    run.change({"gamma_px": 7, "sample_count": 100})
    run.change({"gamma_px": 8})
    assert run.timeline.changes == (Change(1, {"gamma_px": 8.0, "sample_count": 100}),)
    assert run.parameters_at(1).gamma_px == 8
    assert len(run.advance().state.particles) == 100


def test_the_end() -> None:
    """After the last frame there is none, neither to compute nor to change."""
    run = finished(frames=3)
    with pytest.raises(ConflictError, match="frame 2"):
        run.advance()
    with pytest.raises(ConflictError):
        run.change({"gamma_px": 7})
    for frame in (-1, 3):
        with pytest.raises(ParameterError, match="between 0 and 2"):
            run.seek(frame)


@pytest.mark.parametrize(
    "options", [{"frames": 0}, {"frames": 10**9}, {"seed": -1}, {"tracker": "magic"}, {"timeline": (Change(-1, {}),)}]
)
def test_bad_beginnings_are_refused(options: dict[str, object]) -> None:
    """A length, seed, tracker or timeline that cannot be is refused with its bound."""
    with pytest.raises(ParameterError):
        ball(**options)


def test_success_counts_lost_frames() -> None:
    """The summary counts what the diagnostics say, and frame by frame lost means further than three radii."""
    run = finished(tracker="condensation", frames=60)
    summary = run.summary().as_dict()
    lost = [row.frame for row in run.diagnostics if row.error > 15]
    assert summary["lost_frames"] == len(lost) > 15
    assert (summary["first_lost_frame"], summary["success"]) == (lost[0], False)
    assert summary["hit_rate"] == pytest.approx(1 - len(lost) / 60)
    assert summary["mean_error_px"] == pytest.approx(np.mean([row.error for row in run.diagnostics]))
    assert not any(row.searching for row in run.diagnostics)


def test_keyframes_stay_within_their_budget() -> None:
    """When the budget is used up every other keyframe goes; frame 0 always stays."""
    states = [step.state for step in ball(frames=40)]
    keyframes = Keyframes(interval=1, budget_bytes=300_000)
    for frame, state in enumerate(states):
        keyframes.offer(frame, state)
    assert keyframes.latest(0)[0] == 0
    held = {keyframes.latest(frame)[0] for frame in range(40)}
    assert 2 <= len(held) <= 10
    assert all(np.array_equal(keyframes.latest(k)[1].estimate, states[k].estimate) for k in held)


def test_a_keyframe_counts_once_in_the_budget() -> None:
    """A state that is offered again, as by a checkpoint, takes no more of it; nor does what states share."""
    states, known = [step.state for step in ball(frames=3)], set[int]()
    keyframes = Keyframes(interval=1, budget_bytes=3 * (STATE_BYTES + bytes_of(states[1], known)))
    for frame in (0, 0, 0, 1, 1, 2):
        keyframes.offer(frame, states[frame])
    assert list(keyframes.states) == [0, 1, 2]
    assert bytes_of(states[1], set()) >= states[1].particles.states.nbytes
    assert bytes_of(replace(states[1], log_evidence=1.0), known) == 0


class _Plain:
    def __init__(self, **parts: object) -> None:
        vars(self).update(parts)


def test_the_memory_of_any_state_is_counted() -> None:
    """Lists, mappings, numbers of NumPy, objects of any class and what leads back to itself; views count as wholes."""
    whole, other = np.zeros(100), np.zeros(10)
    state = _Plain(a=[whole[:3], whole[3:], np.float64(1.0), "text", None], b={"c": (other, _Plain), "d": np.int64(2)})
    vars(state)["again"] = [state]
    known: set[int] = set()
    assert bytes_of(state, known) == whole.nbytes + other.nbytes
    assert bytes_of({"a": whole[5:], "b": state}, known) == 0
    particles = ball(frames=3).current.state.particles
    without = bytes_of(replace(particles), set())
    assert bytes_of(particles, set()) == without + particles.weights.nbytes


def test_a_state_may_know_all_before_it() -> None:
    """A chain of states as long as a run is counted without recursion."""
    chain: object = None
    for _ in range(20_000):
        chain = _Plain(before=chain, array=np.zeros(1))
    assert bytes_of(chain, set()) == 20_000 * 8


def test_steps_are_replayed_while_the_run_stands_where_it_is() -> None:
    """Steps of the past come again, to the bit, and neither the place of the run nor its numbers have changed."""
    run, steps = ball(timeline=CHANGES), {}
    for step in run:
        steps[step.frame.index] = step.state.estimate.copy()
    run.seek(20)
    before = run.estimates_sha256
    for first, last in ((0, 2), (9, 13), (20, 24), (19, 19), (44, 44)):
        replayed = list(run.replay(first, last))
        assert [step.frame.index for step in replayed] == list(range(first, last + 1))
        assert all((step.state.estimate == steps[step.frame.index]).all() for step in replayed)
    assert (run.position, run.computed, run.estimates_sha256) == (20, 44, before)
    for first, last in ((-1, 3), (4, 3), (0, 45)):
        with pytest.raises(ParameterError):
            list(run.replay(first, last))
