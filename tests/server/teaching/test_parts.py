"""The parts of a class by themselves: followers, forks, links, messages of a page, and cached results."""

import asyncio
import json
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import AsyncMock

import pytest
from pydantic import BaseModel, ValidationError

from pftrack.core.refusal import RefusedError
from pftrack_server.core.errors import ApiError
from pftrack_server.core.settings import Settings
from pftrack_server.jobs.results import DiskCache
from pftrack_server.sessions.duplex import encode
from pftrack_server.teaching import links as found
from pftrack_server.teaching.access import AccessGuard
from pftrack_server.teaching.follow import LECTURER, MOST_SCENES, UNUSED_S, Followers, Forks
from pftrack_server.teaching.follows import Follows
from pftrack_server.teaching.lessons import LessonResults
from pftrack_server.teaching.links import LETTERS, NOTICE, Claim, Links, addresses
from pftrack_server.teaching.messages import FollowCreate, FollowUpdate

TOKEN = "sixteen characters"


def _nobody() -> Followers:
    return Followers(lambda: None)


# Followers.


async def test_scenes_are_for_some() -> None:
    """A follower beyond the limit of scenes is referred to the flat view, and follows nevertheless.

    With a limit of 0 nobody new comes in; a present follower may open more sockets and leaves with the last one. The
    lecturer does not count.
    """
    room = _nobody()
    with ExitStack() as held:
        for number in range(MOST_SCENES):
            held.enter_context(room.take(str(number), "/viz/one/", 100))
        with pytest.raises(ApiError, match="flat view"), room.take("late", "/viz/one", 100):
            pass
        assert "late" not in room
        held.enter_context(room.take("late", "/api/v1/follow/stream", 100))
        held.enter_context(room.take("late", "/elsewhere", 0))
        with pytest.raises(ApiError, match="followers, 0"), room.take("b", "/", 0):
            pass
        assert len(room) == MOST_SCENES + 1
    assert (len(room), "late" in room) == (0, False)
    with room.take(LECTURER, "/", 1), room.take("a", "/", 1):
        assert len(room) == 1


async def test_a_socket_that_must_leave_is_interrupted() -> None:
    """A socket whose seat or path may not stay ends, and others go on; a second review while it ends does no harm."""
    room, ended = _nobody(), asyncio.Event()
    review = partial(room.review, lambda seat, path: (seat, path) != ("a", "/x"))

    async def serve(seat: str, path: str) -> str:
        with room.take(seat, path, 9) as hold:
            try:
                async with hold:
                    await ended.wait()
            except TimeoutError:
                review()
                ended.set()
                return "sent away"
        return "stayed"

    served = [asyncio.ensure_future(serve(*each)) for each in (("a", "/x"), ("a", "/y"), ("b", "/x"))]
    await asyncio.sleep(0)
    review()
    assert await asyncio.gather(*served) == ["sent away", "stayed", "stayed"]


async def test_a_closed_socket_gets_the_reason() -> None:
    """A socket is accepted before it is closed, since a browser gets the reason only then."""
    room, send = _nobody(), AsyncMock()

    async def app(*_: object) -> None:
        room.review(lambda *_: False)
        await asyncio.Event().wait()

    content = SimpleNamespace(wanted=SimpleNamespace(most_followers=9))
    one: Any = SimpleNamespace(seat="a", follow=SimpleNamespace(followers=room, content=content, ended=None))
    services = {Follows: SimpleNamespace(check_room=lambda: None)}
    scope = {"path": "/x", "app": SimpleNamespace(state=SimpleNamespace(services=services))}
    await AccessGuard(app)._serve_socket(one, scope, app, send)
    accepted, closed = (call.args[0] for call in send.await_args_list)
    assert (accepted["type"], closed["type"]) == ("websocket.accept", "websocket.close")
    assert (closed["code"], closed["reason"]) == (4404, "The class no longer follows this.")


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """The clock of classes, which stands still."""
    clock = SimpleNamespace(now=0.0)
    monkeypatch.setattr("pftrack_server.teaching.follow.time.monotonic", lambda: clock.now)
    return clock


# Forks.


