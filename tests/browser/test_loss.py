"""What is asked of a loss on the page of a session: the card over the picture, *Why?*, *What if…* and *Other seeds*."""

import json
import re
from typing import Any

import httpx
import pytest
from playwright.sync_api import Locator, Page, Route, expect

from pftrack.analysis.alternatives import BASELINE, Alternative
from pftrack.analysis.counterfactuals import Finding, Report
from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.runs.run import Run
from tests.browser.accessible import check, fits, usable
from tests.browser.conftest import Watch
from tests.browser.host import Server
from tests.browser.views import SessionPage
from tests.making import encoded

pytestmark = pytest.mark.explores
expect.set_options(timeout=60_000)
LOST = {"parameters": {"occlusion_width_px": 100}, "seed": 0}
PILLAR, MANY = "occlusion_width_px", "sample_count"
TRIED = (
    (BASELINE, 1, 0),
    (Alternative("particles", "Particles 800 to 3,200", {MANY: 3200}, MANY), 12, 0),
    (Alternative("tracker", "Tracker Condensation", {"tracker": "condensation"}), 11, 10),
    (Alternative("world", "Occluder width 100 px to 50 px", {PILLAR: 50}, PILLAR), 12, 12),
    (Alternative("world", "Occluder width 100 px to 200 px", {PILLAR: 200}, PILLAR), 0, 0),
)
"""Changes, and how many of twelve runs held soon after the loss and at the end."""


def tell(page: Page, server: Server, session: str) -> dict[str, Any]:
    """Have a page told what a server tells that has tried enough, which may take long at the lowest priority.

    Returns:
        Whether that is `stale` even on its branch, which may be changed, and the bodies that it was `asked` by.
    """
    told: dict[str, Any] = {"stale": False, "asked": []}
    held = lambda count: {seed: seed <= count for seed in range(1, 13)}  # noqa: E731
    findings = (Finding(change, held(near), 1200, 0.6, 0, held(far)) for change, near, far in TRIED)
    result = Report(15, 5, 45, 59, 10, 4, 12, tuple(findings), is_complete=True).as_dict()
    job = {"id": "told", "kind": "exploration", "name": "what-if", "state": "done", "done": 120, "total": 120}

    def answer(route: Route) -> None:
        if route.request.method == "POST":
            told["asked"].append(route.request.post_data_json)
        stale = told["stale"] or server.session(session)["branch"] != "b0"
        more = {"result": result, "error": None, "session": session, "branch": "b0", "stale": stale}
        route.fulfill(status=202, content_type="application/json", body=json.dumps({**job, **more}))

    page.route(re.compile(r"/explorations$|/jobs/told$"), answer)
    return told


