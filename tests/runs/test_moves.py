"""What a person puts elsewhere in a run: it is part of the timeline, and refused where it means nothing."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pftrack
from pftrack.analysis.other_seeds import takes_all_at_once
from pftrack.core.model.recipe import Recipe
from pftrack.core.refusal import ConflictError, ParameterError, RefusedError
from pftrack.experiments import find
from pftrack.runs.many import Trial, read_blocks
from pftrack.runs.reproduction import make
from pftrack.runs.run import Run

FRAMES = 11


def run_at(experiment: str, frame: int, tracker: str | None = None, **values: Any) -> Run:
    """Return a run that stands in a frame, with values from frame 0 on."""
    timeline = ({"frame": 0, "values": values},) if values else ()
    run = make(Recipe(experiment=experiment, frames=FRAMES, seed=3, tracker=tracker, timeline=timeline))
    run.seek(frame)
    return run


@pytest.mark.parametrize(("experiment", "place"), [("ball", (100, 60)), ("fish", (200, 80)), ("sine", (0.5,))])
def test_a_move_survives_replay_branch_and_file(experiment: str, place: tuple[float, ...], tmp_path: Path) -> None:
    """A particle and then the estimate are moved; a replay, a branch and a file have the same numbers."""
    run = run_at(experiment, 6)
    before = run.current.state
    run.change({"move": {"particle": 2, "place": place}})
    assert run.moved.particles.states[2, : len(place)].tolist() == pytest.approx(place)
    assert run.current.state is before
    run.change({"move": {"place": place}})
    assert run.moved.estimate.tolist() == pytest.approx(place)
    (change,) = run.timeline.changes
    told = [{"particle": 2, "place": list(place)}, {"particle": None, "place": list(place)}]
    assert (change.frame, change.values) == (7, {"move": told})
    run.finish()
    found = run.estimates_sha256
    branch = run.branch(9)
    branch.finish()
    again = make(Recipe.model_validate_json(run.recipe.model_dump_json()))
    again.finish()
    run.save(tmp_path / "run.pft")
    loaded = pftrack.load(tmp_path / "run.pft")
    loaded.finish()
    run.seek(7)
    assert run.current.diagnostics.estimate == again.diagnostics[7].estimate
    trial = Trial(run.experiment, run.source, run.timeline, run.seed)
    for block in read_blocks(run.source, run.timeline.history, 0, FRAMES - 1):
        trial.take(block)
    assert {branch.estimates_sha256, again.estimates_sha256, loaded.estimates_sha256} == {found}
    assert (run.experiment.judge.scale * trial.estimates).tolist() == [list(row.estimate) for row in run.diagnostics]
    assert takes_all_at_once(run, run.timeline, 7) is None


def test_what_is_moved_keeps_its_velocity_and_the_rest_its_place() -> None:
    """The place before is shifted with the place, and a particle alone moves the mean by its weight."""
    run = run_at("ball", 6)
    states, mean = run.current.state.particles.states.copy(), run.current.state.estimate
    run.change({"move": {"particle": 5, "place": (10, 20)}})
    off = run.moved.particles.states - states
    assert np.flatnonzero(off.any(axis=1)).tolist() == [5]
    assert off[5, :2].tolist() == pytest.approx(off[5, 2:].tolist())
    weight = np.exp(run.moved.particles.log_weights[5])
    assert run.moved.estimate - mean == pytest.approx(weight * off[5, :2])


@pytest.mark.parametrize(
    ("move", "sentence"),
    [
        ({"particle": 800, "place": (1, 2)}, "particle must be one of frame 6, 0 to 799, got 800"),
        ({"particle": -1, "place": (1, 2)}, "move must be a place of finite numbers"),
        ({"place": (1, np.nan)}, "move must be a place of finite numbers"),
        ({"place": (320, 2)}, r"place must be within bounds \(0 to 319, 0 to 239\), got \[320.0, 2.0\]"),
        ({"place": (1, 2), "weight": 1}, "move must be a place of finite numbers"),
        ([{"place": (1, 2)}] * 101, "move must be at most 100 before one frame, got 101"),
    ],
)
def test_refuses_what_cannot_be_moved(move: Any, sentence: str) -> None:
    """A particle that is not there, a place outside or unknown: nothing has changed."""
    run = run_at("ball", 6)
    with pytest.raises(ParameterError, match=sentence):
        run.change({"move": move})
    assert run.timeline.changes == ()
    with pytest.raises(RefusedError, match="move must be made before frame 1 or later"):
        run_at("ball", 0, move={"place": (1, 2)})


def test_moves_fit_tracker_and_experiment() -> None:
    """A tracker without particles has none to move; an experiment without a cloud in its picture has no moves."""
    kalman = run_at("ball", 6, tracker="kalman")
    with pytest.raises(ParameterError, match="particle must be left out: the tracker has none, got 0"):
        kalman.change({"move": {"particle": 0, "place": (1, 2)}})
    timeline = ({"frame": 1, "values": {"move": {"place": (1, 2)}}},)
    with pytest.raises(RefusedError, match=f"move must be left out: {find('structure').title} has nothing"):
        make(Recipe(experiment="structure", frames=FRAMES, timeline=timeline))


def test_what_is_dragged_in_a_drawing_lands_within_its_bounds() -> None:
    """A place of the drawing is the value that it shows, of the first copy alone, and clipped; others are refused."""
    ball, sine = run_at("ball", 6), run_at("sine", 6, dimension=2)
    assert ball.landing(6, 3, (-50, 100))["move"].words == "Particle 3 moved to (0, 100)"
    signal = sine.landing(6, 3, (44.0, 200.0))["move"]
    assert signal.place == (0.0, sine.current.state.particles.states[3, 1])
    assert sine.landing(6, None, (44.0, -1e3))["move"].place[0] == 1.6
    with pytest.raises(ParameterError, match="particle must be below 800, the number of particles drawn, got 800"):
        ball.landing(6, 800, (1, 2))
    with pytest.raises(ConflictError, match="frame 5 is not shown any more"):
        ball.landing(5, 3, (1, 2))
