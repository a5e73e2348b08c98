"""A session without a worker: which reports of a worker are news, its timeline, and its scene."""

import asyncio
import json
import math
from typing import Any
from unittest.mock import AsyncMock, Mock

import pytest

import pftrack_server.viewer
from pftrack.core.model.parameters import Declaration
from pftrack.core.model.recipe import Change, Recipe
from pftrack.core.refusal import ConflictError, RefusedError
from pftrack.experiments import find
from pftrack_server.core.panel import PanelValues, TrackerPublic
from pftrack_server.core.settings import Settings
from pftrack_server.sessions import spec as snapshots
from pftrack_server.sessions.scene_feed import SceneFeed
from pftrack_server.sessions.session import Session
from pftrack_server.sessions.spec import Phase
from pftrack_server.sessions.state import MOST_BOOKMARKS, History, SessionState
from pftrack_server.sessions.worker.description import threshold_views, timeline_view
from pftrack_server.sessions.worker.protocol import ChangeValues, Command, Described, Ready

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
        self.panel = Mock()
        self.state = SessionState(new_spec(), lambda: None, self.panel)
        self.state.enter(Phase.STARTING)
        self.heard: list[dict[str, Any]] = []
        self.state.begin(Ready(DESCRIPTION, START, [row(0)]))
        self.state.stream.emit = self._hear  # type: ignore[method-assign]
        self.state.stream.greet = lambda: self.heard.append({"type": "hello"})  # type: ignore[method-assign]
        self.panel.reset_mock()

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
    """Its late reports neither wake nor move a session that is suspended or closed."""
    for phase in (Phase.SUSPENDED, Phase.CLOSED):
        ear.state.enter(phase)
        assert ear.advance(row(1), position=1, computed=1, playing=True) == []
        assert (ear.state.snapshot.state, ear.state.spec.run.position) == (phase, 0)


def test_frames_are_told_with_all_that_moves(ear: Ear) -> None:
    """One message has the rows and the fields of one moment, so that no page shows a frame without its row."""
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
    """A new worker for a run that differs from every preset by now replaces no controls.

    The sliders of a saved filter come before the first ones, each once, in the panel and on all pages.
    """
    begun = DESCRIPTION.model_copy(update={"about": ["n", "m"], "watch": "the pillar"})
    ear.state.spec.description = None
    ear.state.begin(Ready(begun, START, [row(0)]))
    ear.state.begin(Ready(begun.model_copy(update={"about": ["o"], "watch": "", "frames": 50}), START, [row(0)]))
    told = ear.state.view()
    assert (told.about, told.watch, told.frames) == (["n", "m"], "the pillar", 50)
    ear.heard.clear()
    ear.panel.reset_mock()
    ear.state.describe(DESCRIPTION.model_copy(update={"about": ["own", "m"]}))
    assert ear.state.view().about == ["own", "m", "n"]
    assert (ear.panel.call_count, ear.heard) == (1, [{"type": "hello"}])


def test_whatever_changes_is_told_once_as_it_is(ear: Ear) -> None:
    """Each changed field is sent by itself, also to later pages, and to the panel if it shows it.

    Play, pause, end and crash are states of the session.
    """
    ear.is_dirty()
    assert (ear.told(), ear.is_dirty()) == ([], False)
    assert (ear.told(position=0, playing=False), ear.panel.call_count) == ([], 0)
    for same in ({"position": 1, "computed": 1}, {"goal": 40, "goal_position": 9}, {"measured": {"inside_share": 0.5}}):
        assert ear.told(**same) == [same]
    assert ear.state.view().measured == {"inside_share": 0.5}
    assert ear.told(measured={"inside_share": math.inf}) == [{"measured": {"inside_share": None}}]
    assert (ear.told(speed=2.0), ear.panel.call_count) == ([{"speed": 2.0}], 1)
    (told,) = ear.told(tracker="kalman")
    assert (told["tracker"], told["branches"][0]["tracker"], ear.panel.call_count) == ("kalman", "kalman", 2)
    assert ear.told(playing=True) == [{"playing": True, "state": "playing"}]
    assert ear.told(playing=False) == [{"playing": False, "state": "ready"}]
    assert ear.told(position=99, computed=99) == [{"position": 99, "computed": 99, "state": "ended"}]
    ear.advance(position=3, playing=True)
    ear.heard.clear()
    ear.state.enter(Phase.CRASHED, "it ended")
    assert [told["session"] for told in ear.heard] == [{"state": "crashed", "message": "it ended", "playing": False}]


