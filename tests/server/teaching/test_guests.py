"""A class over real sockets, and guests that exceed their rights: forged, expired and borrowed links."""

import re
from contextlib import ExitStack
from typing import Any, TypeAlias
from unittest.mock import patch
from urllib.parse import urlsplit

import httpx
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from pftrack_server.sessions.spec import SessionSpec
from pftrack_server.teaching.follow import MOST_SOCKETS
from pftrack_server.teaching.follows import Follows
from tests.server.host import Server, begin, change_values, command, error_of, steer
from tests.server.sessions.test_duplex import has_changed, hear, until
from tests.server.teaching.class_room import PATIENCE_S, Follower, change, farewell, follower, lead
from tests.viewer.host import Peer
from tests.waiting import wait_for

STREAM = "api/v1/follow/stream"
Follow: TypeAlias = "dict[str, Any]"


def test_a_guest_has_no_other_rights(guarded: Server, session: str, one: Follower) -> None:
    """A route outside the roles is refused, and without the link the follower's browser has no rights at all."""
    for method, path in (("GET", "api/v1/sessions"), ("POST", f"api/v1/sessions/{session}/commands"), ("GET", "work")):
        error_of(one.http.request(method, path), 403)
        bare = httpx.request(method, f"{guarded.url}/{path}", headers={"cookie": one.cookie}, verify=False)  # noqa: S501
        error_of(bare, 401)
    with one.socket("api/v1/sweeps/any/stream") as socket:
        assert farewell(socket)[0] == 4403


@pytest.mark.parametrize("link", ["", "0000-0000-0000", "%2e%2e", "k7q2-m4xb-9trd/../..", "\N{SNOWMAN}"])
def test_forged_links(guarded: Server, session: str, link: str) -> None:
    """A forged link leads nowhere, with a sentence for the page and the program."""
    with httpx.Client(base_url=guarded.url, follow_redirects=True, verify=False) as nobody:  # noqa: S501
        for path in ("", "/", f"/api/v1/sessions/{session}"):
            answer = nobody.get(f"/f/{link}{path}")
            # The client resolves dots itself and so leaves the links; there the token is required.
            error_of(answer, 404 if str(answer.request.url).startswith(f"{guarded.url}/f/") else 401)


def test_a_link_is_typed(guarded: Server, session: str, follow: Follow) -> None:
    """Capitals without dashes lead to the page; a socket with another link is closed with a code for no retry."""
    place = urlsplit(follow["links"][0]["address"]).path
    typed = place.rpartition("/")[2].upper().replace("-", "")
    answer = httpx.get(f"{guarded.url}/f/{typed}", verify=False)  # noqa: S501
    assert (answer.status_code, answer.headers["location"]) == (307, f"{place}/")
    with connect(f"{guarded.ws}/f/0000-0000-0000/api/v1/sessions/{session}/stream") as socket:
        code, reason = farewell(socket)
    assert code == 4404
    assert "typing mistake" in reason


def test_a_borrowed_seat(guarded: Server, lecturer: httpx.Client, session: str, one: Follower) -> None:
    """A browser's seat in one class is invalid in another, and a link without a seat opens the page alone."""
    elsewhere = lead(lecturer, session)
    error_of(one.http.get("api/v1/follow", headers={"cookie": one.cookie.replace(".", ".A")}), 401)
    place = urlsplit(elsewhere["links"][0]["address"]).path
    for cookie in (one.cookie, "pftrack_seat=made-up", ""):
        headers = {"cookie": cookie}
        error_of(httpx.get(f"{guarded.origin}{place}/api/v1/follow", headers=headers, verify=False), 401)  # noqa: S501
        with connect(f"ws{guarded.origin.removeprefix('http')}{place}/{STREAM}", additional_headers=headers) as socket:
            assert farewell(socket)[0] == 4403
    lecturer.delete(f"/api/v1/follows/{elsewhere['id']}")


def test_time_runs_out(lecturer: httpx.Client, follow: Follow, one: Follower) -> None:
    """When the time is over the sockets of followers close, and the link has ended."""
    with one.socket() as stream:
        hear(stream)
        assert change(lecturer, follow, hours=1e-7).status_code == 200
        assert farewell(stream) == (4404, "The time of this class is over.")
    error_of(one.ask("GET", "follow"), 410)


