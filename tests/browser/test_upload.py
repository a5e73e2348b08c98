"""One's own recording: from the drop zone or the camera over the mark of its target and its verdict to a session."""

from typing import Any

import numpy as np
import pytest

from tests.browser.accessible import check, usable
from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage
from tests.experiments.head.heads import film, marked, pictures
from tests.making import disc_film

FRAMES = 30

BEGIN, END, WIDTH = 44, 48, 320
"""The simulated driver looks ahead in these frames."""

# Where the page shows each feature, in px of the picture.
SHOWN = """Object.fromEntries([...document.querySelectorAll('.point:not([hidden])')].map((point) => {
    const image = document.querySelector('[data-mark=points] img');
    const place = (share, side) => (parseFloat(share) / 100) * side - 0.5;
    const { left, top } = point.style;
    const name = point.dataset.handle.replace('points.', '');
    return [name, [place(left, image.naturalWidth), place(top, image.naturalHeight)]];
}))"""

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


@pytest.fixture(autouse=True)
def _refusals_are_told_on_the_console(complaints: Any) -> None:
    """Chromium lists every answer with an error status."""
    complaints.expected = ("the server responded with a status of 4",)


@pytest.fixture(scope="module")
def clip() -> bytes:
    """A red disc that walks to the right over grey, 160 x 120 px."""
    return disc_film(FRAMES)


def test_a_clip_becomes_a_session_that_tracks(gallery: Gallery, server: Server, clip: bytes) -> None:
    """Choose file and start, draw the box by mouse, correct it by keyboard, go.

    A file that is not a video is refused with a reason and a way on.
    """
    page = gallery.page
    gallery.choose("notes.mp4", b"these are words, not pictures\n" * 40, "video/mp4")
    page.locator(".wrong").wait_for()
    assert "notes.mp4 was not accepted" in page.inner_text(".drop")
    assert len(page.inner_text(".wrong")) > 20
    page.click("text=Choose another file")
    gallery.choose("walk.mp4", clip, "video/mp4")
    surface = page.locator(".mark-surface")
    surface.wait_for()
    assert "walk.mp4" in page.inner_text(".target header")
    go = page.locator("button:has-text('Track it')")
    assert go.is_disabled()
    usable(page)

    page.reload()
    surface.wait_for()
    page.locator("#target-start").fill("5")
    gallery.until(lambda: "/frames/5." in (page.get_attribute(".mark-surface img", "src") or ""), "frame 5 is shown")
    gallery.has_picture()
    words = lambda: " ".join(page.inner_text(".target-choices").split())  # noqa: E731 - one line of reading
    gallery.until(lambda: "picture 5 of 30, frame 0 of the session" in words(), "both numbers are shown")
    draw(gallery, 40, 50, 18, 20)
    gallery.until(lambda: page.inner_text(".picture-words").startswith("18 × 20 px"), "the box is as drawn")
    for key in ("ArrowRight", "d", "D", "A", *(f"Shift+Arrow{way}" for way in ("Right", "Left", "Up", "Down"))):
        page.keyboard.press(key)
    gallery.until(lambda: page.inner_text(".picture-words") == "19 × 20 px at 41, 50", "the keys moved and resized it")
    page.select_option("#target-tracker", "h-spf")
    go.click()

    shown = SessionPage(page, server).ready()
    mark = {"kind": "box", "x": 41, "y": 50, "width": 19, "height": 20}
    footage = shown.session["recipe"]["footage"]
    assert (footage["mark"], footage["start"]) == (mark, 5)
    shown.press("ArrowRight")
    shown.stands_at(1)
    assert page.inner_text(".counter").endswith("picture 6 of the clip")