def test_a_branch_shares_its_past(ear: Ear) -> None:
    """A new branch is told with title, parent and colour, and has its parent's past up to where it left."""
    ear.advance(row(1), row(2), row(3))
    ear.advance(position=2, computed=3)
    (told,) = ear.told(branch="b1", computed=2, tracker="kalman")
    assert set(told) == {"branch", "branches", "computed", "tracker"}
    made = told["branches"][1]
    assert (made["id"], made["parent"], made["frame"]) == ("b1", "b0", 2)
    assert made["colour"] != told["branches"][0]["colour"]
    for name in ("b2", "b3"):
        (told,) = ear.told(branch=name, computed=2, parameters={"sample_count": 120})
    titles = [branch["title"] for branch in told["branches"][1:]]
    assert titles == ["Kalman from frame 2", "Particles 120 from frame 2", "Kalman from frame 2 (2)"]
    assert [ear.state.columns(name)["frame"] for name in ("b0", "b1")] == [[0, 1, 2, 3], [0, 1, 2]]
    assert ear.state.spec.next_branch() == "b4"


def test_a_new_beginning_forgets(ear: Ear) -> None:
    """A restarted run loses the diagnostics and bookmarks of its branch, and every page is greeted again."""
    ear.advance(row(1))
    ear.state.bookmark("m", "here")
    assert {"type": "hello"} in ear.advance(restarts=1)
    assert ear.state.columns("b0") == {}
    assert ear.state.spec.bookmarks == ear.state.view().bookmarks == []


def test_what_is_worth_writing_down(ear: Ear) -> None:
    """Progress while playing is written from time to time; a pause, a change and a bookmark at once."""
    state, changed = ear.state, RECIPE.model_copy(update={"timeline": (Change(2, {"n": 7}),)})
    ear.advance(playing=True)
    ear.is_dirty()
    ear.advance(row(1), position=1, computed=1, measured={"inside_share": 0.5})
    assert (ear.is_dirty(), state.moved) == (False, True)
    for act in (
        lambda: ear.advance(parameters={"n": 7, "m": 2}, recipe=changed),
        lambda: ear.advance(playing=False),
        lambda: state.bookmark("m", ""),
        lambda: state.describe(DESCRIPTION),
    ):
        act()
        assert ear.is_dirty()


def test_bookmarks_are_few_and_in_the_order_of_frames(ear: Ear) -> None:
    """The last allowed one is kept, the next refused."""
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


def test_a_history_has_the_loss_that_before_the_loss_leads_to() -> None:
    """Only the true loss counts as one: that the tracker searches a little earlier is not a loss yet.

    A row that arrives again replaces the old one; a row that would leave a gap is left out.
    """
    history = History()
    rows = [row(frame, searching=15 <= frame < 18, lost=frame >= 18, hidden=False) for frame in range(30)]
    history.put(rows)
    history.put([row(1, error=9.0, searching=False, lost=False, hidden=False), row(40)])
    told = history.columns
    assert (told["frame"], told["error"]) == (list(range(30)), [1.0, 9.0, *[1.0] * 28])
    assert (told["lost_since"], told["lost_by"]) == ([None] * 18 + [18] * 12, ["truth"] * 30)


