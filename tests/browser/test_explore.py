"""What else a run might have been, on the page of a session."""

import re
from collections.abc import Callable

from playwright.sync_api import expect

from tests.browser.host import Server
from tests.browser.views import SessionPage


def test_a_stranger_opens_what_would_have_saved_the_run(watch: Callable[..., SessionPage], server: Server) -> None:
    """Other seeds lie behind the error; a list of changes fills, best first, and a line opens as a branch."""
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
    page.get_by_role("button", name="What if…").click()
    card = page.get_by_role("region", name="What would have saved it")
    lines = card.locator("li")
    expect(lines.first).to_contain_text("Same settings, other seeds", timeout=60_000)
    expect(lines.nth(3)).to_be_visible(timeout=60_000)
    expect(card).to_contain_text("A cure of this run is not a cure in general.")
    lines.nth(1).get_by_role("button").click()
    expect(page.locator(".branches .chip")).to_have_count(2)
    card.get_by_role("button", name="Close").click()
    expect(card).to_be_hidden()
    expect(page.locator(":focus")).to_have_text(re.compile("^(What if…|Other seeds)$"))
