"""A class: a lecturer and followers over real sockets, on a server with a token and on one without."""

from typing import Any

import httpx

from tests.server.host import Server, error_of, steer
from tests.server.sessions.test_duplex import has_changed, hear, until
from tests.server.teaching.class_room import farewell, follower


def test_a_class_sees_what_the_lecturer_does(
    guarded: Server, lecturer: httpx.Client, session: str, follow: dict[str, Any]
) -> None:
    """Followers see the same frame, hear a poll and answer it; the lecturer sees how many."""
    with follower(guarded, follow) as one, follower(guarded, follow) as other:
        assert one.page.status_code == 200
        assert f'<base href="{one.place}/">' in one.page.text
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
            given = {"poll": asked["id"], "answer": 0}
            assert one.ask("PUT", "follow/vote", **given).json() == given
            assert one.ask("PUT", "follow/vote", poll=asked["id"], answer=1).status_code == 200
            assert other.ask("PUT", "follow/vote", poll=asked["id"], answer=1).status_code == 200
            error_of(other.ask("PUT", "follow/vote", poll=asked["id"], answer=2), 422)
            owned = lecturer.get(address).json()
            assert (owned["followers"], owned["poll"]["votes"], owned["poll"]["counts"]) == (2, 2, None)
            lecturer.post(f"{address}/poll/reveal")
            assert hear(stream)["follow"]["poll"]["counts"] == [0, 2]
            error_of(one.ask("PUT", "follow/vote", poll=asked["id"], answer=0), 409)
            assert one.ask("GET", "follow").json()["mine"]["vote"] == {"poll": asked["id"], "answer": 1}
            lecturer.delete(f"{address}/poll")
            error_of(one.ask("PUT", "follow/vote", poll=asked["id"], answer=0), 409)


def test_it_ends_when_the_lecturer_ends_it(
    guarded: Server, lecturer: httpx.Client, session: str, follow: dict[str, Any]
) -> None:
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
