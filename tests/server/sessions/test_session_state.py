"""A session without a worker: what is news of all that a worker tells, what ends with it, and its timeline."""

import asyncio
import json
import math
from typing import Any

import pytest

from pftrack.core.model.parameters import Declaration
from pftrack.core.model.recipe import Change, Recipe
from pftrack.core.refusal import ConflictError
from pftrack.experiments import find
from pftrack_server.core.panel import TrackerPublic
from pftrack_server.core.settings import Settings
from pftrack_server.sessions import spec as snapshots
from pftrack_server.sessions.session import Session
from pftrack_server.sessions.spec import Phase
from pftrack_server.sessions.state import MOST_BOOKMARKS, History, SessionState
from pftrack_server.sessions.worker.description import threshold_views, timeline_view
from pftrack_server.sessions.worker.protocol import Described, Ready

BALL = find("ball")
DESCRIPTION = snapshots.SessionDescription(
    title="Ball",
    trackers=[TrackerPublic(id="apf", title="APF"), TrackerPublic(id="kalman", title="Kalman")],
    width=320,
    height=240,
    frame_rate_hz=30.0,
    frames=100,
    declarations=[each for each in BALL.declarations(type(BALL.simulate().parameters)) if each.name == "sample_count"],
)
RECIPE = Recipe(experiment="ball", tracker="apf")
START = snapshots.RunSnapshot(recipe=RECIPE, tracker="apf", parameters={"n": 1, "m": 2})


def new_spec() -> snapshots.SessionSpec:
    return snapshots.SessionSpec(id="s", branches={"b0": snapshots.BranchSpec(title="Main", run=START)})


class Ear:
    """Hears what a state tells."""

    def __init__(self) -> None:
        self.panel = 0
        self.state = SessionState(new_spec(), lambda: None, self._count)
        self.state.enter(Phase.STARTING)
        self.heard: list[dict[str, Any]] = []
        self.state.begin(Ready(DESCRIPTION, START, [row(0)]))
        self.state.stream.emit = self._hear  # type: ignore[method-assign]
        self.state.stream.greet = lambda: self.heard.append({"type": "hello"})  # type: ignore[method-assign]
        self.panel = 0

    def _count(self) -> None:
        self.panel += 1

    def _hear(self, message: Any) -> None:
        self.heard.append(json.loads(message.model_dump_json()))

    def advance(self, *rows: dict[str, Any], **changes: Any) -> list[dict[str, Any]]:
        """Tell the state what has changed of the run, and return the news."""
        self.heard.clear()
        self.state.advance(changes, rows)
        return self.heard

    def told(self, *rows: dict[str, Any], **changes: Any) -> list[Any]:
        """Tell the state what has changed; return the fields that are news."""
        return [message["session"] for message in self.advance(*rows, **changes)]

    def is_dirty(self) -> bool:
        """Tell whether the state is to be written down, and take it for written."""
        dirty, self.state.dirty = self.state.dirty, False
        return dirty


def row(frame: int, **more: Any) -> dict[str, Any]:
    return {"frame": frame, "error": 1.0, **more}


@pytest.fixture
def ear() -> Ear:
    return Ear()


def test_a_worker_that_was_given_up_says_nothing_more(ear: Ear) -> None:
    """What it still reports after its session is suspended or closed neither wakes it nor moves it."""
    for phase in (Phase.SUSPENDED, Phase.CLOSED):
        ear.state.enter(phase)
        assert ear.advance(row(1), position=1, computed=1, playing=True) == []
        assert (ear.state.snapshot.state, ear.state.spec.run.position) == (phase, 0)


def test_frames_are_told_with_all_that_moves(ear: Ear) -> None:
    """One message has the rows and the fields of one moment: no page ever stands on a frame it knows nothing of."""
    plays = {"position": 2, "computed": 2, "playing": True}
    for rows, changes, news in (
        ([row(1), row(2)], plays, {**plays, "state": "playing"}),
        ([row(3)], {"position": 3, "computed": 3}, {"position": 3, "computed": 3}),
        ([], {"position": 2}, {"position": 2}),
    ):
        (told,) = ear.advance(*rows, **changes)
        assert (told["session"], [each["frame"] for each in told["rows"]]) == (news, [each["frame"] for each in rows])
    assert (ear.state.view().position, ear.state.frames_computed) == (2, 3)


