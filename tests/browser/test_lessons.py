"""Lessons as a person takes them: predict, then see, then turn everything; and what may go wrong on the way."""

import re
from typing import Any

import pytest

from tests.browser.conftest import Complaints
from tests.browser.host import Server
from tests.browser.views import View

SHOW = ".question button[type=submit]"
BROKEN = "---\ntitle: A lesson with a mistake\nexperiment: ball\nsead: 3\n---\nNothing is right here.\n"


class LessonPage(View):
    """The page of a lesson."""

    def open(self, lesson: str) -> "LessonPage":
        self.page.goto(f"learn/{lesson}")
        self.until(lambda: self.stage is not None, "the question, or what came of it, is there")
        return self

    @property
    def stage(self) -> str | None:
        return self.page.locator("[data-part=question]").get_attribute("data-stage")

    def drawn(self) -> None:
        shown = self.page.locator("[data-part=show]")
        self.until(lambda: int(shown.get_attribute("data-shown") or 0) > 0, "a figure is drawn")

    def answer(self, text: str) -> None:
        self.page.fill(".question-number", text)
        self.page.click(SHOW)

    def becomes(self, stage: str) -> None:
        self.until(lambda: self.stage == stage, f"the question is {stage}")

    def is_open(self) -> bool:
        """Tell whether the controls can be used."""
        return not self.page.evaluate("document.querySelector('.lesson-fields').disabled")

    @property
    def words(self) -> str:
        return str(self.page.inner_text("[data-part=question]"))


def ids(server: Server) -> set[str]:
    """Return the names of all sessions."""
    return {session["id"] for session in server.get("sessions")}


@pytest.fixture
def lesson(page: Any) -> LessonPage:
    return LessonPage(page)


def test_lesson_nine_is_answered_wrongly_and_then_rightly(lesson: LessonPage, complaints: Complaints) -> None:
    """What is not a number is told with what is allowed; a wrong answer is explained; the right one is kept here.

    Before an answer the figure is veiled and nothing can be turned.
    """
    complaints.expected = ("status of 422",)
    lesson.open("9")
    assert lesson.page.url.endswith("/learn/sir")
    lesson.drawn()
    assert not lesson.is_open()
    assert "0 of 12 done" in lesson.page.inner_text("[data-part=progress]")

    lesson.answer("")
    lesson.until(lambda: "Type a number first" in lesson.words, "an empty answer is told")
    lesson.answer("half")
    allowed = "Your answer must be a number between 0 and 1000, got 'half'"
    lesson.until(lambda: allowed in lesson.words, "it says what is allowed")
    assert lesson.stage == "asked"

    lesson.answer("4")
    lesson.becomes("wrong")
    assert all(words in lesson.words for words in ("You said 4; it is 2", "If the error fell as 1/N"))
    lesson.until(lesson.is_open, "everything can be turned")

    lesson.page.click("text=Ask me again")
    lesson.becomes("asked")
    assert not lesson.is_open()
    lesson.answer("2")
    lesson.becomes("right")
    assert "1 of 12 done" in lesson.page.inner_text("[data-part=progress]")
    lesson.page.reload()
    lesson.until(lambda: lesson.stage == "right", "the answer is still known")
    assert "1 of 12 done" in lesson.page.inner_text("[data-part=progress]")
    lesson.page.goto("learn")
    card = lesson.page.locator("[data-lesson=sir]")
    card.wait_for()
    assert "answered correctly" in card.inner_text()
    assert card.inner_text().count("Ball behind an occluder") == 1, "two uses in one experiment are one link here"


