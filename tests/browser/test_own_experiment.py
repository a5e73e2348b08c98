"""An experiment from another package does on the pages whatever the project's own do."""

from typing import Any

import pytest

from tests.browser.conftest import CHOSEN, TOKEN
from tests.browser.host import Server
from tests.browser.views import PAINTED, Gallery, SessionPage, View
from tests.conftest import FRUGAL
from tests.making import disc_film

NAME = "turning"
SIZE = (160, 120)
FRAMES = 30


@pytest.fixture
def server(beside_others: Server) -> Server:
    """A server beside which the example is installed, and a package that is broken."""
    return beside_others


@pytest.fixture(scope="module")
def clip() -> bytes:
    """A bright disc that walks to the right over grey."""
    return disc_film(FRAMES, ground=90, colours=[(220, 220, 220)] * FRAMES)


def ready(page: Any, server: Server) -> SessionPage:
    """Wait until a session's page is connected and shows a frame."""
    page.wait_for_url("**/session/*", wait_until="commit")
    shown = SessionPage(page, server)
    shown.until(lambda: shown.position is not None, "the frame counter shows a number")
    shown.until(lambda: page.locator(".play").is_enabled(), "the play button can be pressed")
    shown.until(lambda: page.evaluate(PAINTED), "there is a frame to see")
    return shown


def opened(page: Any, server: Server, **recipe: Any) -> SessionPage:
    page.goto(server.start_session(experiment=NAME, frames=60, **recipe)["page"])
    return ready(page, server)


def test_the_gallery_shows_it_and_says_what_is_broken(gallery: Gallery, server: Server) -> None:
    """It has a card with its picture that leads to a session; the broken package has a sentence, and harms nothing.

    In the session its slider is obeyed from the next frame on; its plots follow.
    """
    page = gallery.page
    card = gallery.card(NAME)
    card.wait_for()
    assert "A turn out of sight" in card.inner_text()
    picture = card.locator("img")
    gallery.until(lambda: picture.evaluate("(image) => image.naturalWidth") > 0, "its picture is there")
    assert gallery.card("bank").locator(".thumb").count() == 0, "it brings no picture, and shows no empty field"
    said = "The experiment broken of a-broken-one 1.0 cannot be used: importing it raises RuntimeError."
    gallery.until(lambda: said in page.inner_text("[data-part=plugins]"), "the broken one is told of")
    assert "in vain" not in page.inner_text("body")
    card.locator("h4 a").click()
    shown = ready(page, server)
    assert shown.session["recipe"]["experiment"] == NAME
    shown.until(lambda: shown.session["playing"], "it plays by itself")
    it_has_its_sliders_and_plots(shown, server)


def it_has_its_sliders_and_plots(shown: SessionPage, server: Server) -> None:
    page = shown.page
    server.post(f"sessions/{shown.id}/commands", {"kind": "restart"})
    server.post(f"sessions/{shown.id}/commands", {"kind": "pause"})
    server.seek(shown.id, 20)
    shown.stands_at(20)
    page.evaluate("for (const fold of document.querySelectorAll('.panel-controls details')) fold.open = true")
    slider = page.get_by_label("Sharpest turn (deg)", exact=True).and_(page.locator("[type=range]"))
    slider.press("Home")
    shown.until(lambda: shown.session["parameters"]["sharpest_deg"] == 0, "the slider is obeyed")
    server.seek(shown.id, 59)
    shown.stands_at(59)
    shown.until(lambda: shown.plots == ["error", "sigma", "ess", "turn"], "its plots are there, and no others")
    rows = server.column(shown.id, "series")
    widths = [row["turn"][1] - row["turn"][0] for row in rows]
    assert min(widths[1:21]) > 0
    assert max(widths[21:]) == 0
    shown.until(lambda: shown.trace("turn band 0") is not None, "the interval is drawn")
    titles = lambda: [it.inner_text() for it in page.locator(".readout dt:visible").all()]  # noqa: E731
    shown.until(lambda: titles()[:2] == ["estimate", "error"], "so are its readings")


def test_a_link_without_its_token_asks_for_it_once(page: Any, server: Server, chromium: Any) -> None:
    """Of somebody else's browser; then it leads on to the run that it holds."""
    shown = opened(page, server, tracker="straight")
    shown.menu("share")
    link = page.input_value("[data-role=share-link]")
    context = chromium.new_context(viewport={"width": 1280, "height": 800})
    for script in (FRUGAL, CHOSEN.format("flat")):
        context.add_init_script(script)
    other = context.new_page()
    other.goto(link)
    give_token(other)
    assert ready(other, server).id != shown.id
    assert "token" not in other.url
    other.goto(f"{server.url}/")
    other.get_by_role("heading", name="Experiments").wait_for()
    context.close()


def give_token(page: Any) -> None:
    """Give a wrong token, which is said to be one, and then the right one, on a page that fits a phone as well."""
    box, go = page.get_by_label("Token"), page.get_by_role("button", name="Open")
    for width in (390, 1280):
        page.set_viewport_size({"width": width, "height": 800})
        go.wait_for()
        View(page).until(lambda: page.evaluate("innerWidth") == width, "the window has its width")  # noqa: B023 - called at once
        assert page.evaluate("document.documentElement.scrollWidth") <= width
    box.fill("another one altogether")
    go.click()
    page.get_by_text("is not this server's").wait_for()
    box.fill(TOKEN)
    go.click()


def test_its_mark_is_made_on_an_upload(gallery: Gallery, server: Server, clip: bytes) -> None:
    """The page makes an editor of a circle, which it has never heard of; the disc that is marked is followed."""
    page = gallery.page
    gallery.choose("walk.mp4", clip, "video/mp4")
    page.locator("#target-experiment").select_option("circled")
    surface = page.locator("[data-mark=circle] .mark-surface")
    surface.wait_for()
    go = page.locator("button:has-text('Track it')")
    assert go.is_disabled()
    gallery.until(
        lambda: page.evaluate("document.querySelector('.mark-surface img')?.complete"), "the picture is there"
    )

    def at(x: float, y: float) -> tuple[float, float]:
        area = surface.bounding_box()
        return area["x"] + (x + 0.5) * area["width"] / SIZE[0], area["y"] + (y + 0.5) * area["height"] / SIZE[1]

    page.mouse.move(*at((SIZE[0] - 1) / 2, (SIZE[1] - 1) / 2))
    page.mouse.down()
    page.mouse.move(*at(40, 60), steps=4)
    page.mouse.up()
    radius = page.locator("[data-number=radius]")
    radius.focus()
    for _ in range(11):
        page.keyboard.press("ArrowLeft")
    gallery.until(lambda: radius.input_value() == "9", "the radius is as set")
    go.click()

    shown = ready(page, server)
    mark = shown.session["recipe"]["footage"]["mark"]
    assert (mark["kind"], mark["radius"]) == ("circle", 9)
    assert mark["centre"] == pytest.approx([40, 60], abs=0.5)
    shown.play_to_the_end()
    u, v = server.column(shown.id, "estimate")[FRAMES - 1]
    assert u == pytest.approx(40 + 2 * (FRAMES - 1), abs=2)
    assert v == pytest.approx(60, abs=2)
