"""Polls are stored with the counts of answers and nothing else, shown again, and exported."""

import csv
import io
import sqlite3
from pathlib import Path
from typing import Any

import httpx

from pftrack_server.store.database import PollRow
from tests.server.host import Server, error_of, granted
from tests.server.teaching.class_room import Follower, follower, lead
from tests.waiting import wait_for

ASKED = {"question": '=HYPERLINK("http://elsewhere")', "answers": ["@Yes", "No"]}


def ask(client: httpx.Client, follow: dict[str, Any], **wanted: Any) -> dict[str, Any]:
    """Ask a class, and wait for a run that the answers need."""
    address = f"/api/v1/follows/{follow['id']}/poll"
    return granted(wait_for(lambda: (it := client.put(address, json=wanted)).status_code != 202 and it))["poll"]


def vote(one: Follower, poll: dict[str, Any], answer: int) -> None:
    assert one.ask("PUT", "follow/vote", poll=poll["id"], answer=answer).status_code == 200


def kept(client: httpx.Client, **query: Any) -> list[dict[str, Any]]:
    return client.get("/api/v1/polls", params=query).json()


def test_answers_outlive_class_and_server(start_server: Any, tmp_path: Path) -> None:
    """Answers are stored over a restart, revealed or not, without the seats of those who gave them."""
    with start_server() as (server, client):
        follow = lead(client, lesson="bayes")
        with follower(server, follow) as one, follower(server, follow) as two, one.socket(), two.socket():
            first = ask(client, follow, **ASKED)
            vote(one, first, 0)
            vote(two, first, 1)
            vote(two, first, 0)
            client.post(f"/api/v1/follows/{follow['id']}/poll/reveal")
            second = ask(client, follow, question="And now?", answers=["Yes", "No"], lecture="0" * 16)
            vote(one, second, 1)
            seats = [one.cookie.split("=")[1].split(".")[0], two.cookie.split("=")[1].split(".")[0]]
            client.delete(f"/api/v1/follows/{follow['id']}")
        ask(client, lead(client, lesson="bayes"), question="Nobody answers", answers=["Yes", "No"])
    database = sqlite3.connect(tmp_path / "data" / "pftrack.sqlite")
    assert not any(seat in "\n".join(database.iterdump()) for seat in seats)
    database.close()
    with start_server() as (server, client):
        newer, older = kept(client)
        assert (newer["question"], newer["counts"], newer["followers"]) == ("And now?", [0, 1], 2)
        assert (older["question"], older["counts"], older["votes"]) == (ASKED["question"], [2, 0], 2)
        assert [each["id"] for each in kept(client, lecture="0" * 16)] == [newer["id"]]

        answer = client.get("/api/v1/polls/answers.csv")
        assert answer.headers["content-disposition"] == 'attachment; filename="polls.csv"'
        head, *rows = csv.reader(io.StringIO(answer.text))
        assert head[3:7] == ["question", "answer", "votes", "share_percent"]
        assert [row[3:7] for row in rows[2:]] == [
            [f"'{ASKED['question']}", "'@Yes", "2", "100.0"],
            [f"'{ASKED['question']}", "No", "0", "0.0"],
        ]

        # Shown again to another class.
        follow = lead(client, lesson="bayes")
        with follower(server, follow) as one, one.socket():
            again = ask(client, follow, kept=older["id"])
            assert (again["revealed"], again["counts"], again["votes"]) == (True, [2, 0], 2)
            assert "closed" in one.ask("PUT", "follow/vote", poll=older["id"], answer=1).text
        client.delete(f"/api/v1/follows/{follow['id']}/poll")
        assert [each["id"] for each in kept(client)] == [newer["id"], older["id"]]
        assert [client.delete(f"/api/v1/polls/{older['id']}").status_code for _ in range(2)] == [204, 404]
        assert [each["id"] for each in kept(client)] == [newer["id"]]


def test_withdrawn(guarded: Server, lecturer: httpx.Client, follow: dict[str, Any], one: Follower) -> None:
    """A stored poll is not listed before it is revealed, and deleted if it is withdrawn first."""
    with one.socket():
        poll = ask(lecturer, follow, **ASKED)
        vote(one, poll, 1)
        store = guarded.app.state.services.store
        wait_for(lambda: store.get(PollRow, poll["id"]))
        assert poll["id"] not in [each["id"] for each in kept(lecturer)]
        lecturer.delete(f"/api/v1/follows/{follow['id']}/poll")
        assert store.get(PollRow, poll["id"]) is None


def test_a_lessons_question_is_asked(lecturer: httpx.Client, follow: dict[str, Any]) -> None:
    """A choice is asked as it is, a number in intervals, and a question about a run once that is computed."""
    choice = ask(lecturer, follow, lesson="bayes")
    assert choice["question"].startswith("A camera at 5 m")
    assert choice["answers"][1] == "Two peaks, near 2 m and near 8 m"
    assert ask(lecturer, follow, lesson="9")["answers"][-1] == "Above 10"
    assert ask(lecturer, follow, lesson="cost-of-a-threshold")["answers"][0].endswith(" frames")
    error_of(lecturer.put(f"/api/v1/follows/{follow['id']}/poll", json={"lesson": "nowhere"}), 404)
    for wrong in ({}, {"question": "Why?"}, {"lesson": "9", **ASKED}, {"answers": ["Yes", "No"], "kept": "it"}):
        error_of(lecturer.put(f"/api/v1/follows/{follow['id']}/poll", json=wrong), 422)
