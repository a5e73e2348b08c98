"""Which parameters a tracker reads that joins an experiment of somebody else's."""

from dataclasses import replace

from pftrack.core.model.tracker import Tracker
from pftrack.experiments import find
from pftrack.runs.run import Run

BALL = find("ball")
MODEL = type(BALL.simulate().parameters)


def read_by(tracker: Tracker) -> set[str]:
    """Return the parameters of the ball that a tracker reads once it has joined."""
    joined = replace(BALL, id="joined", trackers={**BALL.trackers, tracker.id: tracker})
    declared = joined.declarations(MODEL)
    return {each.name for each in declared if not each.trackers or tracker.id in each.trackers}


def test_one_that_no_parameter_names_reads_all() -> None:
    """Parameters name their readers; one that comes later would be left without any of them."""
    own = replace(BALL.trackers["kalman"], id="own", title="Own")
    assert read_by(own) == set(MODEL.model_fields)


def test_it_may_read_what_others_read() -> None:
    """With another one's parameters it has exactly those of that one; without any, those that all trackers read."""
    own = replace(BALL.trackers["condensation"], id="own", title="Own")
    assert read_by(replace(own, reads=("condensation",))) == read_by(BALL.trackers["condensation"])
    unnamed = {each.name for each in BALL.declarations(MODEL) if not each.trackers}
    assert read_by(replace(own, reads=())) == unnamed


def test_who_names_readers_is_left_as_it_is() -> None:
    """The declarations of an experiment whose trackers are all known are those of its parameters."""
    for name in ("sine", "structure", "trajectories"):
        experiment = find(name)
        model = type(experiment.simulate().parameters)
        named = {tracker for each in experiment.declarations(model) for tracker in each.trackers}
        assert named <= {*experiment.trackers}
        assert not named & {"svd", "lg", "kalman"}


def test_it_runs_and_is_drawn() -> None:
    """An experiment made of another one and a tracker more is drawn with the title of that tracker."""
    own = replace(BALL.trackers["condensation"], id="own", title="My own")
    joined = replace(BALL, id="joined", trackers={**BALL.trackers, "own": own})
    run = Run(joined, joined.simulate(), tracker="own", frames=3)
    run.finish()
    assert "My own" in joined.draw(run.current, run.diagnostics).caption
