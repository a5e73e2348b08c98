"""An experiment from another package, and a filter of one's own, do on the pages whatever the project's own do."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pftrack.experiments import find
from pftrack.experiments.own.extension import example_of
from tests.browser.conftest import TOKEN
from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage, View
from tests.making import disc_film

Watch = Callable[..., SessionPage]
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
    shown = SessionPage(page, server).ready()
    assert shown.session["recipe"]["experiment"] == NAME
    shown.until(lambda: shown.session["playing"], "it plays by itself")
    # It has its sliders and plots.
    shown.command("restart")
    shown.command("pause")
    shown.go_to(20)
    page.evaluate("for (const fold of document.querySelectorAll('.panel-controls details')) fold.open = true")
    slider = page.get_by_label("Sharpest turn (deg)", exact=True).and_(page.locator("[type=range]"))
    slider.press("Home")
    shown.until(lambda: shown.session["parameters"]["sharpest_deg"] == 0, "the slider is obeyed")
    shown.go_to(59)
    shown.until(lambda: shown.plots == ["error", "sigma", "ess", "turn"], "its plots are there, and no others")
    widths = [row["turn"][1] - row["turn"][0] for row in server.column(shown.id, "series")]
    assert min(widths[1:21]) > 0
    assert max(widths[21:]) == 0
    shown.until(lambda: shown.trace("turn band 0") is not None, "the interval is drawn")
    shown.until(lambda: readings(shown)[:2] == ["estimate", "error"], "so are its readings")


def test_a_link_without_its_token_asks_for_it_once(watch: Watch, server: Server, stranger: Any) -> None:
    """Of somebody else's browser; then it leads on to the run that it holds."""
    shown, other = watch(experiment=NAME, frames=60, tracker="straight"), stranger
    shown.menu("share")
    other.goto(shown.page.input_value("[data-role=share-link]"))
    give_token(other)
    assert SessionPage(other, server).ready().id != shown.id
    assert "token" not in other.url
    other.goto(f"{server.url}/")
    other.get_by_role("heading", name="Experiments").wait_for()


def give_token(page: Any) -> None:
    """Give a wrong token, which is said to be one, and then the right one, on a page that fits a phone as well."""
    box, go = page.get_by_label("Token"), page.get_by_role("button", name="Open")
    for width in (390, 1280):
        View(page).resize(width)
        go.wait_for()
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
    gallery.has_picture()

    def at(x: float, y: float) -> tuple[float, float]:
        area = surface.bounding_box()
        return area["x"] + (x + 0.5) * area["width"] / SIZE[0], area["y"] + (y + 0.5) * area["height"] / SIZE[1]

    gallery.drag(at((SIZE[0] - 1) / 2, (SIZE[1] - 1) / 2), at(40, 60))
    radius = page.locator("[data-number=radius]")
    radius.focus()
    for _ in range(11):
        page.keyboard.press("ArrowLeft")
    gallery.until(lambda: radius.input_value() == "9", "the radius is as set")
    go.click()

    shown = SessionPage(page, server).ready()
    mark = shown.session["recipe"]["footage"]["mark"]
    assert (mark["kind"], mark["radius"]) == ("circle", 9)
    assert mark["centre"] == pytest.approx([40, 60], abs=0.5)
    shown.play_to_the_end()
    u, v = server.column(shown.id, "estimate")[FRAMES - 1]
    assert u == pytest.approx(40 + 2 * (FRAMES - 1), abs=2)
    assert v == pytest.approx(60, abs=2)


FAINTEST = 0.06


def readings(shown: SessionPage) -> list[str]:
    return shown.page.locator(".readout dt:visible").all_inner_texts()


def test_all_that_a_method_reports_is_drawn_and_nothing_else(watch: Watch, server: Server) -> None:
    """In one visit to a run that has been played to its end."""
    shown = watch(experiment="bank", frames=40)
    shown.play_to_the_end()
    hypotheses_and_intervals_are_drawn_as_they_were_written_down(shown, server)
    what_a_method_does_not_have_is_not_shown(shown)
    a_node_of_the_tree_is_shown_in_its_frame(shown, server)


def hypotheses_and_intervals_are_drawn_as_they_were_written_down(shown: SessionPage, server: Server) -> None:
    """Each possibility leads from place to place, the more opaque the more probable; intervals have both ends."""
    rows = server.column(shown.id, "series")
    count = sum(len(row["bank"]["weights"]) for row in rows)
    links = lambda: (shown.trace("hypotheses") or {"links": []})["links"]  # noqa: E731 - one line of reading
    shown.until(lambda: len(links()) == count, "all possibilities are drawn")
    drawn = {name: [link[name] for link in links()] for name in ("x0", "x1", "y1", "opacity")}
    assert drawn["y1"] == [value for row in rows for (value,) in row["bank"]["values"]]
    weights = np.array([weight for row in rows for weight in row["bank"]["weights"]])
    assert np.allclose(drawn["opacity"], FAINTEST + (1 - FAINTEST) * weights)
    # The third possibility is there in every third frame only, and so begins anew each time.
    new = np.array(drawn["x1"]) - np.array(drawn["x0"]) == 0.5
    assert new.sum() == 2 + 13
    branch = shown.session["branch"]
    shown.until(lambda: shown.lines.get(f"range {branch} low 0") == 40, "the interval is drawn")
    found, truth = shown.trace("range band 0"), shown.trace("range truth")
    assert list(zip(found["low"], found["high"], strict=True)) == [tuple(row["range"]) for row in rows]
    assert truth["y"] == [row["truth"] for row in rows]


