"""What a first visitor meets: the tour, My work and its search, large type, and the keyboard alone."""

from collections.abc import Callable
from typing import Any

from tests.browser.accessible import check
from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage, View

Watch = Callable[..., SessionPage]
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
        self.until(lambda: self.page.evaluate("document.activeElement.closest('.callout') !== null"), "it is read out")
        for _ in range(10):
            self.page.keyboard.press("Tab")
            if button.evaluate("button => button === document.activeElement"):
                break
        self.page.keyboard.press("Enter")


def test_three_clicks_lead_to_a_loss_and_its_reason(gallery: Gallery, server: Server) -> None:
    """Tour, play, and in the card of the loss to before it: notes stand beside what is to be pressed, or to be seen."""
    page = gallery.page
    page.locator("[data-role=tour]").click()  # the first click
    tour = TourPage(page, server).ready()
    tour.note("A tracker at work")
    assert page.locator(".pointed-at").get_attribute("class") == "primary play pointed-at"
    tour.until(lambda: page.evaluate("document.activeElement.role") == "dialog", "the note is read out")
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.textContent") == "Leave the tour"
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "primary play pointed-at"
    held: list[Any] = []
    page.route("**/explanation*", lambda route: held.append(route))  # noqa: PLW0108 - Playwright marks what it calls
    page.keyboard.press("Enter")  # the second
    tour.until(lambda: held and not tour.session["playing"], "it has stopped by itself, and asks why")
    assert page.get_by_role("heading", name="Lost").count() == 0, "there is no card beside which the note can stand"
    page.unroute("**/explanation*")  # which lets go on what was held
    lost = tour.note("Lost")
    since = next(frame for frame, each in enumerate(server.column(tour.id, "lost")) if each)
    assert f"in frame {since}" in lost.inner_text()
    card = page.get_by_role("region", name="The loss")
    assert card.evaluate("card => card.classList.contains('pointed-at')")
    assert tour.session["speed"] == 0.25
    tour.press_by_keyboard(card.get_by_role("button", name="Go to frame 2"))  # the third
    why = tour.note("Why")
    tour.stands_at(2)
    assert not server.column(tour.id, "lost")[2]
    assert "none of the 40 particles is on it" in why.inner_text()
    assert page.locator(".pointed-at").get_attribute("data-panel") == "ess"
    tour.press_by_keyboard(why.get_by_role("button", name="Go to frame 16"))
    tour.stands_at(16)
    tour.press_by_keyboard(why.get_by_role("button", name="Finish"))
    page.locator(".callout").wait_for(state="detached")
    assert page.evaluate("document.activeElement.matches('.play')")
    assert page.evaluate(REMEMBERED) == "done"
    assert "tour" not in page.url
    page.keyboard.press("?")
    page.locator("dialog [data-role=tour]").wait_for()
    page.goto("./")
    page.get_by_text("Take the guided tour again").wait_for()


def test_escape_leaves_the_tour_and_a_reload_goes_on_with_it(gallery: Gallery, server: Server) -> None:
    """Opened again in the middle, it goes on with the step that the run is at; left, it is gone for good."""
    page = gallery.page
    page.locator("[data-role=tour]").click()
    tour = TourPage(page, server).ready()
    tour.note("A tracker at work")
    server.seek(tour.id, 60)
    tour.note("Lost")
    page.reload()
    tour.ready()
    tour.note("Lost")
    tour.resize(390)
    inside = "({ left, right, top, bottom }) => left >= 0 && right <= innerWidth && top >= 0 && bottom <= innerHeight"
    box = "document.querySelector('.callout').getBoundingClientRect()"
    tour.until(lambda: page.evaluate(f"({inside})({box})"), "the note is within a phone's screen")
    page.keyboard.press("Escape")
    page.locator(".callout").wait_for(state="detached")
    assert page.evaluate(REMEMBERED) == "left"
    assert "tour" not in page.url


# test_failures.py has a server that is full.
def test_my_work_is_found_by_words(page: Any, server: Server) -> None:
    """What is typed is looked for and stands in the address; other kinds are a step that one may go back.

    Several sessions are ended at once.
    """
    ball, sine = server.start_session(seed=8), server.start_session(experiment="sine", seed=8)
    page.goto("work")
    work = View(page)
    here = lambda session: page.locator(f"[data-session='{session['id']}']")  # noqa: E731 - one line of reading
    here(ball).wait_for()
    here(sine).wait_for()
    page.get_by_label("Search my work").press_sequentially("signal seed 8")
    here(ball).wait_for(state="detached")
    assert here(sine).is_visible()
    work.until(lambda: page.url.endswith("/work?q=signal+seed+8"), "the address says what is looked for")
    page.get_by_role("button", name="Uploads").click()
    page.get_by_text("Nothing matches all of these words").wait_for()
    page.get_by_label("Search my work").fill("clip")
    work.until(lambda: page.url.endswith("show=uploads&q=clip"), "the new words replace the old ones")
    page.go_back()
    here(sine).wait_for()
    assert page.get_by_label("Search my work").input_value() == "signal seed 8"
    page.get_by_label("Search my work").fill("no such thing")
    page.get_by_role("button", name="Clear the search").click()
    here(ball).wait_for()
    page.goto("work?show=sessions&q=occluder")
    here(ball).wait_for()
    assert (here(sine).count(), page.locator("[data-part=runs]").count()) == (0, 0)
    they_are_ended_at_once(page, server, [ball, sine])


