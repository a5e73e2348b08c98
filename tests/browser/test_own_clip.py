"""A clip that somebody brings: a few marks tell why its target was lost, and what would have saved it."""

import re

import httpx
import pytest
from playwright.sync_api import expect

from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.runs.run import Run
from tests.browser.accessible import check, fits
from tests.browser.host import Server
from tests.browser.views import SessionPage
from tests.making import encoded

expect.set_options(timeout=60_000)
FRAMES = 50
SCENE: dict[str, Value] = {"occlusion_width_px": 200, "period_s": 3, "amplitude_px": 120, "distracter_radius_px": 0}
BALL = find("ball")


@pytest.fixture(scope="module")
def film() -> tuple[bytes, dict[int, tuple[float, float]]]:
    """A ball that disappears behind a wide pillar, as a video, and the corner of its box in some of the pictures."""
    steps = list(Run(BALL, BALL.simulate(), frames=FRAMES, timeline=(Change(0, SCENE),)))
    film = encoded([step.frame.image_rgb for step in steps], crf="4")
    corners = [[float(value) - 5 for value in step.frame.target.position] for step in steps]
    return film, {frame: (corners[frame][0], corners[frame][1]) for frame in (0, 20, FRAMES - 1)}


def test_a_clip_is_explained_by_a_few_marks(
    page: object, server: Server, film: tuple[bytes, dict[int, tuple[float, float]]]
) -> None:
    """*Why?* asks for marks where nobody says whether it is lost; then it says why, and *What if…* what saves it."""
    content, marks = film
    x, y = marks[0]
    mark = {"kind": "box", "x": x, "y": y, "width": 11.0, "height": 11.0}
    answer = httpx.post(f"{server.url}/api/v1/uploads", files={"file": ("mine.mp4", content)}, timeout=60)
    recipe = {"experiment": "ball", "tracker": "h-spf", "footage": {"mark": mark, "start": 0}}
    session = server.post("sessions", {"recipe": recipe, "upload": answer.raise_for_status().json()["id"]})
    page.goto(session["page"])
    shown = SessionPage(page, server).ready()
    server.seek(shown.id, FRAMES - 1)
    shown.stands_at(FRAMES - 1)
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
    expect(lines.nth(1)).to_be_visible(timeout=60_000)
    lines.nth(1).get_by_role("button").click()
    expect(page.locator(".branches .chip")).to_have_count(2)
    fits(page)
    page.keyboard.press("i")
    expect(page.get_by_role("heading", name="Inspect the frame")).to_be_in_viewport()