def test_a_loss_calls_and_says_why_and_what_would_have_saved_it(watch: Watch, server: Server) -> None:
    """A card explains the first loss that lasts, with the best change of each kind; *Why* and *What if* say more.

    A change opens as a branch; then the findings stay, grey and marked. A loss that a person asked about stays when a
    later one lasts.
    """
    view = watch(**LOST, frames=60)
    page, told = view.page, tell(view.page, server, view.id)
    card = page.get_by_role("region", name="The loss")
    expect(card).to_be_hidden()
    server.seek(view.id, 8)
    expect(card.locator("summary")).to_contain_text("Lost in frame 7: ")
    server.seek(view.id, 59)
    why = server.get(f"sessions/{view.id}/explanation")["diagnosis"]
    expect(card.locator("summary")).to_have_text(why["sentence"])
    tracker, scene = (card.locator("li").nth(place) for place in range(2))
    expect(tracker).to_contain_text("Tracker Condensation 11 of 12 hold to frame 45, 10 of 12 to the end")
    expect(scene).to_contain_text("Occluder width 100 px to 50 px 12 of 12 hold to frame 45, 12 of 12 to the end")
    view.until(lambda: [each["frame"] for each in told["asked"]] == [7, why["frame"]], "both losses were asked about")

    card.get_by_role("button", name="Why", exact=True).press("Enter")
    expect(page.locator(".beside")).to_be_focused()
    the_place_of_the_plots_says_why(view, why)
    the_place_of_the_plots_lists_changes(page)
    # The page asks about the loss of each branch that it shows; the answer about the last one is the one that stays.
    with page.expect_response(re.compile(r"/explanation\?.*branch=b1"), timeout=60_000):
        page.locator(".what-if").get_by_role("button", name="Try it: Tracker Condensation").click()
    view.stands_at(45)
    assert server.session(view.id)["tracker"] == "condensation"
    with page.expect_response(re.compile(r"/explanation\?.*branch=b0"), timeout=60_000):
        page.get_by_role("button", name="Main").click()
    page.get_by_role("button", name="Back to the plots").press("Enter")
    expect(page.locator(".play")).to_be_focused()
    expect(page.locator(".plots")).to_be_visible()
    expect(card.locator("summary")).to_have_text(why["sentence"])
    press_by_key(scene.get_by_role("button", name="Try it: Occluder width 100 px to 50 px"))
    expect(page.locator(".branches .chip")).to_have_count(3)
    expect(page.locator(".play")).to_be_focused()
    expect(card.locator("summary")).to_have_text("Lost in frame 15 stale")
    card.locator("summary").click()
    expect(scene).to_contain_text("stale")
    page.keyboard.press("Shift+Tab")  # from the card, which lies above the switch of views
    assert not page.evaluate("document.activeElement.matches('.view-switch button')")
    page.get_by_role("button", name="Main").click()
    expect(scene).not_to_contain_text("stale")
    card.locator("summary").click()
    expect(scene).to_be_hidden()
    asked, told["stale"] = len(told["asked"]), True
    view.command("restart", seed=0)
    server.seek(view.id, 8)
    view.until(lambda: len(told["asked"]) > asked, "another run is asked about anew")
    expect(scene).to_be_hidden()
    view.press("w")
    expect(page.locator(".why-sentence")).to_contain_text("Lost in frame 7: ")
    view.go_to(59)
    page.wait_for_timeout(1_000)
    expect(page.locator(".why-sentence")).to_contain_text("Lost in frame 7: ")


def press_by_key(button: Locator) -> None:
    expect(button).to_be_enabled()
    button.press("Enter")


def the_place_of_the_plots_says_why(view: SessionPage, why: dict[str, Any]) -> None:
    """The server's words and numbers stand there, until one looks into the frame; a key asks again, a sign leads on."""
    page = view.page
    expect(page.locator(".why-sentence")).to_have_text(why["sentence"])
    expect(page.locator(".sign > p")).to_have_text([sign["words"] for sign in why["signs"]])
    expect(page.locator(".evidence canvas")).to_have_count(sum(len(sign["evidence"]) for sign in why["signs"]))
    expect(page.locator(".plots")).to_be_hidden()
    check(page)
    view.press("i")
    page.locator(".inspection-card").wait_for()
    expect(page.locator(".why-sentence")).to_be_hidden()
    view.press("w")
    expect(page.locator(".why-sentence")).to_be_visible()
    expect(page.locator(".inspection-card")).to_be_hidden()
    page.locator(".sign button").first.click()
    view.stands_at(why["signs"][0]["since"])


def the_place_of_the_plots_lists_changes(page: Page) -> None:
    """Three lines come first, no change and the best of each kind; all others are behind them."""
    page.get_by_role("group", name="About the loss").get_by_role("button", name="What if…").click()
    titles, lines = page.locator(".what-if-title"), page.locator(".what-if").get_by_role("listitem")
    expect(titles).to_have_text([TRIED[place][0].title for place in (0, 2, 3)])
    page.get_by_role("button", name="All 4").click()
    expect(titles).to_have_count(5)
    expect(lines.nth(2)).to_contain_text("better for a while, but not later")
    usable(page)


def test_an_answer_about_another_branch_is_not_shown(watch: Watch, server: Server) -> None:
    """A branch that holds is opened while the page waits for the answer about its own loss: the card stays, stale."""
    view = watch(**LOST, frames=60)
    page, _ = view.page, tell(view.page, server, view.id)
    summary = page.get_by_role("region", name="The loss").locator("summary")
    server.seek(view.id, 59)
    expect(summary).to_contain_text("Lost in frame 15, ")
    view.go_to(0)
    held: list[Route] = []
    page.route("**/explanation*", lambda route: held.append(route))  # noqa: PLW0108 - Playwright marks what it calls
    view.press("w")
    view.until(lambda: held, "the page has asked")
    assert f"branch={server.session(view.id)['branch']}" in held[0].request.url
    server.post(f"sessions/{view.id}/commands", {"kind": "branch", "frame": 0, "values": {PILLAR: 10}})
    expect(page.locator(".branches .chip")).to_have_count(2)
    with page.expect_response("**/explanation*") as answered:
        held[0].continue_()
    answered.value.finished()
    page.wait_for_timeout(300)  # nothing shows when the page has read it
    expect(summary).to_have_text("Lost in frame 15 stale")


