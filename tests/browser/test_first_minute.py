"""A first visitor's tour, scripts that are fetched ahead, My work and its search, and the keyboard alone."""

import re
from typing import Any
from urllib.parse import urlsplit

from tests.browser.accessible import check
from tests.browser.conftest import Complaints, Watch
from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage, View

REMEMBERED = "localStorage['pftrack-tour']"


class TourPage(SessionPage):
    """A session with a note of the tour over it."""

    def note(self, title: str) -> Any:
        """Wait for the note with a title."""
        note = self.page.locator(".callout", has=self.page.get_by_role("heading", name=title, exact=True))
        note.wait_for()
        return note

    def press_by_keyboard(self, button: Any) -> None:
        """Go from the note to a button with the tab key, and press it."""
        self.until(lambda: self.page.evaluate("document.activeElement.closest('.callout') !== null"), "it is focused")
        for _ in range(10):
            self.page.keyboard.press("Tab")
            if button.evaluate("button => button === document.activeElement"):
                break
        self.page.keyboard.press("Enter")


def test_three_clicks_lead_to_a_loss_and_its_reason(gallery: Gallery, server: Server) -> None:
    """Tour, play, and the step back before the loss: notes stand beside what to press or see.

    After a reload the tour continues with the step of the run; it ends for good by its button or by Escape.
    """
    page = gallery.page
    page.locator("[data-role=tour]").click()  # the first click
    tour = TourPage(page, server).ready()
    tour.note("A tracker at work")
    assert page.locator(".pointed-at").get_attribute("class") == "primary play pointed-at"
    tour.until(lambda: page.evaluate("document.activeElement.role") == "dialog", "the note has the focus")
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.textContent") == "Leave the tour"
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "primary play pointed-at"
    held: list[Any] = []
    page.route("**/explanation*", lambda route: held.append(route))  # noqa: PLW0108 - Playwright marks what it calls
    page.keyboard.press("Enter")  # the second
    tour.until(lambda: held and not tour.session["playing"], "it has stopped by itself, and asks why")
    assert page.get_by_role("heading", name="Lost").count() == 0, "there is no card beside which the note can stand"
    page.unroute("**/explanation*")  # continues the held requests
    lost = tour.note("Lost")
    since = next(frame for frame, each in enumerate(server.column(tour.id, "lost")) if each)
    assert f"in frame {since}" in lost.inner_text()
    assert tour.session["speed"] == 0.25
    page.reload()
    tour.ready()
    tour.note("Lost")
    card = page.get_by_role("region", name="The loss")
    tour.until(lambda: card.evaluate("card => card.classList.contains('pointed-at')"), "the card is pointed at")
    tour.press_by_keyboard(card.get_by_role("button", name="Go to frame 2"))  # the third
    why = tour.note("Why")
    tour.stands_at(2)
    assert "none of the 40 particles is on it" in why.inner_text()
    assert page.locator(".pointed-at").get_attribute("data-panel") == "ess"
    tour.press_by_keyboard(why.get_by_role("button", name="Go to frame 16"))
    tour.stands_at(16)
    tour.press_by_keyboard(why.get_by_role("button", name="Finish"))
    page.locator(".callout").wait_for(state="detached")
    assert page.evaluate("document.activeElement.matches('.play')")
    assert (page.evaluate(REMEMBERED), "tour" in page.url) == ("done", False)
    page.goto("./")
    page.get_by_text("Take the guided tour again").wait_for()
    page.locator("[data-role=tour]").click()
    tour.note("A tracker at work")
    tour.resize(390)
    inside = "({ left, right, top, bottom }) => left >= 0 && right <= innerWidth && top >= 0 && bottom <= innerHeight"
    box = "document.querySelector('.callout').getBoundingClientRect()"
    tour.until(lambda: page.evaluate(f"({inside})({box})"), "the note is within a phone's screen")
    page.keyboard.press("Escape")
    page.locator(".callout").wait_for(state="detached")
    assert (page.evaluate(REMEMBERED), "tour" in page.url) == ("left", False)