def test_one_each() -> None:
    """A fork counts from the start of its session to the end; one whose session could not start does not count.

    If a fork is released while its session starts, another one may start meanwhile, and stays.
    """
    sessions: dict[str, Any] = {"x": SimpleNamespace(visitors=0), "y": SimpleNamespace(visitors=0)}
    forks = Forks(sessions.get, lambda: None)
    for seat, session in (("a", "x"), ("b", "y")):
        with forks.reserve(seat) as fork:
            assert forks.of(seat) is fork
            fork.session = session
    del sessions["x"]
    assert (len(forks), forks.sessions, forks.of("a")) == (1, ["y"], None)
    with pytest.raises(OSError, match="disk"), forks.reserve("c"):
        raise OSError("disk")
    assert len(forks) == 1
    with forks.reserve("c"):
        forks.release("c")
        with forks.reserve("c") as other:
            other.session = "y"
    assert forks.of("c") is other


def test_unused_forks_are_released(clock: SimpleNamespace) -> None:
    """An unused lesson, and a session whose page was left, end after a while and not before."""
    visited: Any = SimpleNamespace(visitors=1)
    forks = Forks({"x": visited, "y": SimpleNamespace(visitors=0)}.get, lambda: None)
    for seat, session in (("b", "x"), ("c", "y")):
        with forks.reserve(seat) as fork:
            fork.session = session
    with forks.reserve("a") as fork:
        fork.lesson = "bayes"
    clock.now = UNUSED_S - 1.0
    forks.touch("a", "/api/v1/follow")
    forks.touch("d", "/api/v1/lessons/bayes/figure")
    assert forks.of("a") is fork
    forks.touch("a", "/api/v1/lessons/bayes/figure")
    assert forks.unused_sessions() == []
    clock.now += 1.0
    visited.visitors = 0
    assert forks.unused_sessions() == ["y"]
    clock.now += UNUSED_S - 2.0
    assert len(forks) == 3
    clock.now += 2.0
    assert len(forks) == 2


# Addresses.


def test_the_lecturers_own_address() -> None:
    """The name in the lecturer's address is what others use; a loopback address is for nobody else."""
    for settings in (Settings(), Settings(token=TOKEN)):
        assert addresses("http://localhost:8000", settings) == [("http://localhost:8000", False)]
    assert "--host" in NOTICE
    settings = Settings(token=TOKEN, allowed_hosts=("lab.example",))
    for base in ("https://lab.example", "https://lab.example/any/prefix"):
        assert addresses(base, settings) == [(base, True)]


def test_a_server_that_listens_everywhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """A lecturer on the machine itself gets the names for others, with port and path, and no loopback address.

    A server bound to one address has that one.
    """
    assert "127.0.0.1" not in found._names(Settings(host="0.0.0.0"))
    bound = Settings(host="2001:db8::5", token=TOKEN)
    assert found._names(bound) == ["2001:db8::5"]
    assert addresses("http://[::1]:1", bound)[0].base == "http://[2001:db8::5]:1"
    monkeypatch.setattr(found, "_names", lambda _: ["192.0.2.7", "198.51.100.9"])
    below = addresses("http://127.0.0.1:8123/space%20word", Settings(host="0.0.0.0"))
    names = "192.0.2.7", "198.51.100.9", "127.0.0.1"
    assert below == [(f"http://{name}:8123/space%20word", name != "127.0.0.1") for name in names]
    only = Settings(host="0.0.0.0", allowed_hosts=("198.51.100.9",))
    assert [each.base for each in addresses("http://[::1]:80", only) if each.everybody] == ["http://198.51.100.9:80"]


@pytest.fixture(scope="module")
def links() -> Links:
    return Links()


def test_a_link_says_class_and_role(links: Links) -> None:
    """Each role has a link of its own, read in capitals, without dashes and with letters that look alike.

    A server has a key of its own for one life.
    """
    owner = links.of("k7q2", "owner")
    assert links.read(owner) == Claim("k7q2", "owner", owner)
    name = next(name for name in iter(links.new_name, None) if {"0", "1"} & set(links.of(name, "follower")))
    link = links.of(name, "follower")
    for old, new in (("", ""), ("-", ""), ("-", " "), ("0", "O"), ("1", "l")):
        for typed in (link.replace(old, new), link.upper()):
            assert links.read(typed) == Claim(name, "follower", link)
    assert Links().read(link) is None