def test_changes_are_tried_and_other_seeds_lie_behind_the_error(watch: Watch, server: Server) -> None:
    """The server's attempts fill the list, and end by a button or with the page; a band shows other seeds."""
    view = watch(**LOST, frames=45)
    page = view.page
    view.go_to(20)
    page.get_by_role("region", name="The loss").get_by_role("button", name="What if…").click()
    first = page.locator(".what-if").get_by_role("listitem").first
    expect(first).to_contain_text("Same settings, other seeds", timeout=240_000)
    page.get_by_role("button", name="Stop").click()
    expect(page.get_by_role("progressbar", name="Runs carried out")).to_be_hidden()
    page.get_by_role("button", name="Try again").click()
    page.get_by_role("progressbar", name="Runs carried out").wait_for()
    page.get_by_role("button", name="Back to the plots").click()
    page.locator(".controls").get_by_text("More", exact=True).click()
    page.get_by_role("button", name="Other seeds", exact=True).click()
    expect(page.locator(".explore-words")).to_have_text(re.compile(r"^\d+ of 40 hold in this frame$"), timeout=240_000)
    view.until(lambda: len((view.trace("error of other seeds") or {"low": []})["low"]) == 45, "the band is drawn")
    page.click("text=Before the loss")
    view.until(lambda: view.verdict == "held (by truth)", "the frame before the loss is shown")
    page.goto("about:blank")
    view.until(lambda: all(job["state"] != "working" for job in server.get("jobs")), "jobs of a closed page end")


FRAMES = 50
SCENE: dict[str, Value] = {"occlusion_width_px": 200, "period_s": 3, "amplitude_px": 120, "distracter_radius_px": 0}
BALL = find("ball")


def test_a_clip_is_explained_by_a_few_marks(watch: Watch, server: Server) -> None:
    """*Why?* asks for marks where nobody knows whether it is lost; then it says why, and *What if…* what saves it."""
    steps = list(Run(BALL, BALL.simulate(), frames=FRAMES, timeline=(Change(0, SCENE),)))
    film = encoded([step.frame.image_rgb for step in steps], crf="4")
    marks = {at: [float(value) - 5 for value in steps[at].frame.target.position] for at in (0, 20, FRAMES - 1)}
    shown = watch(tracker="h-spf", upload=server.upload("mine.mp4", film), box=[*marks[0], 11, 11], seed=0, frames=None)
    page = shown.page
    shown.go_to(FRAMES - 1)
    expect(page.locator(".verdict")).to_have_text("truth not known")
    expect(page.locator(".stop-at-loss label")).to_have_attribute(
        "title", re.compile(r"P\(lost\) is not calibrated on recordings")
    )
    page.locator(".why-ask").click()
    expect(page.locator(".why-sentence")).to_contain_text("P(lost) is not calibrated on recordings. Mark the target")
    table = "\n".join(["frame,x,y,w,h", *(f"{frame},{x},{y},11,11" for frame, (x, y) in marks.items())])
    url = f"{server.url}/api/v1/sessions/{shown.id}/truth"
    httpx.put(url, files={"file": ("truth.csv", table.encode())}, timeout=60).raise_for_status()
    expect(page.locator(".verdict")).to_have_text(re.compile(r"^lost since \d+ \(by truth\)$"))
    since = server.column(shown.id, "lost_since")[-1]
    page.keyboard.press("w")
    expect(page.locator(".why-sentence")).to_have_text(re.compile(rf"^Lost in frame {since}(, first in frame \d+)?: "))
    check(page)
    page.get_by_role("group", name="About the loss").get_by_role("button", name="What if…").click()
    lines = page.locator(".what-if").get_by_role("listitem")
    expect(lines.nth(1)).to_be_visible(timeout=240_000)
    lines.nth(1).get_by_role("button").click()
    expect(page.locator(".branches .chip")).to_have_count(2)
    fits(page)
