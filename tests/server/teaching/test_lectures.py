"""Lectures: stored as one text file, read as hostile, and shown with what is missing here by its line."""

import json
from base64 import urlsafe_b64decode
from pathlib import Path
from typing import Any

import httpx

from pftrack_server.store.database import LectureRow
from pftrack_server.teaching.lectures import LARGEST_BYTES, read_lecture, write_lecture
from pftrack_server.teaching.messages import KINDS
from tests.server.host import begin, error_of, post, steer

FILE = """---
title: From Bayes to particles
items:
- lesson: bayes
- failure: 4
  minutes: 7.5
- poll: Will it survive the pillar?
  answers: [Yes, No]
- question: sir
- session:
    recipe: {experiment: ball, seed: 3}
    position: 12
  title: The pillar
---
Begin with the *question*.
"""


def lecture(items: str) -> str:
    return f"---\ntitle: x\nitems:\n{items}\n---\n"


HOSTILE = [
    ("title: x", "Line 1: the file begins with a head"),
    ("---\ntitle: x", "Line 1: the head that begins here"),
    (b"---\ntitle: \xff\xfe\n---\n", "Line 2: this is not UTF-8"),
    ("---\ntitle: x\na: &a [x, x]\nb: &b [*a, *a]\n---\n", "Line 3: references"),
    ("---\ntitle: !!python/object/apply:os.getcwd []\n---\n", "Line 2: the tag"),
    ("---\nitems: []\n---\n", "`title` is missing; docs/how-to/lectures.md"),
    (lecture("- leson: bayes"), "Line 4: there is no `items.0.leson` in a lecture"),
    (lecture("- lesson: a\n- lesson: a\n  failure: b"), "Line 5: `items.1` does not fit"),
    (lecture("- session: {recipe: {experiment: ball, tracker: none}}"), "Line 4: "),
    (lecture("- lesson: a\n" * 101), "at most 100"),
    ("---\n" + "#" * LARGEST_BYTES, "larger than 128 KiB"),
    (f"---\ntitle: x\n---\n{'n' * 10_001}", "Line 4: the text has more"),
]


def take_in(client: httpx.Client, text: str | bytes) -> httpx.Response:
    return client.post("/api/v1/lectures/import", content=text, headers={"content-type": "text/markdown"})


def fragment(page: str) -> Any:
    text = page.split("#", 1)[1]
    return json.loads(urlsafe_b64decode(text + "=" * (-len(text) % 4)))


def test_a_file_is_kept_as_it_was_written(start_server: Any) -> None:
    """A file is understood, returned letter by letter, and not lost in a restart."""
    with start_server() as (_, client):
        made = take_in(client, FILE).json()
    with start_server() as (_, client):
        [summary] = client.get("/api/v1/lectures").json()
        lecture = client.get(f"/api/v1/lectures/{made['id']}").json()
        assert lecture == made
        assert {**summary, "items": lecture["items"], "notes": "Begin with the *question*."} == lecture
        lesson, failure, poll, question, session = lecture["items"]
        assert [item["problem"] for item in lecture["items"]] == [None] * 5
        assert (lesson["title"], lesson["page"]) == ("From picture back to state: Bayes' rule", "learn/bayes")
        listed = {it["id"]: it["minutes"] for it in client.get("/api/v1/lessons").json()["lessons"]}
        assert lesson["minutes"] == listed["bayes"]
        assert failure["page"].startswith("failures/")
        assert failure["minutes"] == 7.5
        assert poll["asks"]["answers"] == ["Yes", "No"], "words of a poll are words"
        assert (question["asks"]["lesson"], question["asks"]["lecture"]) == ("sir", made["id"])
        assert session["title"] == "The pillar"
        assert session["page"].startswith("session/new#")
        assert fragment(session["page"]) == {"recipe": {"experiment": "ball", "seed": 3}, "position": 12}
        assert lecture["minutes"] == sum(item["minutes"] for item in lecture["items"])
        file = client.get(f"/api/v1/lectures/{made['id']}/file")
        assert file.text == FILE
        assert file.headers["content-disposition"] == 'attachment; filename="from-bayes-to-particles.lecture.md"'
        assert client.delete(f"/api/v1/lectures/{made['id']}").status_code == 204
        assert client.get("/api/v1/lectures").json() == []
        for method in ("GET", "DELETE"):
            error_of(client.request(method, f"/api/v1/lectures/{made['id']}"), 404)


