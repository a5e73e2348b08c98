"""The state: what of all that a worker tells is news."""

import json
from dataclasses import replace
from typing import Any

import pytest

from pftrack.model.recipe import Recipe
from pftrack.runs.loss import approach
from pftrack.runs.run import Change
from pftrack_server.schemas.description import SessionDescription, TrackerPublic
from pftrack_server.schemas.spec import BranchSpec, SessionSpec
from pftrack_server.sessions.history import History
from pftrack_server.sessions.state import SessionState
from pftrack_server.worker.protocol import Ready, RunStatus

DESCRIPTION = SessionDescription(
    title="Ball",
    trackers=[TrackerPublic(id="apf", title="APF"), TrackerPublic(id="kalman", title="Kalman")],
    width=320,
    height=240,
    frame_rate_hz=30.0,
    frames=100,
)
RECIPE = Recipe(experiment="ball", tracker="apf")
START = RunStatus("b0", 0, 0, False, False, 1.0, RECIPE, "apf", {"n": 1, "m": 2}, 0)


class Ear:
    """Hears what a state tells."""

    def __init__(self) -> None:
        branch = BranchSpec(id="b0", title="Main", recipe=RECIPE, tracker="apf")
        spec = SessionSpec(id="s", branches={"b0": branch})
        self.panel = 0
        self.state = SessionState(spec, "starting", self._count)
        self.heard: list[dict[str, Any]] = []
        self.state.begin(Ready(DESCRIPTION, START, [row(0)]))
        self.state.listeners.emit = self._hear  # type: ignore[method-assign]
        self.state.listeners.greet = lambda: self.heard.append({"type": "hello"})  # type: ignore[method-assign]
        self.panel = 0

    def _count(self) -> None:
        self.panel += 1

    def _hear(self, message: Any) -> None:
        self.heard.append(json.loads(message.model_dump_json()))

    def stand(self, **changes: Any) -> list[dict[str, Any]]:
        """Tell the state where the run stands, and return the news."""
        self.heard.clear()
        self.last = replace(getattr(self, "last", START), **changes)
        self.state.stand(self.last)
        return self.heard


def row(frame: int, **more: Any) -> dict[str, Any]:
    return {"frame": frame, "error": 1.0, **more}


@pytest.fixture
def ear() -> Ear:
    return Ear()


def test_a_frame_is_told_before_its_position(ear: Ear) -> None:
    """No page ever stands on a frame of which it knows nothing."""
    ear.state.stand(replace(START, position=1, computed=1), [row(1)])
    assert [message["type"] for message in ear.heard] == ["frame", "position"]


def test_a_run_that_plays_on_is_told_by_its_frames(ear: Ear) -> None:
    """The position is told when it plays from now on, at another speed, no more, or through frames that are known."""

    def told(*rows: dict[str, Any], **changes: Any) -> list[str]:
        ear.heard.clear()
        ear.last = replace(ear.last, **changes)
        ear.state.stand(ear.last, rows)
        return [message["type"] for message in ear.heard]

    ear.stand()
    assert told(row(1), position=1, computed=1, playing=True) == ["frame", "position"]
    assert told(row(2), position=2, computed=2) == ["frame"]
    assert told(row(3), row(4), position=4, computed=4) == ["frames"]
    assert told(row(5), position=5, computed=5, speed=2.0) == ["frame", "position"]
    assert told(position=2) == ["position"]
    assert told(position=3) == ["position"]
    assert told(row(6), position=6, computed=6, playing=False) == ["frame", "position"]
    assert told(row(7), position=7, computed=7) == ["frame", "position"]


def test_the_controls_to_turn_first_stay_those_of_the_beginning(ear: Ear) -> None:
    """A new worker, of a run that is another preset's by now, puts no other controls under a person's hands."""
    begun = DESCRIPTION.model_copy(update={"about": ["n"], "watch": "the pillar"})
    ear.state.spec.description = None
    ear.state.begin(Ready(begun, START, [row(0)]))
    ear.state.begin(Ready(begun.model_copy(update={"about": ["m"], "watch": "", "frames": 50}), START, [row(0)]))
    told = ear.state.view()
    assert (told.about, told.watch, told.frames) == (["n"], "the pillar", 50)


def test_the_same_again_is_no_news(ear: Ear) -> None:
    """A worker that stands where it stood tells nothing."""
    assert ear.stand() == []
    assert ear.panel == 0


def test_a_move_is_a_position(ear: Ear) -> None:
    """Another frame is told as a position, and nothing else."""
    (told,) = ear.stand(position=1, computed=1)
    assert (told["type"], told["frame"], told["computed"]) == ("position", 1, 1)


def test_playing_is_told_once(ear: Ear) -> None:
    """Play and pause are told by the position alone, the end as a state as well."""
    assert [told["type"] for told in ear.stand(playing=True)] == ["position"]
    assert ear.state.phase == "playing"
    assert [told["type"] for told in ear.stand(playing=False)] == ["position"]
    assert [told["type"] for told in ear.stand(position=99, computed=99, ended=True)] == ["session", "position"]
    assert ear.state.phase == "ended"


