"""Why a target was lost, in a session's page."""

from collections.abc import Callable

from tests.browser.accessible import check, fits
from tests.browser.host import Server
from tests.browser.views import SessionPage

LOST = {"parameters": {"occlusion_width_px": 100}, "frames": 60, "seed": 0}


def test_a_lost_session_says_why_and_leads_to_where_it_began(watch: Callable[..., SessionPage], server: Server) -> None:
    """A button and a key ask; the page says what the server does, shows the numbers, and goes to the frame."""
    view = watch(**LOST)
    page = view.page
    assert page.locator(".why-ask").is_hidden(), "nothing is lost yet"
    server.post(f"sessions/{view.id}/commands", {"kind": "seek", "frame": 59})
    page.locator(".why-ask").click()
    told = server.get(f"sessions/{view.id}/explanation")["diagnosis"]
    view.until(lambda: page.locator(".why-sentence").count() == 1, "the page says why")
    assert page.inner_text(".why-sentence") == told["sentence"]
    assert [page.locator(".sign").nth(place).locator("p").inner_text() for place in range(2)] == [
        sign["words"] for sign in told["signs"]
    ]
    assert page.locator(".evidence canvas").count() == sum(len(sign["evidence"]) for sign in told["signs"])
    assert page.locator(".plots").is_hidden()
    check(page)
    view.press("i")
    page.locator(".inspection-card").wait_for()
    assert page.locator(".why-sentence").is_hidden(), "one card at a time takes the place of the plots"
    view.press("w")
    page.locator(".why-sentence").wait_for()
    assert page.locator(".inspection-card").is_hidden()
    page.locator(".sign button").first.click()
    view.until(lambda: view.position == told["signs"][0]["since"], "the run stands where it began")
    page.get_by_role("button", name="Back to the plots").click()
    assert page.locator(".plots").is_visible()
    page.keyboard.press("w")
    view.until(lambda: page.locator(".why-sentence").count() == 1, "the key asks as well")
    fits(page)
