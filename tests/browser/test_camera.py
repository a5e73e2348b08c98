"""A clip from the camera: recorded in the page, and from then on a file like any other."""

from typing import Any

import pytest

from tests.browser.accessible import check, fits
from tests.browser.host import Server
from tests.browser.views import Gallery

TAKEN = """
window.cameras = [];
const take = navigator.mediaDevices.getUserMedia.bind(navigator.mediaDevices);
navigator.mediaDevices.getUserMedia = async (wish) => {
    const stream = await take(wish);
    window.cameras.push(...stream.getTracks());
    return stream;
};
"""
"""Keeps what a page has taken of cameras, so that a test can ask whether their lights are on."""
FAILS = "navigator.mediaDevices.getUserMedia = async () => {{ throw new DOMException('', '{}') }}; null"
LIGHTS = "cameras.map(({ readyState }) => readyState)"


@pytest.fixture
def allowed(page: Any) -> Gallery:
    """The start page, of somebody who lets it use the camera."""
    page.add_init_script(TAKEN)
    page.goto("./")
    return Gallery(page)


def press(page: Any, name: str) -> None:
    page.locator("dialog").get_by_role("button", name=name, exact=True).click()


def words(page: Any) -> str:
    return str(page.locator("dialog [role=status]").inner_text())


def test_a_recorded_clip_becomes_an_upload(allowed: Gallery, server: Server) -> None:
    """Turned on by a button, counted down, stopped early, played, kept; all keys alone. Then the light is off."""
    page = allowed.page
    sent: list[str] = []
    page.on("request", lambda request: request.method == "POST" and sent.append(request.url))
    page.locator("[data-role=camera]").press("Enter")
    assert "whoever may use the server can see" in page.inner_text("dialog")
    assert page.evaluate(LIGHTS) == []
    page.keyboard.press("Enter")  # each state has its next step under the finger
    allowed.until(lambda: "what will be recorded" in words(page), "the camera is on")
    allowed.until(lambda: page.evaluate("document.querySelector('dialog video').videoWidth") > 0, "it shows something")
    page.set_viewport_size({"width": 1280, "height": 720})
    fits(page)
    check(page)
    page.press("#camera-length", "ArrowRight")
    page.get_by_role("button", name="Record", exact=True).press("Enter")
    page.locator(".camera-count").wait_for()
    elapsed = page.locator(".camera-elapsed")
    elapsed.wait_for()
    assert elapsed.inner_text().endswith("of 11 s")
    allowed.until(lambda: float(elapsed.inner_text().split()[0]) > 1, "a second is recorded")
    page.keyboard.press("Enter")
    allowed.until(lambda: "The camera is off" in words(page), "the clip is shown")
    assert page.evaluate(LIGHTS) == ["ended"]
    allowed.until(lambda: page.evaluate("document.querySelector('dialog video').currentTime") > 0, "the clip plays")
    assert sent == []
    page.keyboard.press("Enter")
    page.locator(".target header").wait_for()
    found = server.get("uploads/" + page.url.rsplit("/", 1)[1])
    assert found["name"].startswith("camera ")
    assert (found["width"], found["height"]) == (640, 480)
    assert found["frames"] > 1
    assert 0.5 < found["duration_s"] < 11
    picture = page.request.get(f"api/v1/uploads/{found['id']}/frames/{found['frames'] - 1}.jpg")
    assert picture.ok


def test_leaving_turns_the_camera_off(allowed: Gallery) -> None:
    """Whether it shows, counts or records."""
    page = allowed.page
    for stage in (".camera-stage", ".camera-count", ".camera-elapsed"):
        page.click("[data-role=camera]")
        press(page, "Turn on the camera")
        if stage != ".camera-stage":
            press(page, "Record")
        page.locator(stage).wait_for()
        page.keyboard.press("Escape")
        page.locator("dialog").wait_for(state="detached")
        assert set(page.evaluate(LIGHTS)) == {"ended"}
    assert len(page.evaluate(LIGHTS)) == 3


def test_a_refused_camera_is_told_with_a_way_on(page: Any) -> None:
    """Refused by the person, missing, or kept back by the browser where the page came over plain http."""
    page.goto("./")
    page.click("[data-role=camera]")
    page.evaluate(FAILS.format("NotAllowedError"))
    press(page, "Turn on the camera")
    page.locator("dialog :text('does not let this page use the camera')").wait_for()
    page.evaluate(FAILS.format("NotFoundError"))
    press(page, "Try again")
    page.locator("dialog :text('No camera was found')").wait_for()
    check(page)
    page.keyboard.press("Escape")
    page.evaluate("Object.defineProperty(window, 'isSecureContext', { value: false })")
    page.click("[data-role=camera]")
    assert "only to pages that come over https" in words(page)
    assert page.locator("dialog footer button").all_inner_texts() == ["Close"]


def test_no_other_page_may_use_the_camera(page: Any) -> None:
    """Leave is given for the page with the button alone."""
    paths = ("./", "work", "learn", "compare")
    policies = {path: page.request.get(path).headers["permissions-policy"] for path in paths}
    assert policies.pop("./") == "camera=(self), microphone=(), geolocation=()"
    assert set(policies.values()) == {"camera=(), microphone=(), geolocation=()"}