def test_my_work_is_searched_and_sessions_are_ended_at_once(page: Any, server: Server) -> None:
    """The words are in the address; other kinds are a step back; chosen rows stay chosen in another search."""
    ball, sine = server.start_session(seed=8), server.start_session(experiment="sine", seed=8)
    page.goto("work")
    work = View(page)
    here = lambda session: page.locator(f"[data-session='{session['id']}']")  # noqa: E731 - one line of reading
    here(ball).wait_for()
    here(sine).wait_for()
    search = page.get_by_label("Search my work")
    search.press_sequentially("signal seed 8")
    here(ball).wait_for(state="detached")
    assert here(sine).is_visible()
    work.until(lambda: page.url.endswith("/work?q=signal+seed+8"), "the address has the words")
    page.get_by_role("button", name="Uploads").click()
    page.get_by_text("Nothing matches all of these words").wait_for()
    search.fill("clip")
    work.until(lambda: page.url.endswith("show=uploads&q=clip"), "the new words replace the old ones")
    page.go_back()
    here(sine).wait_for()
    assert search.input_value() == "signal seed 8"
    search.fill("no such thing")
    page.get_by_role("button", name="Clear the search").click()
    here(ball).wait_for()
    kept = server.start_session(seed=9)
    page.goto("work?show=sessions&q=occluder")
    here(kept).wait_for()
    assert (here(sine).count(), page.locator("[data-part=runs]").count()) == (0, 0)
    here(ball).locator("input").check()
    search.fill("signal")
    here(kept).wait_for(state="detached")
    here(sine).locator("input").check()
    check(page)
    page.get_by_role("button", name="End 2 sessions").click()
    page.get_by_text("Ball behind an occluder, A signal in noise: anything you have not saved is lost.").wait_for()
    page.get_by_role("button", name="End them").click()
    page.get_by_text("Nothing matches all of these words").wait_for()
    assert [each["id"] for each in server.get("sessions")] == [kept["id"]]
    assert page.get_by_role("button", name="End 2 sessions").count() == 0


def test_a_note_on_compiling_goes_away_when_nothing_is_known(page: Any, complaints: Complaints) -> None:
    """Cards that waited for it can be opened; its live region stays, so that it is read out."""
    complaints.expected = ("500",)
    compiling = {"finished": False, "sentence": "compiling", "done": 1, "total": 9, "seconds_left": None}
    page.route("**/compilation", lambda route: route.fulfill(json={**compiling, "usable": [], "ready": []}))
    page.goto("./")
    page.get_by_text("Compiling.").wait_for()
    page.locator("[data-experiment=ball].waits").wait_for()
    page.route("**/compilation", lambda route: route.fulfill(status=500))
    page.locator("[data-experiment=ball]:not(.waits)").wait_for()
    assert page.locator("[data-part=compiling][role=status]").inner_text() == ""


def test_the_keyboard_alone_starts_a_session(gallery: Gallery, watch: Watch, server: Server) -> None:
    """From the top of the start page past the links to an experiment, which plays; the standing frame is described.

    The words tell the frame, the verdict and the estimate; picture, plots and measures have their own.
    """
    page = gallery.page
    gallery.card("ball").wait_for()
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.textContent") == "Skip to the content"
    page.keyboard.press("Enter")
    gallery.until(lambda: page.evaluate("document.activeElement.localName") == "main", "the content has the focus")
    focused = "document.activeElement.closest('[data-experiment=ball] h4') !== null"
    ring = "getComputedStyle(document.activeElement).outlineStyle"
    for _ in range(8):
        page.keyboard.press("Tab")
        assert page.evaluate(ring) != "none" or page.evaluate("document.activeElement.id") == "file-picker"
        if page.evaluate(focused):
            break
    assert page.evaluate(focused)
    page.keyboard.press("Enter")
    shown = SessionPage(page, server).ready()
    shown.until(lambda: (shown.position or 0) > 0, "it plays by itself")

    shown = watch()
    server.seek(shown.id, 59)
    words = page.locator("[data-role=in-words]")
    shown.until(lambda: words.inner_text().startswith("Frame 59 of 90; "), "the frame is described")
    assert f"; {shown.verdict}; estimate " in words.inner_text()
    shown.plot("ess").get_by_role("img", name="In frame 59 ESS").wait_for()
    page.get_by_role("img", name="frame 59").and_(page.locator(".flat-canvas")).wait_for()
    page.locator(".measures summary").click()
    listed = page.locator(".measures dl")
    shown.until(lambda: "of 60" in listed.inner_text(), "frames to failure name the frames seen")


VERSIONED = re.compile(r"^.*/static/version/\w+/")


def test_the_gallery_fetches_ahead(unchosen: Any) -> None:
    """Script of the session's page is there before somebody clicks, and is not asked for again afterwards."""
    page, gallery = unchosen, Gallery(unchosen)
    page.goto("./")
    ahead = "[...document.querySelectorAll('link[rel=prefetch]')].map((it) => it.href)"
    here = "performance.getEntriesByType('resource').filter((it) => it.responseEnd > 0).map((it) => it.name)"

    def fetched() -> set[str]:
        return {VERSIONED.sub("", urlsplit(address).path) for address in page.evaluate(ahead)}

    gallery.until(lambda: "session/session_start.js" in fetched(), "the page's first module is fetched")
    gallery.until(lambda: set(page.evaluate(ahead)) <= set(page.evaluate(here)), "all of them have come")
    gallery.card("ball").locator("h4 a").click(no_wait_after=True)
    page.wait_for_url("**/session/*")
    sent = "performance.getEntriesByType('resource').filter((it) => it.transferSize > 0).map((it) => it.name)"
    again = {VERSIONED.sub("", urlsplit(address).path) for address in page.evaluate(sent)}
    assert not {path for path in again if path.endswith(".js")}