def test_measures_are_told_when_they_change(ear: Ear) -> None:
    """Once by a message of their own, and from then on whoever comes is greeted with them."""
    (told,) = ear.stand(measures={"inside_share": 0.5})
    assert (told["type"], told["values"]) == ("measures", {"inside_share": 0.5})
    assert ear.stand(measures={"inside_share": 0.5}) == []
    assert ear.state.view().measured == {"inside_share": 0.5}


def test_a_change_is_echoed(ear: Ear) -> None:
    """A change is told with what changed alone, and the panel is told as well."""
    (told,) = ear.stand(values={"n": 5, "m": 2}, recipe=RECIPE.model_copy(update={"timeline": (Change(1, {"n": 5}),)}))
    assert (told["type"], told["values"], told["parameters"]) == ("parameters", {"n": 5}, {"n": 5, "m": 2})
    assert ear.panel == 1
    assert told["timeline"] == [{"frame": 1, "values": {"n": 5}, "before": {}}]
    assert ear.state.spec.recipe.timeline[0].values == {"n": 5}


def test_a_tracker_is_echoed(ear: Ear) -> None:
    """A change of tracker is told like a change of parameter."""
    (told,) = ear.stand(tracker="kalman")
    assert (told["values"], told["tracker"]) == ({"tracker": "kalman"}, "kalman")


def test_a_speed_reaches_the_panel(ear: Ear) -> None:
    """Another speed is told to the panel, too."""
    assert [told["type"] for told in ear.stand(speed=2.0)] == ["position"]
    assert ear.panel == 1


def test_a_branch_shares_its_past(ear: Ear) -> None:
    """A new branch is told with title, parent and colour, and has its parent's past up to where it left."""
    ear.state.add("b0", [row(1), row(2), row(3)])
    ear.stand(position=2, computed=3)
    told = {message["type"]: message for message in ear.stand(branch="b1", computed=2, tracker="kalman")}
    assert set(told) == {"branches", "parameters", "position"}
    made = told["branches"]["branches"][1]
    assert (made["id"], made["parent"], made["frame"], made["title"]) == ("b1", "b0", 2, "Kalman from frame 2")
    assert made["colour"] != told["branches"]["branches"][0]["colour"]
    assert ear.state.columns("b1")["frame"] == [0, 1, 2]
    assert ear.state.columns("b0")["frame"] == [0, 1, 2, 3]
    assert ear.state.spec.next_branch() == "b2"


def test_a_new_beginning_forgets(ear: Ear) -> None:
    """A run begun anew forgets diagnostics and bookmarks of its branch and greets everybody."""
    ear.state.add("b0", [row(1)])
    ear.state.bookmark("m", "here")
    assert {"type": "hello"} in ear.stand(restarts=1)
    assert ear.state.columns("b0") == {}
    assert ear.state.spec.bookmarks == []


def test_one_row_or_many(ear: Ear) -> None:
    """One new frame is a frame, several are frames, none is nothing."""
    ear.heard.clear()
    ear.state.add("b0", [])
    ear.state.add("b0", [row(1)])
    ear.state.add("b0", [row(2), row(3)])
    assert [told["type"] for told in ear.heard] == ["frame", "frames"]
    assert ear.state.frames_computed == 3


def test_what_is_worth_writing_down(ear: Ear) -> None:
    """Playing on is written down now and then; a pause, a change and a bookmark at once."""
    state = ear.state

    def is_dirty() -> bool:
        dirty, state.dirty = state.dirty, False
        return dirty

    is_dirty()
    ear.stand(playing=True, position=1, computed=1)
    assert not is_dirty()
    assert state.moved
    ear.stand(values={"n": 7, "m": 2})
    assert is_dirty()
    ear.stand(playing=False)
    assert is_dirty()
    state.bookmark("m", "")
    assert is_dirty()


def test_bookmarks_in_the_order_of_frames(ear: Ear) -> None:
    """Bookmarks are told in the order of their frames."""
    for frame in (9, 3, 5):
        ear.stand(position=frame, computed=10)
        ear.state.bookmark(f"m{frame}", "")
    assert [mark.frame for mark in ear.state.spec.bookmarks] == [3, 5, 9]
    assert ear.state.unbookmark("m5")
    assert not ear.state.unbookmark("m5")


def test_history_replaces_what_it_knows() -> None:
    """A row that comes again replaces the old one; one that would leave a gap is left out."""
    history = History()
    history.put([row(0), row(1), row(2)])
    history.put([row(1, error=9.0), row(7)])
    assert history.columns == {"frame": [0, 1, 2], "error": [1.0, 9.0, 1.0], "lost_since": [None] * 3}


def test_before_the_loss_leads_to_the_loss_that_is_told(ear: Ear) -> None:
    """What a frame says of its loss and where one goes from there to see it coming are about the same loss.

    The tracker notices first, and the truth agrees later; between the two the loss goes on.
    """
    rows = [row(frame, searching=15 <= frame < 18, lost=18 <= frame < 30, hidden=False) for frame in range(1, 30)]
    ear.state.begin(Ready(DESCRIPTION, START, [row(0, searching=False, lost=False, hidden=False)]))
    ear.state.add("b0", rows)
    ear.stand(position=29, computed=29)
    told = ear.state.columns("b0")["lost_since"]
    assert told == [None] * 15 + [15] * 15
    assert ear.state.before_loss() == approach(told[29])
