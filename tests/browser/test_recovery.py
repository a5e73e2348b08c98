"""Things that break or take long: connection, server, worker, imports. The page says so and goes on where it can."""

from string import ascii_lowercase, digits
from typing import Any

from tests.browser.conftest import Complaints
from tests.browser.host import Server, until
from tests.browser.test_sweep import SMALL, SweepPage
from tests.browser.views import Gallery, SessionPage, View


def test_links_that_lead_nowhere_say_so(page: Any, complaints: Complaints) -> None:
    """A link to a session that does not exist leads back to the gallery.

    Until then the transport and the tools are switched off, no empty plots are drawn, and keys do nothing. A share link
    that was cut in the mail shows a page that says so.
    """
    complaints.expected = ("the server responded with a status of 404",)
    page.goto("session/0123456789abcdef")
    assert "Session not found" in page.locator(".notice").inner_text()
    enabled = page.locator(".transport .group button:enabled")
    View(page).until(lambda: enabled.count() == 0, "the transport is switched off")
    assert (page.locator("[data-tool=save]:enabled").count(), page.locator(".play").inner_text()) == (0, "Play")
    for key in (*ascii_lowercase, *digits, *" []", "Home", "End", "ArrowLeft", "Shift+ArrowRight", "Escape"):
        page.keyboard.press(key)
    assert (complaints.unexpected, page.locator(".plots > *").count()) == ([], 0)
    page.click("text=Back to the experiments")
    Gallery(page).card("ball").wait_for()
    page.goto("session/new#eyJicm9rZW4")
    assert "must hold an experiment" in page.locator(".notice").inner_text()


# tests/viewer/test_browser.py has the scene after a lost connection.
def test_a_restarted_server_is_found_again(server: Server, page: Any, complaints: Complaints) -> None:
    """While the server is away a thin bar says so; afterwards session and sweep are as before, without a reload."""
    complaints.expected = ("Failed to load resource", "WebSocket connection")
    sweep = server.post("sweeps", {**SMALL, "trials": 1, "frames": 10})
    until(lambda: server.get(f"sweeps/{sweep['id']}")["state"] == "done", "the sweep is complete")
    session = server.start_session()
    server.seek(session["id"], 20)
    other = page.context.new_page()
    other.goto(sweep["page"])
    maps = SweepPage(other)
    maps.until(lambda: other.locator(".map").count() == 2, "the maps are there")
    maps.complete()
    page.goto(session["page"])
    shown = SessionPage(page, server).ready()
    shown.stands_at(20)
    shown.paints(20)
    errors = server.column(shown.id, "error")
    for each in (page, other):
        each.evaluate("window.notReloaded = true")

    server.stop()
    page.locator(".bar-lost").wait_for()
    shown.until(page.locator(".play").is_disabled, "the play button cannot be pressed")
    assert shown.painted == 20
    maps.until(other.locator("[data-part=disconnected]").is_visible, "the page says that it reconnects")
    assert other.locator(".map").count() == 2
    server.start()
    maps.until(other.locator("[data-part=disconnected]").is_hidden, "the page is connected again")
    maps.complete()
    page.locator(".bar-lost").wait_for(state="hidden")
    shown.until(lambda: shown.session["state"] in {"ready", "ended", "suspended"}, "the session is known again")
    resume = page.locator(".notice button")
    shown.until(lambda: resume.is_visible() or page.locator(".play").is_enabled(), "it goes on, or can be resumed")
    if resume.is_visible():
        resume.click()
    shown.until(page.locator(".play").is_enabled, "the play button can be pressed")
    shown.stands_at(20)
    shown.press("ArrowRight")
    shown.stands_at(21)
    shown.paints(21)
    assert server.column(shown.id, "error")[:21] == errors
    assert all(each.evaluate("window.notReloaded") for each in (page, other))


def test_an_import_outlasts_a_reload_and_a_silence_of_the_server(gallery: Gallery, complaints: Complaints) -> None:
    """The page says how far it is, after a reload too; stopped, it makes room for another file.

    While the server does not answer the page says so and asks again; then it shows what became of the run.
    """
    complaints.expected = ("net::ERR_FAILED",)
    page, drop, cancelled = gallery.page, gallery.page.locator(".drop"), list[str]()
    begun = {"id": "0123456789abcdef", "name": "heavy.pft", "done": 3, "total": 9, "result": None, "error": None}
    told = {**begun, "state": "working"}

    def answer(route: Any) -> None:
        if route.request.method == "DELETE":
            cancelled.append(route.request.url.rsplit("/", 1)[1])
            route.fulfill(status=204)
        elif told:
            route.fulfill(json=told)
        else:
            route.abort()

    def begin() -> None:
        gallery.choose("heavy.pft", b"a run", "application/octet-stream")
        page.get_by_text("Computing frame 3 of 9").wait_for()

    page.route("**/api/v1/runs/import?*", lambda route: route.fulfill(status=202, json=told))
    page.route("**/api/v1/jobs/*", answer)
    begin()
    page.reload()
    page.get_by_text("Computing frame 3 of 9").wait_for()
    assert "heavy.pft" in drop.inner_text()
    drop.locator("button").click()
    page.get_by_text("Drop a video here").wait_for()
    gallery.until(lambda: cancelled == [begun["id"]], "the server has heard of it")
    begin()
    told.clear()
    page.get_by_text("The server does not answer; trying again").wait_for()
    told |= {**begun, "state": "failed", "error": "It went wrong."}
    page.get_by_text("It went wrong.").wait_for()
    assert "heavy.pft was not accepted" in drop.inner_text()
    assert "#" not in page.url