def test_limits_of_a_class(guarded: Server, lecturer: httpx.Client, follow: Follow, one: Follower) -> None:
    """A follower beyond the limit is refused until the lecturer raises it, and may not answer.

    So is one socket more of a browser than it may have. A page of another site does nothing in a follower's name.
    """
    foreign = {"origin": "http://evil.example"}
    error_of(one.http.put("api/v1/follow/vote", json={"poll": "x", "answer": 0}, headers=foreign), 403)
    with pytest.raises(InvalidStatus), one.socket(origin=Origin("http://evil.example")):
        pass
    change(lecturer, follow, most_followers=1)
    with ExitStack() as held, follower(guarded, follow) as late:
        first, *_ = (held.enter_context(one.socket()) for _ in range(MOST_SOCKETS))
        with one.socket() as more:
            assert farewell(more)[0] == 4429
        assert hear(first)["type"] == "hello"
        with late.socket() as refused:
            assert farewell(refused) == (4429, "The class has its limit of followers, 1. Try again in a while.")
        error_of(late.ask("PUT", "follow/vote", poll="x", answer=0), 403)
        change(lecturer, follow, most_followers=2)
        with late.socket() as let_in:
            assert hear(let_in)["type"] == "hello"


def test_the_next_session(guarded: Server, lecturer: httpx.Client, session: str, other: str) -> None:
    """When a session ends or the lecturer follows another one, the followers' streams of the first are closed."""
    gone = str(begin(lecturer)["id"])
    follow = lead(lecturer, session, gone)
    with (
        follower(guarded, follow) as one,
        one.socket() as stream,
        one.socket(f"api/v1/sessions/{session}/stream") as first,
        one.socket(f"api/v1/sessions/{gone}/stream") as second,
    ):
        hear(stream)
        lecturer.delete(f"/api/v1/sessions/{gone}")
        assert farewell(second) == (4404, "The session was ended.")
        error_of(one.ask("POST", "follow/fork", session=gone), 404)
        changed = change(lecturer, follow, sessions=[other], arrangement={"scenes": "over"}, title="Go on")
        assert changed.json()["title"] == "Go on"
        told = until(stream, lambda message: message.get("follow", {}).get("title") == "Go on")[-1]["follow"]
        assert ([each["id"] for each in told["sessions"]], told["arrangement"]) == ([other], {"scenes": "over"})
        assert farewell(first) == (4404, "The class no longer follows this.")
        error_of(one.ask("GET", f"sessions/{session}"), 403)
        assert one.ask("GET", f"sessions/{other}").status_code == 200
    for wrong in ({"sessions": ["nowhere"]}, {"lesson": "nowhere"}):
        error_of(change(lecturer, follow, **wrong), 404)
    error_of(change(lecturer, follow, sessions=[]), 422)
    lecturer.delete(f"/api/v1/follows/{follow['id']}")