def they_are_ended_at_once(page: Any, server: Server, ended: list[dict[str, Any]]) -> None:
    """What is chosen stays chosen in another search; one question names all of them, and they are gone."""
    kept = server.start_session(seed=9)
    page.goto("work?show=sessions")
    page.locator(f"[data-session='{ended[0]['id']}'] input").check()
    page.get_by_label("Search my work").fill("signal")
    page.locator(f"[data-session='{kept['id']}']").wait_for(state="detached")
    page.locator(f"[data-session='{ended[1]['id']}'] input").check()
    check(page)
    page.get_by_role("button", name="End 2 sessions").click()
    page.get_by_text("Ball behind an occluder, A signal in noise: anything you have not saved is lost.").wait_for()
    page.get_by_role("button", name="End them").click()
    page.get_by_text("Nothing matches all of these words").wait_for()
    assert [each["id"] for each in server.get("sessions")] == [kept["id"]]
    assert page.get_by_role("button", name="End 2 sessions").count() == 0


def test_a_renamed_run_has_its_new_name_on_all_buttons(page: Any, server: Server) -> None:
    """Also on the menu of its files, which was made before; the focus stays where it was."""
    run = server.post("runs", {"session": server.start_session()["id"], "title": "Tuesday"})
    page.goto("work?show=runs")
    row = page.locator(f"[data-run='{run['id']}']")
    row.get_by_role("button", name="Rename Tuesday").click()
    page.get_by_role("textbox", name="Name").fill("Wednesday")
    page.get_by_role("button", name="Rename", exact=True).click()
    row.get_by_role("button", name="Download Wednesday").wait_for()
    names = "buttons => buttons.map((button) => button.ariaLabel)"
    named = [f"{act} Wednesday" for act in ("Download", "Rename", "Delete")]
    assert row.get_by_role("button").evaluate_all(names) == [None, *named]
    assert page.evaluate("document.activeElement.ariaLabel") == "Rename Wednesday"


def test_a_note_on_compiling_goes_away_when_nothing_is_known(page: Any, complaints: Any) -> None:
    """Cards that waited for it can be opened; the place where it was told stays, so that it is read out."""
    complaints.expected = ("500",)
    compiling = {"finished": False, "sentence": "compiling", "done": 1, "total": 9, "seconds_left": None}
    answers = [{"json": {**compiling, "usable": [], "ready": []}}, {"status": 500}]
    page.route("**/compilation", lambda route: route.fulfill(**answers.pop(0)))
    page.goto("./")
    page.get_by_text("Compiling.").wait_for()
    page.locator("[data-experiment=ball].waits").wait_for()
    page.get_by_text("Compiling.").wait_for(state="detached")
    page.locator("[data-experiment=ball]:not(.waits)").wait_for()
    assert page.locator("[data-part=compiling][role=status]").inner_text() == ""


def test_the_frame_is_told_in_words_when_the_run_stands(watch: Watch, server: Server) -> None:
    """Who cannot see the scene hears what the box of numbers says, of the scene, of each plot and of the run so far."""
    shown = watch()
    server.seek(shown.id, 59)
    words = shown.page.locator("[data-role=in-words]")
    shown.until(lambda: words.inner_text().startswith("Frame 59 of 90; "), "the frame is told")
    assert f"; {shown.verdict}; estimate " in words.inner_text()
    shown.plot("ess").get_by_role("img", name="In frame 59 ESS").wait_for()
    shown.page.get_by_role("img", name="frame 59").and_(shown.page.locator(".flat-canvas")).wait_for()
    leading, listed = shown.page.locator(".measures"), shown.page.locator(".measures dl")
    shown.until(lambda: "hit rate" in leading.inner_text() and "100 %" in leading.inner_text(), "it is said first")
    leading.locator("summary").click()
    shown.until(lambda: "of 60" in listed.inner_text(), "frames to failure are told of how many")
    known = server.get(f"sessions/{shown.id}")["measured"]
    assert f"inside the true box\n{100 * known['inside_share']:.0f} %" in listed.inner_text()
    assert f"{known['median_error_px']:.1f} px" in listed.inner_text()


def test_the_keyboard_alone_starts_a_session(gallery: Gallery, server: Server) -> None:
    """From the top of the start page past the links to an experiment, which runs; there the space bar plays."""
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
    shown.press(" ")
    shown.until(lambda: not shown.session["playing"], "it pauses")