class Form(Gallery):
    """The form in which the target of an upload is shown."""

    def settled(self) -> dict[str, list[float]]:
        """Wait for the points and return them."""
        self.until(lambda: self.points, "the points are shown")
        self.has_picture("[data-mark=points]")
        return self.points

    @property
    def points(self) -> dict[str, list[float]]:
        return self.page.evaluate(SHOWN)

    def drag(self, name: str, right: float, down: float) -> None:
        """Drag a point by so many px of the picture."""
        x, y = self.middle(name)
        picture = self.page.locator("[data-mark=points] .mark-surface").bounding_box()
        scale = picture["width"] / self.page.evaluate("document.querySelector('[data-mark=points] img').naturalWidth")
        mouse = self.page.mouse
        mouse.move(x, y)
        mouse.down()
        mouse.move(x + right * scale, y + down * scale, steps=4)
        self.page.locator(".loupe").wait_for()
        mouse.up()
        self.page.locator(".loupe").wait_for(state="hidden")

    def middle(self, name: str) -> tuple[float, float]:
        """Return where the middle of a point is in the window, px."""
        handle = self.page.locator(f".point[data-handle='points.{name}']")
        handle.scroll_into_view_if_needed()
        area = handle.bounding_box()
        return area["x"] + area["width"] / 2, area["y"] + area["height"] / 2

    def drag_by_touch(self, name: str, right: float, down: float) -> None:
        """Drag a point by so many px of the page with a finger."""
        x, y = self.middle(name)
        fingers = self.page.context.new_cdp_session(self.page)
        for kind, share in (("touchStart", 0.0), ("touchMove", 0.5), ("touchMove", 1.0), ("touchEnd", None)):
            at = [] if share is None else [{"x": x + share * right, "y": y + share * down}]
            fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": at})
        fingers.detach()


def near(found: dict[str, list[float]], known: dict[str, Any], within: float) -> bool:
    return all(np.hypot(*np.subtract(found[name], place)) < within for name, place in known.items())


def test_points_are_found_and_corrected(gallery: Gallery, server: Server) -> None:
    """The points lie on the face, some are moved by mouse, finger and keys, and the session begins with them."""
    gallery.choose("face.mp4", film(pictures(END, width=WIDTH)[BEGIN:]), "video/mp4")
    form = Form(gallery.page)
    page = form.page
    page.select_option("#target-experiment", "head")
    found = form.settled()
    assert len(found) == 11
    assert near(found, marked(BEGIN, width=WIDTH), 6)

    form.drag("lmou", 5, -3)
    assert near(form.points, {"lmou": np.add(found["lmou"], (5, -3))}, 0.3)
    form.drag("rlc", -900, -900)
    assert near(form.points, {"rlc": (0, 0)}, 0.2)
    page.click("text=Find again")
    form.until(lambda: form.points == found, "all points are where they were found")
    form.resize(400, 500)
    page.locator("[data-mark=points] .mark-surface").scroll_into_view_if_needed()
    shown_scale = page.locator("[data-mark=points] img").bounding_box()["width"] / WIDTH
    top = page.evaluate("scrollY")
    form.drag_by_touch("lmou", 12, 16)
    dragged = {"lmou": np.add(found["lmou"], (12 / shown_scale, 16 / shown_scale))}
    form.until(lambda: near(form.points, dragged, 0.5), "it was dragged by touch")
    assert page.evaluate("scrollY") == top
    form.resize(1280)
    page.click("text=Find again")
    form.until(lambda: form.points == found, "all points are there again")

    page.locator(".point[data-handle='points.nose']").focus()
    for key in ("ArrowRight", "ArrowDown", "Shift+ArrowDown", "Shift+ArrowUp"):
        page.keyboard.press(key)
    assert near(form.points, {"nose": np.add(found["nose"], 1)}, 0.15)
    form.until(lambda: page.inner_text(".picture-words").startswith("tip of the nose at "), "its place is shown")
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.dataset.handle") == "points.leye"
    marks = form.points
    page.click("text=Track it")
    shown = SessionPage(page, server).ready()
    page.locator(".counter", has_text="picture 0 of the clip").wait_for()
    shown.until(lambda: "yaw" in page.inner_text(".flat-caption"), "the caption has the pose")
    assert near(shown.session["recipe"]["footage"]["mark"]["points"], marks, 0.01)


def test_a_face_is_proposed_unless_a_person_has_chosen(gallery: Gallery) -> None:
    """A face that is found changes the proposal only while nobody has begun to choose."""
    page, held, free = gallery.page, list[Any](), list[bool]()
    page.route("**/mark?*", lambda route: route.continue_() if free else held.append(route))
    gallery.choose("face.mp4", film(pictures(4, width=WIDTH)), "video/mp4")
    form = Form(page)
    choice = page.locator("#target-experiment")
    form.until(lambda: held, "the page searches for a face")
    assert choice.input_value() == "ball"
    page.locator("#target-start").fill("2")
    with page.expect_response("**/mark?*"):
        held.pop().continue_()
    page.wait_for_timeout(200)
    assert choice.input_value() == "ball"
    page.reload()
    form.until(lambda: held, "the page searches again")
    free.append(True)
    held.pop().continue_()
    form.until(lambda: choice.input_value() == "head", "the head is proposed")
    page.locator(".target-choices", has_text="There is a face in the picture.").wait_for()
    form.settled()


