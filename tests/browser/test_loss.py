"""What is asked of a loss on the page of a session: the card over the picture, *Why?*, *What if…* and *Other seeds*."""

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest
from playwright.sync_api import Page, Route, expect

from pftrack.analysis.alternatives import BASELINE, Alternative
from pftrack.analysis.counterfactuals import Finding, Report
from tests.browser.accessible import check, fits
from tests.browser.host import Server
from tests.browser.views import SessionPage

LOST = {"parameters": {"occlusion_width_px": 100}, "frames": 60, "seed": 0}
SEEDS = range(1, 13)


@dataclass
class Told:
    """An exploration as a server would tell of it, which has tried enough; one at the lowest priority may take long.

    Attributes:
        stale: What the server says of it.
        asked: Bodies of the requests that began one.
    """

    stale: bool
    asked: list[dict[str, Any]]

    def answer(self, route: Route, session: str) -> None:
        def found(change: Alternative, holding: int, at_end: int, place: int) -> Finding:
            held, ended = ({seed: seed <= count for seed in SEEDS} for count in (holding, at_end))
            return Finding(change, held, 1200, 0.6, place, ended)

        pillar, many = "occlusion_width_px", "sample_count"
        report = Report(
            15,
            5,
            45,
            59,
            10,
            4,
            12,
            (
                found(BASELINE, 1, 0, 0),
                found(Alternative("particles", "Particles 800 to 3,200", {many: 3200}, many), 12, 0, 1),
                found(Alternative("tracker", "Tracker Condensation", {"tracker": "condensation"}), 11, 10, 2),
                found(Alternative("world", "Occluder width 100 px to 50 px", {pillar: 50}, pillar), 12, 12, 3),
                found(Alternative("world", "Occluder width 100 px to 200 px", {pillar: 200}, pillar), 0, 0, 4),
            ),
            is_complete=True,
        )
        if route.request.method == "POST":
            self.asked.append(route.request.post_data_json or {})
        job = {"id": "told", "kind": "exploration", "name": "what-if", "state": "done", "done": 120, "total": 120}
        more = {"result": report.as_dict(), "error": None, "session": session, "branch": "b0", "stale": self.stale}
        route.fulfill(status=202, content_type="application/json", body=json.dumps({**job, **more}))


@pytest.fixture
def tell(page: Page) -> Callable[[str], Told]:
    """Have a session's page told of an exploration."""

    def begin(session: str) -> Told:
        told = Told(stale=False, asked=[])
        page.route(re.compile(r"/explorations$|/jobs/told$"), lambda route: told.answer(route, session))
        return told

    return begin


def test_a_loss_calls_and_names_what_would_have_saved_it(
    watch: Callable[..., SessionPage], server: Server, tell: Callable[[str], Told]
) -> None:
    """By itself a card says why, with the best change of the tracker and of the scene that lasts; each can be tried.

    What was found then stays, grey and marked; the card that was put away stays small.
    """
    view = watch(**LOST)
    page = view.page
    told = tell(view.id)
    card = page.get_by_role("region", name="The loss")
    expect(card).to_be_hidden()
    server.seek(view.id, 59)
    why = server.get(f"sessions/{view.id}/explanation")["diagnosis"]
    expect(card.locator("summary")).to_have_text(why["sentence"])
    assert told.asked == [{"kind": "what-if", "frame": why["frame"]}]
    tracker, scene = card.get_by_role("listitem").all()
    expect(tracker).to_contain_text("Tracker Condensation 11 of 12 hold 30 frames on, 10 of 12 to the end")
    expect(scene).to_contain_text("Occluder width 100 px to 50 px 12 of 12 hold 30 frames on, 12 of 12 to the end")
    check(page)
    fits(page)
    page.set_viewport_size({"width": 1280, "height": 800})
    card.get_by_role("button", name=f"Go to frame {why['signs'][0]['since']}").click()
    view.stands_at(why["signs"][0]["since"])

    told.stale = True
    scene.get_by_role("button", name="Try it: Occluder width 100 px to 50 px").click()
    expect(page.locator(".branches .chip")).to_have_count(2)
    view.stands_at(45)
    assert server.session(view.id)["parameters"]["occlusion_width_px"] == 50
    expect(card.locator("summary")).to_have_text("Lost in frame 15 stale")
    card.locator("summary").click()
    expect(scene).to_contain_text("stale")
    expect(tracker.get_by_role("button", name=re.compile("^Try it"))).to_be_enabled()

    told.stale = False
    page.get_by_role("button", name="Main").click()
    expect(scene).not_to_contain_text("stale")
    card.locator("summary").click()
    expect(card.locator("details")).not_to_have_attribute("open", "")
    assert len(told.asked) == 1, "of this very run it is known"
    told.stale = True
    server.post(f"sessions/{view.id}/commands", {"kind": "restart", "seed": 0})
    server.seek(view.id, 59)
    view.until(lambda: len(told.asked) == 2, "another run is asked about anew")
    expect(card.get_by_role("button", name="Why", exact=True)).to_be_hidden()