def what_a_method_does_not_have_is_not_shown(shown: SessionPage) -> None:
    """A tracker without particles has no control or plot for their number; its threshold is found by its role."""
    shown.until(lambda: shown.plots == ["hypotheses", "tree", "range", "sigma"], "only these panels are there")
    shown.until(lambda: readings(shown) == ["estimate", "most probable", "range", "step"], "and only these readings")
    shown.until(lambda: "threshold" in shown.plot("sigma").inner_text(), "the threshold is told")
    assert set(shown.trace("thresholds")["y"]) == {0.3}


def a_node_of_the_tree_is_shown_in_its_frame(shown: SessionPage, server: Server) -> None:
    """A click goes to the frame of a hypothesis and shows it, arrows choose another one, and no branch comes of it."""
    rows = server.column(shown.id, "series")
    count = sum(len(row["bank"]["weights"]) for row in rows)
    shown.until(lambda: len((shown.trace("tree") or {"y": []})["y"]) == count, "all possibilities are drawn")
    way, edges = shown.trace("tree way"), shown.trace("tree edges")
    # From frame 39 back to 31, whose best comes from the mirror image, which comes from the first, and so on.
    expected = [2 if frame % 10 == 0 and frame < 39 else 1 for frame in range(39, -1, -1)]
    assert [way["x"], way["y"]] == [list(range(39, -1, -1)), expected]
    assert len(edges["links"]) == count - 2

    shown.plot("tree").locator(".figure-plot").click(position=shown.place_in("tree", 20, 2))
    shown.stands_at(20)
    shown.until(lambda: shown.session["parameters"]["shown"] == 2, "the second possibility is shown")
    ring = lambda: shown.trace("tree shown") or {"x": []}  # noqa: E731
    shown.until(lambda: (ring()["x"], ring().get("y")) == ([20], [2]), "it has a ring")
    tree = shown.page.get_by_role("slider", name="shown hypothesis")
    shown.until(lambda: tree.input_value() == "2", "it is told to who cannot see it")
    tree.press("ArrowUp")
    shown.until(lambda: shown.session["parameters"]["shown"] == 1, "the arrow chooses the one above")
    tree.press("ArrowUp")
    assert len(shown.session["branches"]) == 1
    assert shown.position == 20


TEXT = example_of(find("ball"))


@pytest.fixture
def owner(tmp_path: Path) -> Iterator[Server]:
    """A server that was started with a file."""
    file = tmp_path / "mine.py"
    file.write_text(TEXT)
    (tmp_path / "data").mkdir()
    server = Server(tmp_path / "data", token="a token of the owner", PFTRACK_FILTERS=str(file))
    yield server
    server.stop()


def test_a_filter_is_changed_broken_and_mended_in_the_page(owner: Server, tmp_path: Path, stranger: Any) -> None:
    """Ctrl-S makes a branch; a mistake stands at its line while the run stands; what is mended goes on."""
    page = stranger
    page.goto(f"{owner.url}/?token={owner.token}")
    page.get_by_role("link", name="Open mine.py").wait_for()
    session = owner.start_session(experiment="ball", tracker="mine")
    page.goto(f"{owner.url}/{session['page']}")
    shown = SessionPage(page, owner).ready()
    shown.menu("code")
    field = page.locator(".cm-content")
    field.wait_for()
    assert "def propagate" in field.inner_text()
    state = page.locator(".editor-state")

    field.press("Control+End")
    page.keyboard.type("\ndef broken(:\n")
    state.get_by_text("Unsaved").wait_for()
    page.keyboard.press("Control+s")
    shown.until(lambda: "invalid syntax" in state.inner_text(), "the mistake is told")
    assert f"Line {len(TEXT.splitlines()) + 2}" in state.inner_text()
    page.locator(".cm-lint-marker-error").wait_for()
    assert (tmp_path / "mine.py").read_text() != TEXT

    def saves(text: str, words: str) -> None:
        page.keyboard.press("Control+a")
        page.keyboard.insert_text(text)
        page.keyboard.press("Control+s")
        shown.until(lambda: words in state.inner_text(), f"it says {words}")

    changed = TEXT.replace("noise_px: float = 3.0", "noise_px: float = 6.0")
    saves(changed, "version 2")
    saves(TEXT.replace("return np.log(0.02", "return np.log(-0.5"), "log_likelihood returned NaN")
    page.locator(".cm-lint-marker-error").wait_for()
    assert not shown.session["playing"]

    saves(f"{changed}\n", "version 4")
    page.get_by_role("button", name="Parameters").click()
    noise = page.get_by_role("spinbutton", name="Noise (px)")
    shown.until(lambda: noise.input_value() == "6", "its default is in force")
    page.get_by_role("button", name="Close the editor").click()
    page.locator(".editor").wait_for(state="hidden")
