"""From a session on an upload to a sweep on it: other seeds, parameters and methods of one's own clip."""

from collections.abc import Callable
from typing import Any

import httpx

from tests.browser.host import Server
from tests.browser.test_sweep import SweepPage
from tests.browser.views import SessionPage, View
from tests.server.uploads.test_uploads import video


def test_a_session_on_a_clip_becomes_a_sweep(watch: Callable[..., SessionPage], server: Server, page: Any) -> None:
    """The form knows the clip and the parameters of recordings; the maps show what the methods say of themselves."""
    sent = httpx.post(f"{server.url}/api/v1/uploads", files=[("file", ("ball.mp4", video(16)))], timeout=60)
    shown = watch(experiment="histogram", upload=sent.json()["id"], box=[10, 20, 10, 10], frames=None)
    what_is_brought_in_is_in_sight(shown)
    link = shown.page.locator("header >> [aria-label=Sweep]")
    link.wait_for()
    page.goto(link.get_attribute("href"))
    form = View(page)
    page.wait_for_selector(".plan-size")
    assert "All runs are on ball.mp4" in page.inner_text(".plan-form")
    assert page.inner_text("[data-field=experiment]") == "Colours of a window"
    form.until(lambda: page.inner_text(".plan-size .figure >> nth=0") == "20 runs", "other seeds are planned")
    page.click("[data-role=add-axis]")
    choice = page.locator(".axis select").first
    names = choice.locator("option").evaluate_all("(all) => all.map((one) => one.value)")
    assert "sample_count" in names
    assert "sway_px" not in names
    choice.select_option("sample_count")
    for part, number in (("start", "30"), ("stop", "60"), ("step", "30")):
        page.locator(f".axis [data-field='axes.0.{part}']").fill(number)
    page.locator("[data-field=trials] input").fill("2")
    page.locator(".methods input[value=apf]").check()
    form.until(lambda: page.inner_text(".plan-size .figure >> nth=0") == "8 runs", "the axis is understood")
    page.click("text=Start the sweep")
    page.wait_for_url("**/sweep/*")
    sweep = SweepPage(page)
    sweep.complete()
    assert page.locator("[aria-pressed=true], [aria-checked=true], input:checked + *").first.inner_text() == "Measure"
    told = server.get(f"sweeps/{sweep.id}")
    assert (told["recording"], told["problems"], told["done"]) == ("ball.mp4", 0, 8)
    assert page.locator("text=Change and repeat").count() == 0


def what_is_brought_in_is_in_sight(shown: SessionPage) -> None:
    """On a low screen, too, nothing of the menu of files has to be scrolled to."""
    shown.page.set_viewport_size({"width": 1280, "height": 720})
    shown.page.get_by_role("button", name="Files").click()
    menu = shown.page.locator(".menu:popover-open")
    menu.get_by_text("Truth, CSV").wait_for()
    assert menu.evaluate("(it) => it.scrollHeight <= it.clientHeight")
    shown.press("Escape")
