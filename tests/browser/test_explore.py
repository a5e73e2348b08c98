"""What else a run might have been, on the page of a session."""

import json
import re
from collections.abc import Callable
from typing import Any

from playwright.sync_api import Locator, Page, Route, expect

from tests.browser.host import Server
from tests.browser.views import SessionPage


def hurry(page: Page) -> list[dict[str, Any]]:
    """Give what a page explores first a second, not twenty; return what it asks for, as it asks."""
    bodies: list[dict[str, Any]] = []

    def shorten(route: Route) -> None:
        if route.request.method != "POST":
            route.fallback()
            return
        body: dict[str, Any] = route.request.post_data_json or {}
        bodies.append(body)
        route.continue_(post_data=json.dumps(body if body.get("after") else {**body, "seconds": 1}))

    page.route(re.compile(r"/explorations$"), shorten)
    return bodies


def trials(card: Locator) -> dict[str, int]:
    """With how many seeds each change of a list has been tried, by its title."""
    told = card.locator("li").evaluate_all(
        "(all) => all.map((li) => ['.what-if-title', '.what-if-count'].map((one) => li.querySelector(one).textContent))"
    )
    return {title: int(re.findall(r"\d+", count)[1]) for title, count in told}


def test_a_stranger_opens_what_would_have_saved_the_run(watch: Callable[..., SessionPage], server: Server) -> None:
    """Other seeds lie behind the error; a list fills, goes on where time was short, and a line opens as a branch."""
    shown = watch(experiment="ball", parameters={"occlusion_width_px": 100}, frames=45)
    page = shown.page
    server.seek(shown.id, 20)
    shown.stands_at(20)
    seeds = page.get_by_role("button", name="Other seeds")
    seeds.click()
    expect(page.locator(".explore-words")).to_have_text(re.compile(r"^\d+ of 40 hold in this frame$"), timeout=60_000)
    trace = shown.trace("error of other seeds")
    assert trace is not None
    assert len(trace["low"]) == 45
    bodies = hurry(page)
    page.get_by_role("button", name="What if…").click()
    card = page.get_by_role("region", name="What would have saved it")
    lines = card.locator("li")
    expect(lines.first).to_contain_text("Same settings, other seeds", timeout=60_000)
    further = card.get_by_role("button", name="Go on")
    expect(further).to_be_visible(timeout=60_000)
    tried = trials(card)
    further.click()
    expect(further).to_be_hidden()
    shown.until(lambda: sum(trials(card).values()) > sum(tried.values()), "more has been tried", 60)
    assert all(trials(card).get(title, 0) >= count for title, count in tried.items())
    assert [bool(body.get("after")) for body in bodies] == [False, True]
    expect(lines.nth(3)).to_be_visible(timeout=60_000)
    expect(card).to_contain_text("A cure of this run is not a cure in general.")
    lines.nth(1).get_by_role("button").click()
    expect(page.locator(".branches .chip")).to_have_count(2)
    card.get_by_role("button", name="Close").click()
    expect(card).to_be_hidden()
    expect(page.locator(":focus")).to_have_text(re.compile("^(What if…|Other seeds)$"))
