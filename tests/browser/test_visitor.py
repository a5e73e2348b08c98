"""Whatever is pressed on the pages, nothing breaks: no error in the console, no answer of the server's own fault."""

from typing import Any

import pytest

from tests.browser.conftest import Complaints
from tests.browser.host import Server
from tests.browser.visitor import Visitor

PLACES = ["./", "learn", "failures", "lectures", "work", "references", "sweep/new"]
ROOM = 6
"""Sessions that the visitor may have begun before somebody clears them away."""

FAULTS = 500
TO_BE_EXPECTED = ("status of 4",)
"""A request that is refused is told in the console by the browser itself."""


@pytest.fixture(scope="module")
def server(beside_others: Server) -> Server:
    """A server on which nothing takes long; it has a saved run."""
    beside_others.post("runs", {"session": beside_others.start_session(frames=20)["id"]})
    return beside_others


def visit(page: Any, server: Server, complaints: Complaints, seed: int, seconds: float) -> Visitor:
    """Have a visitor wander, and tell what it did last if anything is wrong."""
    complaints.expected = TO_BE_EXPECTED
    faults: list[str] = []
    page.on("response", lambda it: faults.append(f"{it.status} {it.url}") if it.status >= FAULTS else None)
    lessons = [each["id"] for each in server.get("lessons")["lessons"]]
    failures = [each["id"] for each in server.get("failures")]
    session = server.start_session(frames=60)
    others = [session["page"], f"learn/{lessons[seed % len(lessons)]}", f"failures/{failures[seed % len(failures)]}"]
    files = [{"name": "notes.txt", "mimeType": "text/plain", "buffer": b"no picture"}]
    visitor = Visitor(page, seed, [*PLACES, *others], files)
    page.goto("./")

    def check() -> None:
        assert not complaints.unexpected, f"{complaints.unexpected}\n{visitor.story}"
        assert not faults, f"{faults}\n{visitor.story}"
        if len(server.get("sessions")) > ROOM:
            server.end_sessions(keep=1)  # one that is just starting would be refused to its page

    visitor.wander(seconds, check)
    return visitor


def test_what_is_wrong_is_told_with_what_was_pressed(bare: Any, complaints: Complaints) -> None:
    """A button that fails is found, and the story names it and the seed."""
    complaints.expected = ("pressed",)
    bare.evaluate("""() => {
        const button = document.createElement('button');
        button.textContent = 'Break';
        button.addEventListener('click', () => { throw new Error('pressed'); });
        document.querySelector('main').append(button);
    }""")
    visitor = Visitor(bare, 3, [], [])

    def check() -> None:
        assert not complaints, visitor.story

    with pytest.raises(AssertionError, match=r"(?s)seed 3.*button submit 'Break'"):
        visitor.wander(20.0, check)


def test_a_short_visit(page: Any, server: Server, complaints: Complaints) -> None:
    """A few seconds, the same visitor in every run of the tests."""
    visit(page, server, complaints, 1, 2.5)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10, 18))
def test_a_visit_of_a_minute(page: Any, server: Server, complaints: Complaints, seed: int) -> None:
    """Others stay for a minute, and come to several pages."""
    visitor = visit(page, server, complaints, seed, 60.0)
    assert len(visitor.seen) > 3, visitor.seen