async def test_a_scene_ends_before_its_session_or_for_other_trackers() -> None:
    """A session waits until its scene is closed; what the panel still requests is refused.

    Other trackers need another panel, so the scene is made anew.
    """
    for end in (Session.suspend, Session.close):
        viewer = Mock(close=AsyncMock())
        session = Session(new_spec(), Settings(), pytest.fail)  # type: ignore[arg-type]  # it begins no worker
        session.enter(Phase.STARTING)
        session.begin(Ready(DESCRIPTION, START, [row(0)]))
        session.scene_feed._viewer = Mock(close=AsyncMock())
        session._event(Described(DESCRIPTION))
        await asyncio.sleep(0)
        assert session.scene_feed._viewer is None
        session.scene_feed._viewer = viewer
        await session._command_lock.acquire()
        session.scene_feed.ask({"kind": "change", "values": {"n": 3}})
        ending = asyncio.ensure_future(end(session, "Ended."))
        await asyncio.sleep(0)
        session._command_lock.release()
        await ending
        viewer.close.assert_awaited_once()
        assert "resume it first" in str(viewer.refuse.call_args_list)
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
    """Each change names the values before it: the first ones, or those of the change before.

    A move has no value before; a move of the estimate names no particle.
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


def test_a_threshold_holds_while_its_tracker_is_in_charge() -> None:
    """A threshold has a step for each change, and no value where another tracker is active."""
    for first, timeline, steps in (
        ({}, [(10, {"gate": 3.0}), (20, {"tracker": "soft"})], [(0, 5.0), (10, 3.0), (20, None)]),
        ({"tracker": "soft"}, [(0, {"tracker": "soft"})], None),
        ({"gate": 7.0}, [], [(0, 7.0)]),
    ):
        views = threshold_views(changes(*timeline), FIRST | first, DECLARATIONS)
        told = [(view.name, view.of, [(step.frame, step.value) for step in view.steps]) for view in views]
        assert told == ([] if steps is None else [("gate", "sigma", steps)])


class Theatre:
    """A scene feed with a mock for a viewer."""

    def __init__(self) -> None:
        self.credit, self.refused = Mock(), Mock()
        self.sent: list[Command | str] = []
        self.error: Exception | None = None
        self.door = asyncio.Lock()
        self.scene_feed = SceneFeed(credit=self.credit, carry_out=self._carry_out, on_refusal=self.refused)

    async def _carry_out(self, command: Command) -> None:
        if self.error is not None:
            raise self.error
        async with self.door:
            self.scene_feed.note_turn(command)
            self.sent.append(command.model_copy(deep=True))
            await asyncio.sleep(0)

    def open(self) -> Any:
        """Open the scene, and return what was made for it."""
        self.scene_feed.open(DESCRIPTION, PanelValues({"n": 1}, "apf", 7))
        return self.scene_feed._viewer


@pytest.fixture
def theatre(monkeypatch: pytest.MonkeyPatch) -> Theatre:
    """A scene feed whose viewers are mocks."""
    monkeypatch.setattr(pftrack_server.viewer, "Viewer", lambda *_, **requests: Mock(close=AsyncMock(), **requests))
    return Theatre()


async def test_one_viewer_for_all(theatre: Theatre) -> None:
    """All pages share one viewer, which shows every message; after it was closed, it can be opened again.

    A panel that fails ends neither the session nor itself.
    """
    first, feed = theatre.open(), theatre.scene_feed
    assert theatre.open() is first
    first.tell.side_effect = RuntimeError("on purpose")
    feed.tell(PanelValues({"n": 2}, "apf", 7))
    feed.refuse("too large")
    first.tell.assert_called_once_with(PanelValues({"n": 2}, "apf", 7))
    first.refuse.assert_called_once_with("too large")
    for _ in range(2):
        await feed.close()
    first.close.assert_awaited_once()
    feed.tell(PanelValues({"n": 3}, "apf", 7))
    assert theatre.open() is not first


async def test_waiting_changes_are_one_and_keep_their_place(theatre: Theatre) -> None:
    """While another command is under way, the newest value of each parameter waits.

    A page's request meanwhile comes after it; values that arrive once it is sent are another change.
    """
    ask = theatre.open().on_command

    async def ask_from_page() -> None:
        async with theatre.door:
            theatre.sent.append("page")
            ask({"kind": "change", "values": {"n": 3}})

    async with theatre.door:
        for number in range(2):
            ask({"kind": "change", "values": {"n": number}})
        await asyncio.sleep(0)
        page = asyncio.create_task(ask_from_page())
        await asyncio.sleep(0)
        for values in ({"n": 2}, {"m": 1}):
            ask({"kind": "change", "values": values})
    await page
    await asyncio.sleep(0.01)
    assert theatre.sent == [ChangeValues(values={"n": 2, "m": 1}), "page", ChangeValues(values={"n": 3})]


@pytest.mark.parametrize(
    ("body", "error", "said"),
    [
        ({}, RefusedError("picture 7 cannot be read"), "Picture 7 cannot be read"),
        ({}, OSError(5, "input/output error", "/somewhere/secret"), "could not read or write"),
        ({}, RuntimeError("a mistake"), "failed unexpectedly"),
        ({"seed": "seven"}, AssertionError("never carried out"), "seed: "),
        ({"kind": "fly"}, AssertionError("never carried out"), "kind: "),
    ],
)
async def test_every_failure_is_told(theatre: Theatre, body: dict[str, Any], error: Exception, said: str) -> None:
    """No request waits for the answer, so without this a control would keep a refused value without a reason."""
    theatre.error = error
    theatre.scene_feed.ask({"kind": "restart", **body})
    await asyncio.sleep(0.01)
    message = theatre.refused.call_args.args[0]["message"]
    assert (said in message, "secret" in message) == (True, False)