def test_the_description_stays_that_of_the_beginning_but_for_what_is_new(ear: Ear) -> None:
    """A new worker, of a run that is another preset's by now, puts no other controls under a person's hands.

    The sliders of a filter that was saved come before those of the beginning, each once, to panel and pages.
    """
    begun = DESCRIPTION.model_copy(update={"about": ["n", "m"], "watch": "the pillar"})
    ear.state.spec.description = None
    ear.state.begin(Ready(begun, START, [row(0)]))
    ear.state.begin(Ready(begun.model_copy(update={"about": ["o"], "watch": "", "frames": 50}), START, [row(0)]))
    told = ear.state.view()
    assert (told.about, told.watch, told.frames) == (["n", "m"], "the pillar", 50)
    ear.heard.clear()
    panel = ear.panel
    ear.state.describe(DESCRIPTION.model_copy(update={"about": ["own", "m"]}))
    assert ear.state.view().about == ["own", "m", "n"]
    assert (ear.panel, ear.heard) == (panel + 1, [{"type": "hello"}])


def test_whatever_changes_is_told_once_as_it_is(ear: Ear) -> None:
    """Nothing between worker and pages knows the fields by name: each travels by itself, and to later pages, too.

    A worker without changes tells nothing; what the panel shows is told to it as well.
    """
    ear.is_dirty()
    assert ear.told() == []
    assert (ear.told(position=0, playing=False), ear.panel) == ([], 0)
    ear.is_dirty()
    assert (ear.told(), ear.is_dirty()) == ([], False)
    for same in ({"position": 1, "computed": 1}, {"goal": 40, "goal_position": 9}, {"measured": {"inside_share": 0.5}}):
        assert ear.told(**same) == [same]
    assert ear.state.view().measured == {"inside_share": 0.5}
    assert ear.told(measured={"inside_share": math.inf}) == [{"measured": {"inside_share": None}}]
    assert (ear.told(speed=2.0), ear.panel) == ([{"speed": 2.0}], 1)
    (told,) = ear.told(tracker="kalman")
    assert (told["tracker"], told["branches"][0]["tracker"], ear.panel) == ("kalman", "kalman", 2)


def test_playing_is_told_once(ear: Ear) -> None:
    """Play, pause and the end of the run are states of the session; one that ends plays no more."""
    assert ear.told(playing=True) == [{"playing": True, "state": "playing"}]
    assert ear.told(playing=False) == [{"playing": False, "state": "ready"}]
    assert ear.told(position=99, computed=99) == [{"position": 99, "computed": 99, "state": "ended"}]
    ear.advance(position=3, playing=True)
    ear.heard.clear()
    ear.state.enter(Phase.CRASHED, "it ended")
    (told,) = ear.heard
    assert told["session"] == {"state": "crashed", "message": "it ended", "playing": False}


def test_a_change_is_echoed(ear: Ear) -> None:
    """A change is told with all that is in force and the timeline, and the panel is told as well."""
    recipe = RECIPE.model_copy(update={"timeline": (Change(1, {"n": 5}),)})
    timeline = [snapshots.ChangePublic(frame=1, values={"n": 5}, before={"n": 1})]
    (told,) = ear.told(parameters={"n": 5, "m": 2}, recipe=recipe, timeline=timeline)
    assert told["parameters"] == {"n": 5, "m": 2}
    assert told["timeline"] == [{"frame": 1, "values": {"n": 5}, "before": {"n": 1}, "moved": []}]
    assert told["recipe"]["timeline"] == [{"frame": 1, "values": {"n": 5}}]
    assert (ear.panel, ear.state.spec.recipe.timeline[0].values) == (1, {"n": 5})