def test_a_fork(
    guarded: Server, lecturer: httpx.Client, session: str, follow: Follow, one: Follower, monkeypatch: Any
) -> None:
    """A fork begins at the class's frame, without later changes, and nobody else may touch it.

    The lecturer's last changes, also of the tracker, count from the frame after the shown one.
    """
    monkeypatch.setattr("pftrack_server.teaching.follows.FORKS_SHARE", 0.0)  # one place is left all the same
    steer(lecturer, session, "seek", frame=6)
    change_values(lecturer, session, {"sample_count": 321})
    steer(lecturer, session, "seek", frame=8)
    error_of(one.ask("POST", "follow/fork", session=session), 403)
    with one.socket() as stream, follower(guarded, follow) as other, other.socket() as beside:
        hear(stream), hear(beside)
        for wrong, status in (({"session": "nowhere"}, 404), ({}, 422), ({"session": session, "frame": 30}, 422)):
            error_of(one.ask("POST", "follow/fork", **wrong), status)
        made = one.ask("POST", "follow/fork", session=session, frame=5)
        assert made.status_code == 201, made.text
        fork = made.json()
        own = f"sessions/{fork['id']}"
        begun = one.ask("GET", own).json()
        assert (begun["position"], begun["parameters"]["sample_count"]) == (5, 800)
        assert fork["page"] == f"session/{fork['id']}"
        changed = one.ask("POST", f"{own}/commands", kind="change", values={"sample_count": 111})
        assert changed.json()["parameters"]["sample_count"] == 111
        assert one.http.get(f"session/{fork['id']}").status_code == 200
        assert one.ask("GET", "follow").json()["mine"]["fork"] == fork
        error_of(one.ask("POST", "follow/fork", session=session), 409)
        error_of(other.ask("POST", "follow/fork", session=session), 503)
        for method, path in (("GET", own), ("POST", f"{own}/commands"), ("DELETE", own)):
            error_of(other.ask(method, path, sample_count=1), 403)
        assert one.ask("DELETE", "follow/fork").status_code == 204
        wait_for(lambda: lecturer.get(f"/api/v1/{own}").status_code == 404)
        change_values(lecturer, session, {"tracker": "condensation", "sample_count": 123})
        fork = one.ask("POST", "follow/fork", session=session).json()["id"]
        begun = one.ask("GET", f"sessions/{fork}").json()
        assert (begun["position"], begun["tracker"]) == (8, "condensation")
        assert begun["parameters"]["sample_count"] == 123
        one.ask("DELETE", "follow/fork")
        wait_for(lambda: lecturer.get(f"/api/v1/sessions/{fork}").status_code == 404)
        change_values(lecturer, session, {"sample_count": 321})
        again = other.ask("POST", "follow/fork", session=session).json()["id"]
        monkeypatch.setattr("pftrack_server.teaching.follow.UNUSED_S", 0.0)
        wait_for(lambda: lecturer.get(f"/api/v1/sessions/{again}").status_code == 404)
    assert lecturer.get(f"/api/v1/sessions/{session}").json()["parameters"]["sample_count"] == 321


def test_a_copy_that_comes_late(
    guarded: Server, lecturer: httpx.Client, session: str, follow: Follow, one: Follower
) -> None:
    """A fork that starts too late ends at once, whether its follower has released it or its class is over."""
    follows, create = guarded.app.state.services[Follows], guarded.manager.create
    found, made = follows.get(follow["id"]), []
    [seat] = one.http.cookies.values()

    async def create_late(spec: SessionSpec) -> None:
        made.append((await create(spec)).spec.id)
        if len(made) == 1:
            found.forks.release(follows.links.read_seat(found.name, seat) or "")
        else:
            follows.end(found)

    with patch.object(guarded.manager, "create", create_late), one.socket() as stream:
        hear(stream)
        error_of(one.ask("POST", "follow/fork", session=session), 409)
        error_of(one.ask("POST", "follow/fork", session=session), 410)
    wait_for(lambda: [lecturer.get(f"/api/v1/sessions/{name}").status_code for name in made] == [404, 404])


def test_a_second_device(
    guarded: Server, lecturer: httpx.Client, session: str, other: str, follow: Follow, one: Follower
) -> None:
    """A second device has the lecturer's rights over this class and what it follows, and over nothing else."""
    place = urlsplit(follow["owner_link"]).path
    elsewhere = lead(lecturer, other, lesson="colour")
    beginning = httpx.get(elsewhere["owner_link"], verify=False).headers["location"]  # noqa: S501
    assert beginning.endswith(f"/session/{other}"), "the run of a lesson, not a page that would begin another"
    with httpx.Client(base_url=f"{guarded.origin}{place}/", verify=False, timeout=PATIENCE_S) as device:  # noqa: S501
        assert device.get("").headers["location"] == f"{place}/session/{session}"
        assert device.get(f"session/{session}").status_code == 200
        assert device.post(f"api/v1/sessions/{session}/commands", json={"kind": "pause"}).status_code == 200
        address = f"api/v1/follows/{follow['id']}"
        assert device.put(f"{address}/poll", json={"question": "?", "answers": ["a", "b"]}).status_code == 200
        assert b"<svg" in device.get(f"{address}/qr.svg").content
        error_of(device.get(f"{address}/qr.svg", params={"link": 7}), 404)
        assert "earlier" in error_of(device.put(f"{address}/poll", json={"kept": "it"}), 403)["message"]
        assert device.patch(address, json={"most_followers": 7}).json()["most_followers"] == 7
        error_of(device.patch(address, json={"sessions": [other]}), 403)
        for path in ("sessions", f"sessions/{other}", "follows", f"follows/{elsewhere['id']}", "runs", "follow"):
            error_of(device.request("DELETE" if "follows/" in path else "GET", f"api/v1/{path}"), 403)
        with connect(f"ws{guarded.origin.removeprefix('http')}{place}/{address}/stream") as stream:
            assert hear(stream)["follow"]["followers"] == 0
            with one.socket() as following:
                hear(following)
                assert hear(stream)["follow"]["followers"] == 1
    lecturer.delete(f"/api/v1/follows/{elsewhere['id']}")