def test_a_damaged_file_harms_no_other(start_server: Any) -> None:
    """An unreadable lecture is left out of the list, reported at its address, and can be deleted."""
    with start_server() as (server, client):
        broken, whole = (take_in(client, FILE).json()["id"] for _ in range(2))
        store = server.app.state.services.store
        row = store.get(LectureRow, broken)
        row.text = "no lecture"
        store.save(row)
        assert [each["id"] for each in client.get("/api/v1/lectures").json()] == [whole]
        assert "only be deleted" in error_of(client.get(f"/api/v1/lectures/{broken}"), 410)["message"]
        assert client.delete(f"/api/v1/lectures/{broken}").status_code == 204


def test_the_documentation_shows_a_lecture() -> None:
    """The example of the page on lectures is one, of every kind of item."""
    page = (Path(__file__).parents[3] / "docs" / "how-to" / "lectures.md").read_text()
    example = page.split("```markdown\n")[1].split("```")[0]
    lecture, lines = read_lecture(example.encode())
    assert {item.kind for item in lecture.items} == set(KINDS)
    assert [example.splitlines()[line - 1][:2] for line in lines] == ["- "] * len(lines)


def test_anything_else_is_refused(client: httpx.Client) -> None:
    """A file that is not a lecture is refused in a sentence that names the line."""
    for text, sentence in HOSTILE:
        assert sentence in error_of(take_in(client, text), 422)["message"]
    assert client.get("/api/v1/lectures").json() == []


def test_missing_items_are_reported(client: httpx.Client) -> None:
    """An item that is missing here stays in the order, with its line and the reason; the rest can be shown."""
    items = "- lesson: elsewhere\n- failure: none\n- session: {recipe: {experiment: away}}\n- lesson: bayes"
    made = take_in(client, lecture(items)).json()
    *missing, here = made["items"]
    assert [item["problem"].split(":")[0] for item in missing] == ["Line 4", "Line 5", "Line 6"]
    assert [item["page"] for item in missing] == [None] * 3
    assert here["page"] == "learn/bayes"
    client.delete(f"/api/v1/lectures/{made['id']}")


def test_an_order_of_the_page(client: httpx.Client) -> None:
    """A page sends items; references to runs become recipes, and the written file reads as the same lecture."""
    session = begin(client, frames=20)
    steer(client, session["id"], "seek", frame=4)
    run = client.post("/api/v1/runs", json={"session": session["id"], "title": "= Mine"}).json()
    references = [{"reference": run["id"]}, {"reference": f"{session['id']}:b0"}]
    items = [
        {"session": {"reference": run["id"]}, "minutes": 3},
        {"comparison": {"runs": references, "arrangement": "over"}},
        {"poll": "No", "answers": ["yes", "- off", "1e5"]},
    ]
    lecture = post(client, "lectures", title='A "title": of\u2028mine', items=items, notes="---\n")
    client.delete(f"/api/v1/runs/{run['id']}")
    own, compared, poll = lecture["items"]
    assert own["title"] == "= Mine"
    assert (fragment(own["page"])["recipe"]["frames"], own["item"]["session"]["position"]) == (20, 4)
    assert fragment(compared["page"])["arrangement"] == "over"
    assert [each["recipe"]["seed"] for each in fragment(compared["page"])["runs"]] == [7, 7]
    assert poll["asks"]["answers"] == ["yes", "- off", "1e5"]
    text = client.get(f"/api/v1/lectures/{lecture['id']}/file").text
    assert write_lecture(read_lecture(text.encode()).lecture) == text

    address = f"/api/v1/lectures/{lecture['id']}"
    turned = [each["item"] for each in reversed(lecture["items"])]
    changed = client.put(address, json={"title": "Turned", "items": turned}).json()
    assert [each["kind"] for each in changed["items"]] == ["poll", "comparison", "session"]
    assert changed["created"] == lecture["created"]
    gone = [{"session": {"reference": run["id"]}}]
    assert "it was deleted" in error_of(client.put(address, json={"title": "x", "items": gone}), 404)["message"]
    assert client.get(address).json() == changed
    client.delete(address)
