"""Which parameters a tracker reads that joins an experiment of somebody else's."""

from dataclasses import replace

from pftrack.core.model.tracker import Tracker
from pftrack.experiments import find
from tests.making import whole_run

BALL = find("ball")
MODEL = type(BALL.simulate().parameters)


def read_by(tracker: Tracker, like: str) -> set[str]:
    """Return the parameters of the ball that a tracker reads once it has joined."""
    joined = replace(BALL.with_trackers(tracker, like=like), id="joined")
    declared = joined.declarations(MODEL)
    return {each.name for each in declared if not each.trackers or tracker.id in each.trackers}


def test_it_reads_what_another_one_reads() -> None:
    """Parameters name their readers; one that comes later has exactly those of the tracker that it is like."""
    own = replace(BALL.trackers["kalman"], id="own", title="Own")
    for name in BALL.trackers:
        read = {each.name for each in BALL.declarations(MODEL) if not each.trackers or name in each.trackers}
        assert read_by(own, name) == read


def test_it_runs_and_is_drawn() -> None:
    """An experiment made of another one and a tracker more is drawn with the title of that tracker."""
    own = replace(BALL.trackers["condensation"], id="own", title="My own")
    joined = replace(BALL.with_trackers(own, like="condensation"), id="joined")
    run = whole_run(joined, tracker="own", frames=3)
    assert "My own" in joined.draw(run.current, run.diagnostics).caption