def test_a_branch_shares_its_past(ear: Ear) -> None:
    """A new branch is told with title, parent and colour, and has its parent's past up to where it left."""
    ear.advance(row(1), row(2), row(3))
    ear.advance(position=2, computed=3)
    (told,) = ear.told(branch="b1", computed=2, tracker="kalman")
    assert set(told) == {"branch", "branches", "computed", "tracker"}
    made = told["branches"][1]
    assert (made["id"], made["parent"], made["frame"], made["title"]) == ("b1", "b0", 2, "Kalman from frame 2")
    assert made["colour"] != told["branches"][0]["colour"]
    ear.advance(branch="b2", computed=2, parameters={"sample_count": 120})
    (told,) = ear.told(branch="b3", computed=2, parameters={"sample_count": 120})
    titles = [branch["title"] for branch in told["branches"][2:]]
    assert titles == ["Particles 120 from frame 2", "Kalman from frame 2 (2)"]
    assert ear.state.columns("b1")["frame"] == [0, 1, 2]
    assert ear.state.columns("b0")["frame"] == [0, 1, 2, 3]
    assert ear.state.spec.next_branch() == "b4"


def test_a_new_beginning_forgets(ear: Ear) -> None:
    """A run begun anew forgets diagnostics and bookmarks of its branch and greets everybody."""
    ear.advance(row(1))
    ear.state.bookmark("m", "here")
    assert {"type": "hello"} in ear.advance(restarts=1)
    assert ear.state.columns("b0") == {}
    assert ear.state.spec.bookmarks == ear.state.view().bookmarks == []


def test_what_is_worth_writing_down(ear: Ear) -> None:
    """Playing on is written down now and then; a pause, a change and a bookmark at once."""
    state, changed = ear.state, RECIPE.model_copy(update={"timeline": (Change(2, {"n": 7}),)})
    ear.advance(playing=True)
    ear.is_dirty()
    ear.advance(row(1), position=1, computed=1, measured={"inside_share": 0.5})
    assert (ear.is_dirty(), state.moved) == (False, True)
    for act in (
        lambda: ear.advance(parameters={"n": 7, "m": 2}, recipe=changed),
        lambda: ear.advance(playing=False),
        lambda: state.bookmark("m", ""),
        lambda: state.begin(Ready(DESCRIPTION, START, [row(0)])),
        lambda: state.describe(DESCRIPTION),
    ):
        act()
        assert ear.is_dirty()


def test_bookmarks_are_few_and_in_the_order_of_frames(ear: Ear) -> None:
    """The last one that is allowed is kept, the next refused."""
    for frame in (9, 3, 5):
        ear.advance(position=frame, computed=10)
        ear.state.bookmark(f"m{frame}", "")
    assert [mark.frame for mark in ear.state.spec.bookmarks] == [3, 5, 9]
    assert [ear.state.unbookmark("m5") for _ in range(2)] == [True, False]
    for number in range(2, MOST_BOOKMARKS):
        ear.state.bookmark(f"more {number}", "")
    with pytest.raises(ConflictError, match=str(MOST_BOOKMARKS)):
        ear.state.bookmark("m", "")
    assert len(ear.state.spec.bookmarks) == MOST_BOOKMARKS


def test_history_replaces_what_it_knows() -> None:
    """A row that comes again replaces the old one; one that would leave a gap is left out."""
    history = History()
    history.put([row(0), row(1), row(2)])
    history.put([row(1, error=9.0), row(7)])
    told = {"frame": [0, 1, 2], "error": [1.0, 9.0, 1.0], "lost_by": [""] * 3, "lost_since": [None] * 3}
    assert history.columns == told


def test_before_the_loss_leads_to_the_loss_that_is_told(ear: Ear) -> None:
    """What a frame says of its loss and where one goes from there to see it coming are about the same loss.

    The truth has the word: that the tracker searches a little earlier is not a loss yet.
    """
    rows = [row(frame, searching=15 <= frame < 18, lost=18 <= frame < 30, hidden=False) for frame in range(1, 30)]
    ear.state.begin(Ready(DESCRIPTION, START, [row(0, searching=False, lost=False, hidden=False)]))
    ear.advance(*rows)
    ear.advance(position=29, computed=29)
    told = ear.state.columns("b0")
    assert (told["lost_since"], told["lost_by"]) == ([None] * 18 + [18] * 12, ["truth"] * 30)


