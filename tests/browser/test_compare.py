"""A comparison in a browser: from a session to runs in step, by a link to the same elsewhere, and refused in words."""

import base64
import json
from typing import Any

import pytest

from tests.browser.accessible import usable
from tests.browser.conftest import Complaints, Watch
from tests.browser.host import Server
from tests.browser.views import LINES, PAINTED_FRAMES, TRACE, View

# Colours among the pixels of the topmost canvas, which has none where nothing is believed.
TOPMOST = """(() => {
    const canvas = [...document.querySelectorAll('.flat-canvas')].at(-1);
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    let [clear, green] = [0, 0];
    for (let i = 0; i < data.length; i += 4) {
        if (data[i + 3] === 0) clear += 1;
        else if (data[i] < 30 && Math.abs(data[i + 1] - 158) < 20) green += 1;
    }
    return { clear: clear / (data.length / 4), green };
})()"""


class ComparePage(View):
    """The page of a comparison."""

    def ready(self, runs: int) -> None:
        """Wait until all runs are painted, and what came of them is known."""
        self.until(lambda: len(self.frames) == runs, "all runs are painted")
        self.until(lambda: self.button("First difference").is_enabled(), "the first difference is known")
        self.until(lambda: self.page.locator(".play").is_enabled(), "the play button can be pressed")

    @property
    def frames(self) -> list[int]:
        return self.page.evaluate(PAINTED_FRAMES)

    def button(self, name: str) -> Any:
        return self.page.get_by_role("button", name=name)

    @property
    def first_difference(self) -> int:
        return int(self.button("First difference").inner_text().split()[-1])

    def row(self, title: str) -> list[str]:
        """The cells of a line of the table."""
        line = self.page.locator(".comparison-table tr", has=self.page.locator("th", has_text=title))
        return [str(text).split("\n")[0] for text in line.first.locator("td").all_inner_texts()]

    def stand_at(self, *frames: int) -> None:
        self.until(lambda: self.frames == list(frames), f"the runs show the frames {frames}")


def link(*runs: dict[str, Any], **more: Any) -> str:
    content = json.dumps({"runs": [{"recipe": run} for run in runs], **more}).encode()
    return "compare#" + base64.urlsafe_b64encode(content).decode().rstrip("=")


def ball(tracker: str = "h-spf", **more: Any) -> dict[str, Any]:
    return {"experiment": "ball", "tracker": tracker, "seed": 7, "frames": 60, **more}


@pytest.fixture
def shown(page: Any) -> ComparePage:
    return ComparePage(page)


def test_a_branch_is_compared_with_its_run(watch: Watch, shown: ComparePage, server: Server) -> None:
    """Key C shows both in step, with what differs; D the frame in which they part; the link needs neither session."""
    session = watch(tracker="h-spf", seed=7, frames=60, position=20)
    session.branch("condensation")
    own = session.id
    page = shown.page
    page.keyboard.press("c")
    page.locator("dialog").get_by_role("button", name="Compare").click()
    page.wait_for_url("**/compare#*")
    shown.ready(2)
    shown.stand_at(20, 20)
    before = "Hard switching (h-SPF)"
    assert shown.row("Tracker") == [f"{before}, Condensation from frame 21 on", before]
    assert shown.first_difference == 21
    page.keyboard.press("ArrowLeft")
    shown.stand_at(19, 19)
    page.keyboard.press("d")
    shown.stand_at(21, 21)
    both = {"error 0": 22, "error 1": 22}.items()
    shown.until(lambda: both <= page.evaluate(LINES).items(), "both are in one plot")
    assert {page.evaluate(TRACE, f"error {run}")["ink"] for run in (0, 1)} == {"#0072b2", "#009e73"}

    shown.button("Over each other").click()
    shown.until(lambda: page.evaluate(TOPMOST)["green"] > 20, "the second run is drawn in its colour")
    assert page.evaluate(TOPMOST)["clear"] > 0.5, "it has no picture of its own then"
    shown.button("Side by side").click()
    shown.until(lambda: page.evaluate(TOPMOST)["clear"] == 0, "it has its picture again")
    usable(page)

    address = page.url
    page.goto("about:blank")
    shown.until(lambda: [it["id"] for it in server.get("sessions")] == [own], "the page's own sessions have ended")
    server.end_sessions()
    page.goto(address)
    shown.ready(2)
    assert shown.first_difference == 21
    assert shown.row("Tracker") == [f"{before}, Condensation from frame 21 on", before]


def test_a_comparison_of_saved_runs_is_saved_and_opened_again(shown: ComparePage, server: Server) -> None:
    """Two boxes of My work lead to it; it is saved as it is seen, renamed, exported, found again, and deleted."""
    page = shown.page
    runs = [server.start_session(tracker=tracker, seed=7, frames=30, position=29) for tracker in ("h-spf", "apf")]
    saved = [server.post("runs", {"session": run["id"]}) for run in runs]
    page.goto("work?show=runs")
    for run in saved:
        page.locator(f"[data-run='{run['id']}'] input").click()
    page.get_by_role("link", name="Compare 2 runs").click()
    page.wait_for_url("**/compare*")
    shown.ready(2)
    assert shown.row("Tracker") == ["Hard switching (h-SPF)", "Auxiliary (APF)"]
    shown.page.locator(".comparison-table .over", has_text="Over all ").wait_for()
    shown.button("Over each other").click()
    page.locator("[data-tool=save]").click()
    page.get_by_role("button", name="Save", exact=True).last.click()
    page.locator(".toast:has-text('My work lists it')").wait_for()
    page.click("[aria-label='Rename this comparison']")
    page.fill("#new-name", "Why one is lost")
    page.keyboard.press("Enter")
    shown.until(lambda: page.inner_text("h1") == "Compare · Why one is lost", "the page has its name")

    page.locator("[data-tool=files]").click()
    with page.expect_download() as download:
        page.locator("[data-export=csv]").click()
    assert download.value.suggested_filename == "compare-why-one-is-lost.csv"

    page.goto("work?show=comparisons")
    row = page.locator("[data-comparison]")
    assert "ball, 2 runs" in row.inner_text()
    row.get_by_role("link", name="Open").click()
    shown.ready(2)
    assert page.inner_text("h1") == "Compare · Why one is lost"
    assert shown.button("Over each other").get_attribute("aria-pressed") == "true"
    page.goto("work?show=comparisons")
    row.get_by_role("button", name="Delete").click()
    page.locator("dialog").get_by_role("button", name="Delete it").click()
    row.wait_for(state="detached")


def test_what_cannot_be_compared_is_said(shown: ComparePage, complaints: Complaints) -> None:
    """Nothing, a damaged link and a run that was deleted: a sentence each, and a way on."""
    complaints.expected = ("status of 404",)
    page = shown.page
    for address, said in (
        ("compare", "Compare a session with its branches"),
        ("compare#eyJydW5zI", "The link is damaged"),
        ("compare?runs=0123456789abcdef,0123456789abcdef", "is not here; it was deleted"),
    ):
        page.goto("about:blank")
        page.goto(address)
        shown.until(lambda said=said: said in page.inner_text("main"), said)  # type: ignore[misc]
        assert page.get_by_role("link", name="Choose saved runs").count() == 1