def test_the_scene_only_turns(lecturer: httpx.Client, session: str, follow: Follow, one: Follower) -> None:
    """A follower's panel changes nothing beside the class's scene, but does in the follower's own session."""
    count = lecturer.get(f"/api/v1/sessions/{session}").json()["parameters"]["sample_count"]
    with one.socket() as stream:
        hear(stream)
        fork = one.ask("POST", "follow/fork", session=session).json()["id"]
        with Peer(f"{one.ws}/viz/{session}", one.cookie) as looking, Peer(f"{one.ws}/viz/{fork}/", one.cookie) as own:
            for peer in (looking, own):
                peer.move("Particles", 55)
            wait_for(lambda: one.ask("GET", f"sessions/{fork}").json()["parameters"]["sample_count"] == 55)
            assert looking.socket.close_code is None
            assert lecturer.get(f"/api/v1/sessions/{session}").json()["parameters"]["sample_count"] == count
            page = one.http.get(f"viz/{session}/").text
            assert one.http.get(f"viz/{session}/{re.findall('href=.(../client/[^>]*css)', page)[0]}").status_code == 200


def test_a_lesson_is_followed(lecturer: httpx.Client, guarded: Server, session: str) -> None:
    """The class gets the figure of the lecturer's page; a follower can take a figure of one's own and release it."""
    lessons = lecturer.get("/api/v1/lessons").json()["lessons"]
    lesson = next(each for each in lessons if each["kind"] == "demonstration")["id"]
    follow = lead(lecturer, lesson=lesson)
    address = f"/api/v1/follows/{follow['id']}"
    with follower(guarded, follow) as one, one.socket() as stream:
        assert (hear(stream)["follow"]["lesson"], follow["sessions"]) == (lesson, [])
        assert one.ask("GET", f"lessons/{lesson}").status_code == 200
        figure = lecturer.post(f"{address}/figure", json={"seed": 5}).json()
        told = hear(stream)
        assert (told["type"], told["lesson"], told["figure"]) == ("figure", lesson, figure)
        with follower(guarded, follow) as late, late.socket() as after:
            assert [hear(after)["type"], hear(after)["figure"]] == ["hello", figure]
        error_of(one.ask("POST", f"lessons/{lesson}/figure", seed=6), 403)
        page = one.ask("POST", "follow/fork", frame=None).json()["page"]
        assert one.http.get(page).status_code == 200
        assert one.ask("POST", f"lessons/{lesson}/figure", seed=6).json()["seed"] == 6
        assert one.ask("DELETE", "follow/fork").status_code == 204
        error_of(one.ask("POST", f"lessons/{lesson}/figure", seed=6), 403)
        error_of(change(lecturer, follow, lesson=None), 422)
        assert change(lecturer, follow, lesson=None, sessions=[session]).json()["lesson"] is None
        error_of(lecturer.post(f"{address}/figure", json={}), 409)
        with follower(guarded, follow) as late, late.socket() as after:
            assert hear(after)["follow"]["lesson"] is None
            change(lecturer, follow, title="Without a figure")
            assert hear(after)["type"] == "follow", "the figure is gone with its lesson"
    lecturer.delete(address)


