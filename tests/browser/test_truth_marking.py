"""Truth that a person marks in the pictures of a session."""

from typing import Any

import httpx
import pytest

from tests.browser.accessible import check
from tests.browser.host import Server
from tests.browser.test_upload import clip as clip  # noqa: PLC0414 - a fixture
from tests.browser.views import SessionPage

MARK = {"kind": "box", "x": 31, "y": 51, "width": 19, "height": 19}
WIDTH = 160


@pytest.fixture
def upload(server: Server, clip: bytes) -> str:
    answer = httpx.post(f"{server.url}/api/v1/uploads", files={"file": ("walk.mp4", clip)}, timeout=60)
    return str(answer.raise_for_status().json()["id"])


@pytest.fixture
def shown(page: Any, server: Server, upload: str) -> SessionPage:
    """The session on the disc that walks to the right, by 2 px in each frame, from (40, 60) on."""
    recipe = {"experiment": "ball", "footage": {"mark": MARK, "start": 0}}
    session = server.post("sessions", {"recipe": recipe, "upload": upload})
    page.goto(session["page"])
    return SessionPage(page, server).ready()


def waits_at(shown: SessionPage, frame: int) -> None:
    page = shown.page
    shown.until(lambda: f"frames/{frame}." in str(page.get_attribute(".truth-marking img", "src")), f"picture {frame}")
    shown.until(lambda: page.evaluate("document.querySelector('.truth-marking img').complete"), "it is there")


def click_disc(shown: SessionPage, frame: int) -> None:
    waits_at(shown, frame)
    area = shown.page.locator(".truth-marking .picture").bounding_box()
    scale = area["width"] / WIDTH
    shown.page.mouse.click(area["x"] + (40.5 + 2 * frame) * scale, area["y"] + 60.5 * scale)


def table(shown: SessionPage, upload: str) -> list[str]:
    where = f"api/v1/uploads/{upload}/truth.csv?experiment=ball"
    return shown.page.request.get(where).text().split()


def test_truth_is_clicked_frame_by_frame_and_measures_the_run(shown: SessionPage, server: Server, upload: str) -> None:
    """A click marks and goes on, keys do the same, one is taken back; frames between stay without truth."""
    page = shown.page
    shown.menu("files")
    page.click("[data-role=mark-truth]")
    page.locator(".truth-marking").wait_for()
    waits_at(shown, 0)
    check(page)
    page.fill("#truth-every", "4")
    click_disc(shown, 0)
    click_disc(shown, 4)
    waits_at(shown, 8)
    page.get_by_text("2 frames marked").wait_for()
    for _ in range(8):
        page.keyboard.press("ArrowRight")
    page.keyboard.press("Shift+ArrowDown")
    page.keyboard.press("Shift+ArrowUp")
    page.keyboard.press("Enter")
    waits_at(shown, 12)
    page.keyboard.press("Enter")  # where it was before
    waits_at(shown, 16)
    page.keyboard.press("Backspace")
    waits_at(shown, 12)
    page.get_by_text("Picture 12 is not marked. 3 frames marked").wait_for()
    page.keyboard.press("Delete")  # hidden there
    waits_at(shown, 16)
    page.click(".truth-row >> text=Done")
    page.locator(".truth-marking").wait_for(state="detached")
    assert table(shown, upload) == ["frame,x,y,w,h", "0,31,51,19,19", "4,39,51,19,19", "8,47,51,19,19"]
    shown.until(lambda: (server.column(shown.id, "error")[8] or 99) < 5, "the run is measured by it")
    assert [frame for frame, error in enumerate(server.column(shown.id, "error")) if error is not None] == [0, 4, 8]
    shown.menu("files")
    page.locator("[data-role=known-truth]").wait_for()


def test_marks_that_are_known_can_be_corrected_or_left_alone(shown: SessionPage, upload: str) -> None:
    """Marking begins with what a file has given; leaving asks before marks are lost."""
    page = shown.page
    rows = "frame,x,y,w,h\n0,31,51,19,19\n1,90,90,19,19\n"
    shown.menu("files")
    page.set_input_files("[data-file=truth]", {"name": "t.csv", "mimeType": "text/csv", "buffer": rows.encode()})
    page.locator(".toast:has-text('2 frames is known')").wait_for()
    shown.until(lambda: page.locator(".play").is_enabled(), "it goes on")
    page.keyboard.press("Escape")
    page.keyboard.press("t")
    page.locator(".truth-marking[data-state=kept]").wait_for()
    page.fill("#truth-every", "1")
    page.locator("button:has-text('Save and continue')").click()
    click_disc(shown, 1)
    waits_at(shown, 2)
    page.keyboard.press("Escape")
    page.locator("dialog >> text=Keep").click()
    assert page.locator(".truth-marking").count() == 1
    page.keyboard.press("Escape")
    page.locator("dialog >> text=Leave").last.click()
    page.locator(".truth-marking").wait_for(state="detached")
    assert table(shown, upload)[2] == "1,90,90,19,19"


def test_what_is_moved_by_keys_stays_where_it_was_moved(shown: SessionPage, upload: str) -> None:
    """A move counts without Enter, also by keys that come before the next picture, and is taken back as one."""
    page = shown.page
    page.keyboard.press("t")
    page.locator(".truth-marking").wait_for()
    page.fill("#truth-every", "2")
    page.locator(".truth-marking .mark-surface").focus()
    waits_at(shown, 0)
    for key in ("Enter", *["ArrowRight"] * 4, "Enter", *["Shift+ArrowDown"] * 2):
        page.keyboard.press(key)
    page.click(".truth-row >> text=Back")
    waits_at(shown, 2)
    page.get_by_text("Picture 2 is marked. 3 frames marked").wait_for()
    page.click(".truth-row >> text=Undo")
    page.get_by_text("Picture 4 is not marked. 2 frames marked").wait_for()
    page.click(".truth-row >> text=Done")
    page.locator(".truth-marking").wait_for(state="detached")
    assert table(shown, upload) == ["frame,x,y,w,h", "0,31,51,19,19", "2,35,51,19,19"]


def test_a_simulated_scene_knows_its_own_truth(watch: Any) -> None:
    """There is nothing to mark, by no key."""
    shown = watch()
    page = shown.page
    with page.expect_response("**/session/marking.js"):
        page.keyboard.press("t")
    page.keyboard.press("ArrowRight")
    shown.stands_at(1)
    assert page.locator(".truth-marking").count() == 0
    assert page.locator("[data-role=mark-truth]").count() == 0
