"""Worlds beside the picture: seen from their viewpoints, and from wherever somebody turns them to."""

from collections.abc import Callable
from typing import Any

import pytest

from tests.browser.host import Server
from tests.browser.views import SessionPage

# What the canvas shows, as a number that differs when a pixel does.
SUM = """(() => {
    const canvas = document.querySelector('.world-canvas');
    const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
    let sum = 0;
    for (let i = 0; i < data.length; i += 1) sum = (31 * sum + data[i]) % 4294967291;
    return sum;
})()"""
# Whether some frames of the display change nothing.
STEADY = f"""(async () => {{
    const before = {SUM};
    for (let i = 0; i < 4; i += 1) await new Promise(requestAnimationFrame);
    return before === {SUM};
}})()"""
# Whether two elements of the page overlap.
OVERLAP = """([one, other]) => {
    const [a, b] = [one, other].map((it) => document.querySelector(it).getBoundingClientRect());
    return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}"""


class WorldPage(SessionPage):
    """The page of a session that shows a world beside its picture."""

    @property
    def canvas(self) -> Any:
        return self.page.locator(".world-canvas")

    @property
    def side(self) -> tuple[int, int]:
        """From where it is seen: azimuth and elevation in degrees."""
        return int(self.canvas.get_attribute("data-azimuth")), int(self.canvas.get_attribute("data-elevation"))

    def stands(self, azimuth: int, elevation: int) -> None:
        self.until(lambda: self.side == (azimuth, elevation), f"it is seen from {azimuth}, {elevation} degrees")

    @property
    def shown(self) -> int:
        return int(self.page.evaluate(SUM))

    def changes(self, work: Callable[[], object]) -> None:
        """Do something, and wait until another picture is shown; what is still to be painted comes before it."""
        self.until(lambda: self.page.evaluate(STEADY), "nothing is painted any more")
        before = self.shown
        work()
        self.until(lambda: self.shown != before, "the world looks otherwise")


@pytest.fixture
def view(unchosen: Any, server: Server) -> WorldPage:
    session = server.start_session(experiment="head", frames=60)
    unchosen.goto(session["page"])
    page = WorldPage(unchosen, server).ready()
    page.canvas.wait_for()
    return page


def test_a_world_is_looked_at(view: WorldPage, server: Server) -> None:
    """All that can be done with it, in one visit."""
    it_is_seen_from_its_viewpoints(view)
    it_is_turned_by_hand(view, server)
    it_goes_on_with_the_run(view, server)
    it_makes_room(view)


def it_is_seen_from_its_viewpoints(view: WorldPage) -> None:
    """It begins at the first of them; a button shows another side, and says that it is the one."""
    assert view.page.inner_text(".world summary") == "Head model, mm"
    assert view.side == (-35, 15)
    for name, side in (("front", (0, 0)), ("top", (0, 90)), ("3-d", (-35, 15))):
        button = view.page.locator(f"[data-viewpoint='{name}']")
        view.changes(button.click)
        view.stands(*side)
        assert view.page.locator("[data-viewpoint][aria-pressed=true]").all_inner_texts() == [button.inner_text()]
    assert view.canvas.get_attribute("aria-label").startswith("Head model, in mm, seen from -35 degrees")
    view.canvas.focus()
    view.changes(lambda: view.press("Enter"))
    view.stands(0, 0)
    assert view.page.locator("[data-viewpoint][aria-pressed=true]").get_attribute("data-viewpoint") == "front"
    view.changes(view.page.locator("[data-viewpoint='3-d']").click)


def it_is_turned_by_hand(view: WorldPage, server: Server) -> None:
    """Dragged to the right it shows its left; arrow keys turn it while it has the focus, and move the run elsewhere."""
    server.seek(view.id, 9)
    view.stands_at(9)
    box = view.canvas.bounding_box()
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def drag() -> None:
        mouse = view.page.mouse
        mouse.move(*middle)
        mouse.down()
        mouse.move(middle[0] + 50, middle[1] + 20, steps=4)
        mouse.up()

    view.changes(drag)
    view.stands(-65, 27)
    assert view.page.locator("[data-viewpoint][aria-pressed=true]").count() == 0
    view.canvas.focus()
    for key in ("ArrowRight", "ArrowRight", "ArrowUp"):
        view.changes(lambda key=key: view.press(key))  # type: ignore[misc]
    view.stands(-45, 37)
    for _ in range(6):
        view.press("ArrowUp")
    view.stands(-45, 90)
    assert view.position == 9
    view.page.locator(".play").focus()
    view.press("ArrowRight")
    view.stands_at(10)
    assert view.side == (-45, 90)


def it_goes_on_with_the_run(view: WorldPage, server: Server) -> None:
    """It is painted with the picture, and layers hold in it, too."""
    view.changes(lambda: server.seek(view.id, 30))
    picture = view.page.locator(".flat-canvas")
    view.until(lambda: picture.get_attribute("data-frame") == "30", "the frame is painted")
    view.page.locator(".controls").get_by_text("More", exact=True).click()
    view.page.get_by_text("What to draw").click()
    view.changes(view.page.get_by_label("Axes", exact=True).uncheck)
    view.changes(view.page.get_by_label("Axes", exact=True).check)


def it_makes_room(view: WorldPage) -> None:
    """It can be enlarged and folded away; in a narrow place it hides nothing of the picture, and nothing sticks out."""
    small = view.canvas.bounding_box()["width"]
    view.page.get_by_label("Larger").click()
    view.until(lambda: view.canvas.bounding_box()["width"] > 1.5 * small, "it is larger")
    view.page.get_by_label("Larger").click()
    view.page.locator(".world summary").click()
    assert not view.canvas.is_visible()
    view.page.locator(".world summary").click()
    for width, height, place in ((700, 800, "beside"), (390, 844, "below")):
        view.page.set_viewport_size({"width": width, "height": height})
        apart = lambda: not view.page.evaluate(OVERLAP, [".flat-canvas", ".world"])  # noqa: E731 - one line of reading
        view.until(apart, f"it stands {place} the picture")
    assert view.page.evaluate("document.documentElement.scrollWidth") <= 390
