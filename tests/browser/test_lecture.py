"""A lecture: made by dragging and by keys, held with a class, and its answers."""

from collections.abc import Callable
from typing import Any

import pytest

from tests.browser.accessible import check, fits
from tests.browser.class_room import Follower, all_of, lead
from tests.browser.host import Server, until
from tests.browser.test_compare import ball, link
from tests.browser.views import View

NEXT = "[data-role=lecture-next]"


class LecturePage(View):
    """A page of one who makes a lecture, or holds it."""

    def is_followed(self) -> None:
        """Wait until somebody has come along."""
        self.until(lambda: self.page.inner_text(".follow-chip") == "1 follows", "somebody follows")

    @property
    def order(self) -> list[str]:
        """The titles in their order."""
        return [str(title) for title in self.page.locator(".order .row-title").all_inner_texts()]

    def handle(self, place: int) -> Any:
        return self.page.locator(".order-handle").nth(place)

    def pull(self, place: int, to: int) -> None:
        """Drag a line by its handle to where another one is."""
        boxes = [self.handle(each).bounding_box() for each in (place, to)]
        (x, y), (_, goal) = ((box["x"] + box["width"] / 2, box["y"] + box["height"] / 2) for box in boxes)
        self.drag((x, y), (x, (y + goal) / 2), (x, goal + (20 if to > place else -20)), steps=8)

    def add(self, kind: str, name: str) -> None:
        """Add what is listed under a kind."""
        self.page.locator(f"[data-place={kind}]").click()
        self.page.get_by_role("button", name=name, exact=True).click()


@pytest.mark.timeout(600)  # two browsers through four pages
def test_a_lecture_is_made_and_held(page: Any, server: Server, newcomer: Callable[..., Follower]) -> None:
    """Items are ordered by dragging and by keys; N and Next keep presenting, ask, reveal, and take the class along."""
    page.goto("lectures")
    page.get_by_role("button", name="New lecture").click()
    page.wait_for_url("**/lectures/*")
    made = LecturePage(page)
    address = f"lectures/{page.url.rsplit('/', 1)[1]}"
    page.get_by_label("Title").fill("An hour")
    made.add("failures", "Add Wrong dynamics")
    made.add("lessons", "Add From picture back to state: Bayes' rule")
    page.locator("[data-place=polls]").click()
    page.get_by_label("Question").fill("Does it hold?")
    page.get_by_role("button", name="Add the poll").click()
    page.get_by_label("Or paste a link").fill(server.start_session(frames=5)["page"])
    page.locator(".palette-link").get_by_role("button", name="Add").click()
    made.until(lambda: len(made.order) == 4, "all items are there")
    until(lambda: len(server.get(address)["items"]) == 4, "all items are saved")
    failure, lesson, poll, session = made.order
    made.pull(0, 2)
    made.until(lambda: made.order == [lesson, poll, failure, session], "the failure was dragged down")
    made.handle(3).focus()
    for _ in range(2):
        page.keyboard.press("ArrowUp")
    made.until(lambda: made.order == [lesson, session, poll, failure], "the session was moved by keys")
    assert page.evaluate("document.activeElement.getAttribute('aria-label')") == f"Move {session}: arrow keys"
    page.get_by_role("button", name=f"Move {poll} down").click()
    page.get_by_label(f"Minutes for {lesson}").fill("12")
    page.keyboard.press("Enter")
    wanted = [lesson, session, failure, poll]
    until(lambda: [item["title"] for item in server.get(address)["items"]] == wanted, "the order is saved")
    until(lambda: server.get(address)["items"][0]["minutes"] == 12, "the minutes are saved")
    made.until(lambda: "4 items, 24 min" in page.inner_text(".lecture-total"), "the total is there")
    check(page)
    held(page, made, server, newcomer, wanted)
    page.wait_for_url(f"**/{address}")
    made.until(lambda: "last time" in page.inner_text(".order"), "it says how long each item took")
    made.until(lambda: page.locator(".answered .poll-bar").count() == 2, "it shows what was answered")
    over = page.get_by_role("status", name="The lecture is over")
    made.until(lambda: "1 follows" in over.inner_text(), "it says who follows still")
    over.get_by_role("button", name="End for the class").click()
    made.until(lambda: "The class has ended" in over.inner_text(), "it has ended for all")
    assert server.get("follows") == []
    server.delete(address)