def test_why_and_what_if_stand_in_the_place_of_the_plots(
    watch: Callable[..., SessionPage], server: Server, tell: Callable[[str], Told]
) -> None:
    """A key and a button ask; why shows the server's words and numbers, what if three lines and all of them behind."""
    view = watch(**LOST)
    page = view.page
    tell(view.id)
    server.seek(view.id, 59)
    told = server.get(f"sessions/{view.id}/explanation")["diagnosis"]
    page.get_by_role("region", name="The loss").get_by_role("button", name="Why", exact=True).click()
    expect(page.locator(".why-sentence")).to_have_text(told["sentence"])
    assert [page.locator(".sign > p").nth(place).inner_text() for place in range(2)] == [
        sign["words"] for sign in told["signs"]
    ]
    expect(page.locator(".evidence canvas")).to_have_count(sum(len(sign["evidence"]) for sign in told["signs"]))
    expect(page.locator(".plots")).to_be_hidden()
    check(page)
    view.press("i")
    page.locator(".inspection-card").wait_for()
    expect(page.locator(".why-sentence")).to_be_hidden()
    view.press("w")
    page.locator(".why-sentence").wait_for()
    expect(page.locator(".inspection-card")).to_be_hidden()
    page.locator(".sign button").first.click()
    view.stands_at(told["signs"][0]["since"])

    about = page.get_by_role("group", name="About the loss")
    about.get_by_role("button", name="What if…").click()
    lines = page.locator(".what-if").get_by_role("listitem")
    titles = page.locator(".what-if-title")
    expect(titles).to_have_text(
        ["Same settings, other seeds", "Tracker Condensation", "Occluder width 100 px to 50 px"]
    )
    page.get_by_role("button", name="All 4").click()
    expect(titles).to_have_count(5)
    expect(lines.nth(2)).to_contain_text("better for a while, but not at the end")
    expect(page.locator(".what-if")).to_contain_text("A cure of this run is not a cure in general.")
    check(page)
    fits(page)
    page.set_viewport_size({"width": 1280, "height": 800})
    lines.nth(1).get_by_role("button", name="Try it: Tracker Condensation").click()
    expect(page.locator(".branches .chip")).to_have_count(2)
    page.get_by_role("button", name="Back to the plots").click()
    expect(page.locator(".plots")).to_be_visible()


def test_changes_are_tried_and_other_seeds_lie_behind_the_error(
    watch: Callable[..., SessionPage], server: Server
) -> None:
    """What a server tries fills the list, and can be stopped; the band is there as soon as it is computed."""
    view = watch(**{**LOST, "frames": 45})
    page = view.page
    server.seek(view.id, 20)
    view.stands_at(20)
    page.get_by_role("region", name="The loss").get_by_role("button", name="What if…").click()
    first = page.locator(".what-if").get_by_role("listitem").first
    expect(first).to_contain_text("Same settings, other seeds", timeout=60_000)
    page.get_by_role("button", name="Stop").click()
    expect(page.get_by_role("progressbar", name="Runs carried out")).to_be_hidden()
    expect(page.get_by_role("button", name="Try again")).to_be_visible()
    page.get_by_role("button", name="Back to the plots").click()
    page.get_by_role("button", name="Other seeds").click()
    expect(page.locator(".explore-words")).to_have_text(re.compile(r"^\d+ of 40 hold in this frame$"), timeout=60_000)
    trace = view.trace("error of other seeds")
    assert trace is not None
    assert len(trace["low"]) == 45