def test_a_prediction_is_placed_in_the_figure_and_checks_pass(lesson: LessonPage) -> None:
    """The figure asks for a place, which arrow keys set and the page judges; the server's checks stand in the text."""
    lesson.open("estimate")
    lesson.drawn()
    lesson.page.click(SHOW)
    lesson.until(lambda: "Place your prediction in the figure first" in lesson.words, "a missing place is reported")
    asking = lesson.page.get_by_role("slider", name="your prediction")
    asking.focus()
    asking.press("ArrowRight")
    lesson.until(lambda: "nowhere yet" not in lesson.words, "the place is shown")
    lesson.page.click(SHOW)
    lesson.until(lambda: lesson.stage in {"right", "wrong"}, "it is judged")
    lesson.page.click("text=Checks (")
    lesson.until(lambda: "checks pass" in lesson.page.inner_text("[data-part=text]"), "the checks are computed")
    for check in lesson.page.locator(".checks li").all():
        assert re.search(r"checked: \S+, exact \S+, within \S+ ✓", check.inner_text()), check.inner_text()


def test_what_cannot_be_read_or_found_is_told(lesson: LessonPage, server: Server, complaints: Complaints) -> None:
    """An unknown lesson has a way to the overview, which has the whole course, and a broken file with its line."""
    complaints.expected = ("404",)
    assert lesson.page.goto("learn/alchemy").status == 404
    notice = lesson.page.locator(".notice").inner_text()
    assert all(words in notice for words in ("Unknown lesson", "9 sir"))
    broken = server.data / "lessons" / "mistaken.md"
    broken.parent.mkdir(exist_ok=True)
    broken.write_text(BROKEN)
    try:
        lesson.page.click("text=All lessons")
        problems = lesson.page.locator(".learn-problems").inner_text()
    finally:
        broken.unlink()
    assert all(words in problems for words in ("mistaken.md, line 4", "sead"))
    assert lesson.page.locator("ol.course .lesson-card").count() == 12


def test_a_scenario_mounts_a_session_of_which_some_is_unlocked(lesson: LessonPage, server: Server) -> None:
    """Before the answer no key and no control moves it; after it the unlocked controls do. It ends with the page."""
    others = ids(server)
    lesson.open("colour")
    lesson.page.locator(".flat-canvas[data-frame='30']").wait_for()
    (started,) = (session for session in server.get("sessions") if session["id"] not in others)
    assert started["parameters"]["sharpness"] == 200
    lesson.until(lambda: lesson.page.locator("[data-control]").count() > 0, "the unlocked controls are there")
    assert not lesson.is_open()
    lesson.page.keyboard.press("ArrowRight")
    assert server.session(started["id"])["position"] == started["position"]

    lesson.answer("92")
    lesson.becomes("right")
    lesson.until(lesson.is_open, "everything unlocked can be turned")
    loss = {"position": 92, "playing": False}
    lesson.until(lambda: loss.items() <= server.session(started["id"]).items(), "it plays to the frame of the loss")
    names = {each.get_attribute("data-control") for each in lesson.page.locator("[data-control]").all()}
    assert "sharpness" in names
    assert len(names) < len(started["declarations"])
    lesson.page.locator("[data-control=sharpness] input[type=number]").fill("20")
    lesson.page.keyboard.press("Enter")
    sharpness = lambda: server.session(started["id"])["parameters"]["sharpness"]  # noqa: E731 - one line of reading
    lesson.until(lambda: sharpness() == 20, "the session has the value")
    lesson.page.locator("[data-control=sharpness] button").click()
    lesson.until(lambda: sharpness() == 200, "the way back gives the first")
    lesson.resize(390)
    height = "document.querySelector('.flat-canvas').clientHeight"
    lesson.until(lambda: lesson.page.evaluate(height) > 150, "its picture has room")
    lesson.page.goto("learn")
    lesson.until(lambda: ids(server) == others, "the session has ended")


def test_where_it_is_used_is_shown_beside_the_text(lesson: LessonPage, server: Server) -> None:
    """A link puts a session in the place of the figure; the way back ends it."""
    others = ids(server)
    lesson.open("sir#use-1")
    lesson.page.locator(".flat-canvas[data-frame]").wait_for()
    assert lesson.page.locator("[data-part=own]").is_hidden()
    lesson.until(lambda: lesson.page.locator("[data-part=use] [data-control]").count() > 0, "what is unlocked is there")
    lesson.page.click("text=Back to the lesson")
    lesson.page.locator("[data-part=own]").wait_for(state="visible")
    lesson.until(lambda: ids(server) == others, "the session has ended")