class Curtain:
    """A viewer that needs a while to close."""

    def __init__(self) -> None:
        self.told: list[object] = []
        self.ended = asyncio.Event()

    def tell(self, in_force: object) -> None:
        self.told.append(in_force)

    def refuse(self, message: str) -> None:
        self.told.append(message)

    async def close(self) -> None:
        await asyncio.sleep(0.01)
        self.ended.set()


def session_with(curtain: Curtain) -> Session:
    made = Session(new_spec(), Settings(), pytest.fail)  # type: ignore[arg-type]  # it begins no worker
    made.enter(Phase.STARTING)
    made.begin(Ready(DESCRIPTION, START, [row(0)]))
    made.scene_feed._viewer = curtain  # type: ignore[assignment]
    return made


async def test_other_trackers_need_another_scene() -> None:
    """Its panel is made anew; until the old one has closed the session has not ended either."""
    curtain = Curtain()
    session = session_with(curtain)
    session._event(Described(DESCRIPTION))
    await asyncio.sleep(0)
    assert session.scene_feed._viewer is None
    await session.close("Ended.")
    assert curtain.ended.is_set()


async def test_a_scene_ends_with_its_session_or_its_worker() -> None:
    """What the panel still asks for is refused, and nothing is left to be done."""
    for end in (Session.suspend, Session.close):
        curtain = Curtain()
        session = session_with(curtain)
        await session._command_lock.acquire()
        session.scene_feed.ask({"kind": "change", "values": {"n": 3}})
        ending = asyncio.ensure_future(end(session, "Ended."))
        await asyncio.sleep(0)
        session._command_lock.release()
        await ending
        assert curtain.ended.is_set()
        assert any("resume it first" in str(told) for told in curtain.told)
        assert not session.scene_feed._commands


DECLARATIONS = [
    Declaration.model_validate({"description": "", "unit": "", **each})
    for each in (
        {"name": "gate", "title": "Gate", "kind": "number", "default": 5.0}
        | {"role": "threshold", "threshold_of": "sigma", "trackers": ("hard",)},
        {"name": "count", "title": "Count", "kind": "integer", "default": 800, "role": "particles"},
    )
]
FIRST: dict[str, Any] = {"gate": 5.0, "count": 800, "tracker": "hard"}


def changes(*all_of_them: tuple[int, dict[str, Any]]) -> list[Change]:
    return [Change(frame, values) for frame, values in all_of_them]


def test_a_change_is_told_with_what_it_replaced_and_moved() -> None:
    """Each change names the values before it: those of the beginning, or those of the change before.

    What was moved has no value before; one of the estimate is told without a particle.
    """
    told = timeline_view(
        changes((0, {"gate": 4.0}), (10, {"gate": 3.0, "count": 200}), (20, {"gate": 2.0, "tracker": "soft"})),
        {**FIRST, "gate": 4.0},
    )
    assert [change.before for change in told] == [{}, {"gate": 4.0, "count": 800}, {"gate": 3.0, "tracker": "hard"}]
    moves = [{"particle": 7, "place": [312.0, 140.25]}, {"particle": None, "place": [0.42]}]
    (one,) = timeline_view(changes((10, {"gate": 3.0, "move": moves})), FIRST)
    assert one.moved == ["Particle 7 moved to (312, 140.2)", "Estimate moved to 0.42"]
    assert (one.values, one.before) == ({"gate": 3.0}, {"gate": 5.0})


@pytest.mark.parametrize(
    ("first", "timeline", "steps"),
    [
        ({}, [(10, {"gate": 3.0}), (20, {"tracker": "soft"})], [(0, 5.0), (10, 3.0), (20, None)]),
        ({"tracker": "soft"}, [(0, {"tracker": "soft"})], None),
        ({"gate": 7.0}, [], [(0, 7.0)]),
    ],
)
def test_a_threshold_holds_while_its_tracker_is_in_charge(first: Any, timeline: Any, steps: Any) -> None:
    """A threshold has a step for each change, and none where another tracker is in charge; others are not told."""
    views = threshold_views(changes(*timeline), FIRST | first, DECLARATIONS)
    told = [(view.name, view.of, [(step.frame, step.value) for step in view.steps]) for view in views]
    assert told == ([] if steps is None else [("gate", "sigma", steps)])