def test_a_search_that_lasts_can_be_stopped(gallery: Gallery) -> None:
    """The page says how far the search is; after *Stop* it takes no more of it, and a box may be drawn instead."""
    held: list[Any] = []
    half = {"frame": 3, "mark": None, "placed": [], "remarks": [], "looked": 4, "of": 8}
    gallery.page.route(
        "**/mark?*",
        lambda route: held.append(route) if "looked=4" in route.request.url else route.fulfill(json=half),
    )
    gallery.choose("face.mp4", film(pictures(8, width=WIDTH)), "video/mp4")
    form = Form(gallery.page)
    form.page.select_option("#target-experiment", "head")
    form.page.locator("text=Looking for a face, 4 of 8 frames").wait_for()
    form.page.click("text=Stop")
    form.page.locator("text=The search was stopped").wait_for()
    form.until(lambda: held, "it had asked to go on")
    held[0].continue_()
    form.page.wait_for_timeout(300)
    assert form.points == {}
    assert form.page.locator("text=Draw a box around the face…").is_visible()


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
    assert "everybody who may use the server can see" in page.inner_text("dialog")
    assert page.evaluate(LIGHTS) == []
    page.keyboard.press("Enter")  # each state has its next step under the finger
    allowed.until(lambda: "what will be recorded" in words(page), "the camera is on")
    allowed.until(lambda: page.evaluate("document.querySelector('dialog video').videoWidth") > 0, "it shows something")
    allowed.resize(1280, 720)
    usable(page)
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
    assert (found["name"][:7], found["width"], found["height"]) == ("camera ", 640, 480)


def test_leaving_turns_the_camera_off(allowed: Gallery) -> None:
    """Escape does so in the preview, in the countdown and while recording; no other page may use a camera at all."""
    page = allowed.page
    policies = [page.request.get(path).headers["permissions-policy"] for path in ("./", "learn")]
    assert policies == ["camera=(self), microphone=(), geolocation=()", "camera=(), microphone=(), geolocation=()"]
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


def draw(gallery: Gallery, x: float, y: float, width: float, height: float) -> None:
    """Draw a box on the picture of 160 px by mouse."""
    area = gallery.page.locator(".mark-surface").bounding_box()
    scale = area["width"] / 160
    gallery.drag(*((area["x"] + u * scale, area["y"] + v * scale) for u, v in ((x, y), (x + width, y + height))))


def grade(page: Any) -> str:
    return str(page.get_attribute(".suits-words", "data-grade"))


def test_a_box_is_judged_as_soon_as_it_is_drawn(gallery: Gallery, clip: bytes) -> None:
    """The disc separates well, with a map of the likelihood; the ground not at all, and what would help is said.

    A box with the disc in its corner, and ground for the most part, is replaced by the one that is proposed.
    """
    page = gallery.page
    gallery.choose(f"w{'a' * 90}lk.mp4", clip, "video/mp4")  # a name as phones give, without a place to break it
    page.locator(".mark-surface").wait_for()
    page.locator(".suits-words", has_text="Mark the target to see").wait_for()
    assert page.locator(".suits-picture").is_hidden()
    gallery.has_picture()

    draw(gallery, 31, 51, 19, 19)
    gallery.until(lambda: grade(page) == "well", "the disc separates well")
    assert page.inner_text(".suits-remark").startswith("Separates well: ")
    wide = "document.querySelector('.suits-picture').naturalWidth"
    gallery.until(lambda: page.evaluate(wide) == 160, "its map is there")

    draw(gallery, 29, 49, 44, 44)
    better = page.locator("[data-role=better]")
    better.wait_for()
    better.click()
    gallery.until(lambda: page.inner_text(".picture-words").startswith("22 × 22 px"), "the smaller box is drawn")
    gallery.until(lambda: grade(page) in {"well", "no verdict"}, "it separates better")
    gallery.resize(390)
    gallery.until(lambda: page.evaluate("document.documentElement.scrollWidth") <= 390, "nothing sticks out")
    shown = page.locator(".suits-picture").bounding_box()
    assert shown["width"] / shown["height"] == pytest.approx(160 / 120, rel=0.02)

    draw(gallery, 100, 20, 30, 30)
    gallery.until(lambda: grade(page) == "not at all", "the ground does not")
    assert "separates not at all" in page.inner_text(".suits-remark").lower()
    assert "No smaller box separates better" in page.inner_text(".suits-words")
    assert page.locator("button:has-text('Track it')").is_enabled()