def held(page: Any, made: LecturePage, server: Server, newcomer: Callable[..., Follower], titles: list[str]) -> None:
    """Walk through the lecture, with one who follows."""
    page.evaluate("Element.prototype.requestFullscreen = null")  # a full screen has no place here
    page.get_by_role("button", name="Begin the lecture").click()
    page.wait_for_url("**/learn/bayes")
    page.locator(".figure-view[data-shown]").wait_for()
    presented = "document.documentElement.dataset.presenting !== undefined"
    assert page.evaluate(presented)
    assert [page.inner_text(f".lecture-{part}") for part in ("place", "count")] == [titles[0], "1 of 4"]
    assert page.locator(".neighbours").is_hidden(), "one way on, the lecture's"
    assert "of 12 min" in page.inner_text(".lecture-clocks")
    check(page)
    follower = newcomer()
    follower.open(lead(page))
    page.keyboard.press("Escape")
    made.is_followed()

    page.keyboard.press("n")  # the lecture's next item, and not the next lesson
    page.wait_for_url("**/session/*")
    page.locator(".flat-canvas[data-frame]").wait_for()
    made.is_followed()
    all_of([follower], lambda one: one.frame is not None, "the class sees the session")
    assert page.evaluate(presented)
    opened = page.url
    page.locator(NEXT).click()
    page.wait_for_url("**/failures/*")
    made.is_followed()
    follower.until(lambda: follower.text("h1") == titles[2], "the class sees the failure")

    page.keyboard.press("PageUp")
    page.wait_for_url(opened)  # the same session
    page.locator(f"body:has({NEXT}) .flat-canvas[data-frame]").wait_for()
    page.keyboard.press("n")  # the lecture's next item, and not a branch
    page.wait_for_url("**/failures/*")
    made.is_followed()

    page.keyboard.press("PageDown")
    follower.until(lambda: "Does it hold?" in follower.text(".poll"), "what the lecture asks is asked")
    follower.page.get_by_role("button", name="No").click()
    made.until(lambda: "1 of 1 has answered" in page.inner_text(".lead-poll"), "it is answered")
    assert page.inner_text(NEXT) == "Reveal"
    page.keyboard.press("PageDown")
    follower.until(lambda: "Most answered “No”" in follower.text(".poll"), "it is revealed")
    made.until(lambda: page.locator("[data-staged]").count() == 1, "the answers take the page")
    page.keyboard.press("PageDown")
    made.until(lambda: page.locator("[data-staged]").count() == 0, "the next key gives the page back")
    line, first = (page.locator(each).bounding_box() for each in (".lead-poll[data-folded]", "main"))
    assert line["y"] + line["height"] <= first["y"] + 1, "folded, the poll hides nothing"
    assert page.inner_text(NEXT) == "Finish"
    page.keyboard.press("PageDown")


def test_a_page_becomes_an_item(page: Any, server: Server) -> None:
    """A comparison is added to a new lecture, from where its class is."""
    page.goto(link(ball(), ball("condensation")))
    page.locator(".follow-chip:enabled").click()
    page.locator("[data-role=add-to-lecture]").click()
    page.get_by_role("link", name="Open the lecture").wait_for()
    [made] = server.get("lectures")
    [item] = server.get(f"lectures/{made['id']}")["items"]
    assert (item["kind"], item["problem"]) == ("comparison", None)
    server.delete(f"lectures/{made['id']}")


def test_a_lessons_question_is_a_poll(page: Any, server: Server, newcomer: Callable[..., Follower]) -> None:
    """One click asks the class what the lesson asks; what was answered is shown again and exported."""
    lesson = LecturePage(page)
    page.goto("learn/bayes")
    assert page.locator("[data-role=to-class]").is_hidden()
    follower = newcomer()
    follower.open(lead(page))
    page.keyboard.press("Escape")
    lesson.is_followed()
    follower.page.locator(".figure-grip:disabled").first.wait_for(state="attached")
    grips = ".figure-knob:visible, .figure-grip:enabled:visible"
    assert follower.page.locator(grips).count() == 0, "nothing to be moved"
    shown = follower.page.locator(".figure-key").all_inner_texts()
    page.locator("[data-role=to-class]").click()
    follower.page.get_by_role("button", name="Two peaks, near 2 m and near 8 m").click()
    lesson.until(lambda: "1 of 1 has answered" in page.inner_text(".lead-poll"), "it is answered")
    page.locator(".lead-poll").get_by_role("button", name="Reveal").click()
    page.locator(".lead-poll .poll-bar").first.wait_for()
    lesson.until(lambda: "The class has answered" in page.inner_text("[data-part=question]"), "so has the lesson")
    follower.until(lambda: follower.page.locator(".figure-key").all_inner_texts() != shown, "the class sees its answer")
    page.locator(".lead-poll").get_by_role("button", name="Close").click()
    lesson.until(lambda: page.locator("[data-role=to-class]").is_visible(), "it can be asked again")

    page.locator(".follow-chip").click()
    page.locator(".class-before summary").first.click()
    page.locator(".class-before .answered summary").first.click()
    page.get_by_role("button", name="Show again").first.click()
    follower.until(lambda: "Most answered “Two peaks" in follower.text(".poll"), "the answers are shown again")

    page.goto("lectures")
    with page.expect_download() as download:
        page.get_by_role("link", name="Download as CSV").click()
    assert ',"Two peaks, near 2 m and near 8 m",1,100.0,' in download.value.path().read_text()
    page.locator(".answered summary").first.click()
    fits(page)