def test_every_other_link_is_refused(links: Links) -> None:
    """A link with one changed letter is refused, and so is anything else that somebody types.

    Each role is signed for itself, so no part of a lecturer's link is a follower's; a signature that is cut or longer
    does not hold.
    """
    owner, link = (links.of("k7q2", role).replace("-", "") for role in ("owner", "follower"))  # type: ignore[arg-type]
    others = [link[:at] + letter + link[at + 1 :] for at in range(len(link)) for letter in LETTERS]
    assert len(set(others) - {link}) == 12 * 31
    others += [link + "0", link[:-1], *(owner[:length] for length in range(len(owner)))]
    others += ["", "k7q2", "-", "k7q2-" * 50, "k7q2-\N{SNOWMAN}", "\ud800", "../../etc", "%00"]
    assert [other for other in others if links.read(other) and other != link] == []


def test_arrangements_that_are_passed_on() -> None:
    """Every accepted arrangement can be sent."""
    for arrangement in ({}, {"x": [None, 1.5, {"y": "\N{SNOWMAN}"}]}, {"x": float("nan")}, {"x": 10**400}):
        kept = FollowUpdate(arrangement=arrangement).arrangement
        assert json.loads(encode(FollowUpdate(arrangement=kept)))["arrangement"].keys() == arrangement.keys()


@pytest.mark.parametrize(
    ("model", "wrong"),
    [
        (FollowUpdate, {"arrangement": {"x": "\ud800"}}),
        (FollowUpdate, {"arrangement": {"\ud800": 1}}),
        (FollowUpdate, {"arrangement": {"x": "y" * 17_000}}),
        (FollowUpdate, {"arrangement": {"x": ["\N{SNOWMAN}" * 6_000]}}),
        (FollowUpdate, {"arrangement": {"x": json.loads("[" * 900 + "]" * 900)}}),
        (FollowCreate, {}),
        (FollowCreate, {"sessions": ["a", "a"]}),
        (FollowCreate, {"sessions": ["a"], "title": "\ud800"}),
    ],
)
def test_messages_that_are_refused(model: type[BaseModel], wrong: dict[str, Any]) -> None:
    """Nothing or twice the same to follow, half a character, and too long or too deep an arrangement are refused."""
    with pytest.raises(ValidationError):
        model(**wrong)


async def heavy() -> None:
    """What takes minutes."""
    await asyncio.Event().wait()


async def light() -> dict[str, list[int]]:
    """What takes a moment."""
    return {"numbers": [1]}


async def refused() -> None:
    """What cannot be computed."""
    raise RefusedError("There is nothing to compute")


async def test_a_light_answer_does_not_wait_for_heavy_ones(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A light lesson is answered beside any number of heavy ones.

    A refused lesson gives the reason, and a lesson that was left alone begins again.
    """
    monkeypatch.setattr("pftrack_server.teaching.lessons.MOMENT_S", 0.05)
    children: Any = SimpleNamespace(run_beside=lambda function, **_: function())
    results = LessonResults(DiskCache(tmp_path / "kept"), children)
    slow = [await results.get(f"slow {number}", heavy) for number in range(2)]
    job = await results.get("quick", light)
    await results.jobs.wait(job.id, 60)
    assert job.result == {"numbers": [1]}
    assert [each.result for each in slow] == [None, None]
    failed = await results.get("refused", refused)
    await results.jobs.wait(failed.id, 60)
    assert (failed.result, failed.error) == (None, "There is nothing to compute")
    assert await results.get("refused", refused) is failed, "nobody tries again at once"
    monkeypatch.setattr("pftrack_server.jobs.jobs.LOOK_S", 0.001)
    left = await results.get("left alone", heavy)
    await results.jobs.wait(left.id, 60)
    again = (await results.get("left alone", heavy)).state
    assert (left.state, again) == ("failed", "working"), "the next visitor has not left it"
    results.jobs._kept_s = -1.0
    assert await results.get("refused", refused) is not failed
    await results.jobs.close()