def test_a_server_without_a_token(server: Server, client: httpx.Client) -> None:
    """The link makes a follower there as well, and a notice warns that no other machine can open it."""
    session = begin(client)
    begun = client.post("/api/v1/follows", json={"sessions": [session["id"]]}).json()
    assert "--host" in begun["notice"]
    assert [each["everybody"] for each in begun["links"]] == [False]
    with follower(server, begun) as one, one.socket() as stream:
        assert hear(stream)["type"] == "hello"
        error_of(one.ask("POST", f"sessions/{session['id']}/commands", kind="play"), 403)
        error_of(client.get("/api/v1/follow"), 404)
        assert command(client, session["id"], "play").status_code == 200
    error_of(client.post("/api/v1/follows", json={"sessions": ["nowhere"]}), 404)
    client.delete(f"/api/v1/follows/{begun['id']}")


def test_a_class_sees(guarded: Server, lecturer: httpx.Client, session: str, follow: Follow) -> None:
    """Followers see the same frame, hear a poll and answer it; the lecturer sees how many."""
    steer(lecturer, session, "seek", frame=0)
    with follower(guarded, follow) as one, follower(guarded, follow) as other:
        assert f'data-role="follower" data-class="{follow["id"]}"' in one.page.text
        with (
            one.socket() as stream,
            other.socket() as elsewhere,
            one.socket(f"api/v1/sessions/{session}/stream") as run,
        ):
            greeting = hear(stream)
            assert greeting["type"] == hear(elsewhere)["type"] == "hello"
            assert greeting["follow"]["sessions"] == [{"id": session, "title": "Ball behind an occluder"}]
            assert hear(run)["session"]["position"] == 0
            steer(lecturer, session, "seek", frame=5)
            until(run, has_changed(position=5))
            address = f"/api/v1/follows/{follow['id']}"
            lecturer.put(f"{address}/poll", json={"question": "Will it survive?", "answers": ["yes", "no"]})
            asked = hear(stream)["follow"]["poll"]
            assert (asked["question"], asked["votes"], asked["counts"]) == ("Will it survive?", None, None)
            for who, answer in ((one, 0), (one, 1), (other, 1)):
                given = {"poll": asked["id"], "answer": answer}
                assert who.ask("PUT", "follow/vote", **given).json() == given
            error_of(other.ask("PUT", "follow/vote", poll=asked["id"], answer=2), 422)
            owned = lecturer.get(address).json()
            assert (owned["followers"], owned["poll"]["votes"], owned["poll"]["counts"]) == (2, 2, None)
            lecturer.post(f"{address}/poll/reveal")
            assert hear(stream)["follow"]["poll"]["counts"] == [0, 2]
            error_of(one.ask("PUT", "follow/vote", poll=asked["id"], answer=0), 409)
            assert one.ask("GET", "follow").json()["mine"]["vote"] == {"poll": asked["id"], "answer": 1}
            lecturer.delete(f"{address}/poll")
            error_of(one.ask("PUT", "follow/vote", poll=asked["id"], answer=0), 409)


def test_the_end(guarded: Server, lecturer: httpx.Client, session: str, follow: Follow) -> None:
    """Every socket is closed with a sentence, forks end, and the link leads nowhere."""
    with (
        follower(guarded, follow) as one,
        one.socket() as stream,
        one.socket(f"api/v1/sessions/{session}/stream?paints=true") as seen,
    ):
        hear(stream)
        fork = one.ask("POST", "follow/fork", session=session).json()
        address = f"/api/v1/follows/{follow['id']}"
        assert lecturer.delete(address).status_code == 204
        assert farewell(stream) == farewell(seen) == (4404, "The lecturer has ended this class.")
        assert "over" in error_of(one.http.get(""), 410)["message"]
        with one.socket() as late:
            assert farewell(late) == (4404, "This class is over.")
        assert "This class is over." in one.http.get("", headers={"accept": "text/html"}).text
        error_of(lecturer.get(address), 404)
        error_of(lecturer.get(f"/api/v1/sessions/{fork['id']}"), 404)
