"""The gallery of failures in a real browser: a failure beside its cure, in step, and nothing left behind."""

from typing import Any

import pytest

from tests.browser.accessible import check, fits, usable
from tests.browser.conftest import Complaints
from tests.browser.host import Server
from tests.browser.views import PAINTED_FRAMES, View


class FailurePage(View):
    """The page of a failure."""

    def ready(self) -> None:
        """Wait until both runs are painted and what moves them can be used."""
        self.until(lambda: len(self.frames) == 2, "both runs are painted")
        self.until(lambda: self.page.locator(".failure-deck .play").is_enabled(), "the play button can be pressed")

    @property
    def frames(self) -> list[int]:
        """The frames that are painted, the failing run's first."""
        return self.page.evaluate(PAINTED_FRAMES)

    def told(self, side: str, place: str = ".verdict") -> str:
        return str(self.page.locator(f"[data-side={side}] {place}").inner_text())

    def stand_at(self, frame: int) -> None:
        self.until(lambda: self.frames == [frame, frame], f"both show frame {frame}")


@pytest.fixture
def failure(page: Any) -> FailurePage:
    return FailurePage(page)


def test_failure_three_is_found_in_the_gallery(failure: FailurePage, server: Server, complaints: Complaints) -> None:
    """The gallery has ten by kind, with their numbers and the errors of both runs; the third leads to its page.

    Each has the errors of the fourth here: tests/analysis/test_failures.py has all of them fail and be cured.
    Where they cannot be listed, *Try again* asks again.
    """
    complaints.expected = ("ERR_FAILED",)
    page = failure.page
    course = server.get("failures/wrong-dynamics/course")
    page.route("**/api/v1/failures/*/course", lambda route: route.fulfill(json=course))
    page.route("**/api/v1/failures", lambda route: route.abort(), times=1)
    page.goto("failures")
    page.get_by_role("button", name="Try again").click()
    failure.until(lambda: page.locator(".failure-card").count() == 10, "all ten are there")
    assert page.locator("section h2").count() == 4
    failure.until(lambda: page.locator(".curve canvas").count() == 10, "the errors of all are drawn")
    words = page.locator("[data-failure=wrong-dynamics] .figure-miniature").get_attribute("aria-label")
    assert "Error over 60 frames. It fails after frame 6: up to 138.9 px" in words
    card = page.locator(".failure-card", has=page.locator(".failure-number", has_text="3"))
    assert card.locator("h3").inner_text().split() == ["3", "Look-alike", "capture"]
    usable(page)
    assert card.locator("h3 a").get_attribute("href") == "failures/look-alike-capture"


def test_a_failure_and_its_cure_are_watched_in_step(failure: FailurePage, server: Server) -> None:
    """By its number it opens at the frame before; one frame later one run is lost, and both say why.

    Both runs are compared from the shown frame; a run opens as a session that stays when the page is left.
    """
    page = failure.page
    page.goto("failures/4")
    failure.ready()
    assert page.url.endswith("/failures/wrong-dynamics")
    failure.stand_at(6)
    failure.until(lambda: failure.told("failing") == "held (by truth)", "the target is held in the frame before")
    for side, words in (("failing", "the estimate 3.8 px that way"), ("cured", "Never lost in")):
        page.locator(f"[data-side={side}] .measured", has_text=words).wait_for()
    numbers = {failure.told(side, ".failure-numbers") for side in ("failing", "cured")}
    assert ["distance from the truth" in each for each in numbers] == [True, True]
    for side, tracker in (("failing", "Guided diffusion"), ("cured", "Condensation")):
        assert f"Tracker {tracker}" in failure.told(side, "h2")

    page.keyboard.press("ArrowRight")
    failure.stand_at(7)
    failure.until(lambda: failure.told("failing") == "lost since 7 (by truth)", "the failing run has lost the ball")
    failure.until(lambda: failure.told("cured") == "held (by truth)", "the cured one has not")
    page.locator(".failure-deck .scrubber").focus()
    page.keyboard.press("Home")
    failure.stand_at(0)
    page.get_by_role("button", name="Frame 6, before it happens").click()
    failure.stand_at(6)

    check(page)
    fits(page)
    failure.resize(390)
    title = page.locator("h1").evaluate("(it) => [it.scrollWidth <= it.clientWidth, it.innerText]")
    assert title == [True, "4 Wrong dynamics"], "a phone has the whole title"
    failure.resize(1280)
    page.get_by_role("link", name="Compare both runs").click()
    page.wait_for_url("**/compare#*")
    failure.until(lambda: failure.frames == [6, 6], "both stand where they stood")
    table = page.inner_text(".comparison-table")
    assert all(tracker in table for tracker in ("Guided diffusion", "Condensation"))
    page.goto("failures/4")
    failure.ready()

    failure.until(lambda: len(server.get("sessions")) == 2, "only the page's own are there")
    page.locator("[data-side=cured]").get_by_role("link", name="Open as a session").click()
    page.wait_for_url(lambda url: "/session/" in url and "/session/new" not in url)
    opened = page.url.rsplit("/", 1)[1]
    failure.until(lambda: server.session(opened)["position"] == 6, "it stands at the frame before")
    assert server.session(opened)["tracker"] == "condensation"
    failure.until(lambda: [it["id"] for it in server.get("sessions")] == [opened], "the page's own have ended")


def test_a_refused_run_is_said_and_leaves_nothing(failure: FailurePage, server: Server, complaints: Complaints) -> None:
    """The page reports that the server has no room for both runs; closing the page ends the run that began."""
    complaints.expected = ("status of 503",)
    page, begun = failure.page, list[Any]()

    def start(route: Any) -> None:
        if begun:
            route.fulfill(status=503, json={"error": {"message": "All places are taken."}})
        else:
            begun.append(route)
            route.fetch()

    page.route("**/api/v1/sessions", start)
    page.goto("failures/4")
    failure.until(lambda: "places are taken" in page.inner_text("main"), "it is said")
    failure.until(lambda: len(server.get("sessions")) == 1, "the other run has started")
    page.goto("about:blank")
    failure.until(lambda: server.get("sessions") == [], "the started run has ended")
