"""A run in its scene: seen at once, steered by panel and keys, moved by hand, and a lesson in front of a class."""

import re
from collections.abc import Callable
from urllib.parse import urlsplit

import pytest

from tests.browser.accessible import check
from tests.browser.conftest import Complaints
from tests.browser.host import Server
from tests.browser.views import BALL, Gallery, SessionPage

Watch = Callable[..., SessionPage]


@pytest.mark.scene
def test_the_scene_shows_the_run_and_obeys_its_panel(watch: Watch, server: Server, complaints: Complaints) -> None:
    """After a few steps the scene holds the ball and the particles, and each plot a line.

    Moving the occluder's slider widens it in the next picture; the number of particles follows its own. With the focus
    in the scene's frame the keys steer the run all the same. The flat view after it has its own panel unfolded as well.
    """
    shown = watch()
    shown.until(lambda: shown.in_scene(BALL, False), "the ball is in the picture")
    count = shown.session["parameters"]["sample_count"]
    shown.until(lambda: shown.particles == count, "so are the particles")
    for _ in range(3):
        shown.press("ArrowRight")
    shown.stands_at(3)
    drawn = {f"{name} {shown.session['branch']}": 4 for name in ("error", "sigma", "ess")}.items()
    shown.until(lambda: drawn <= shown.lines.items(), "the plots hold 4 frames")

    shown.until(lambda: 36 <= shown.occluder <= 44, "the occluder is 40 px wide")
    wide = shown.slide("Occluder width (px)", 10)
    assert wide > 40
    shown.until(lambda: shown.session["parameters"]["occlusion_width_px"] == wide, "the slider is obeyed")
    shown.type_number("Particles", 300)
    shown.until(lambda: shown.session["parameters"]["sample_count"] == 300, "300 particles are in force")
    shown.press("Escape")
    shown.page.click("button[aria-label^='One frame forward']")
    shown.stands_at(4)
    shown.until(lambda: shown.particles == 300, "300 particles are in the scene")
    shown.until(lambda: abs(shown.occluder - wide) <= 4, f"the occluder is {wide} px wide")
    assert [change["frame"] for change in shown.session["timeline"]].count(4) >= 1

    shown.scene.locator("canvas[data-engine]").click(position={"x": 40, "y": 200})
    at = shown.position
    shown.press("ArrowRight")
    shown.stands_at(at + 1)
    shown.press("b")
    shown.until(lambda: shown.page.inner_text(".amount") == "1", "the frame is bookmarked")
    the_keys_of_the_page_work_within_it(shown)
    the_page_around_it_can_be_used_by_everybody(shown)
    its_panel_leaves_room_and_keeps_its_folds(shown)
    complaints.expected = ("Failed to fetch",)  # what the scene was just fetching when it is left
    shown.page.get_by_role("button", name="Flat").click()
    shown.page.locator(".controls").get_by_label("Ball radius (px)", exact=True).first.wait_for()


def the_keys_of_the_page_work_within_it(shown: SessionPage) -> None:
    """From the scene W asks why, F presents, and Escape, which ends it, reaches the page as well."""
    in_focus = "document.activeElement.localName === 'iframe'"
    assert shown.page.evaluate(in_focus)
    presented = "document.documentElement.dataset.presenting !== undefined"
    shown.press("f")
    shown.until(lambda: shown.page.evaluate(presented), "it is presented")
    assert shown.page.evaluate(in_focus)
    shown.press("Escape")
    shown.until(lambda: not shown.page.evaluate(presented), "the presentation has ended")
    shown.press("w")
    shown.page.get_by_role("button", name="Back to the plots").click()


def the_page_around_it_can_be_used_by_everybody(shown: SessionPage) -> None:
    """The frame has a name, and does not trap the focus: the tab key leads through it and out of it again."""
    check(shown.page)
    shown.page.locator("iframe").focus()
    inside = "document.activeElement.localName === 'iframe'"
    shown.until(lambda: shown.page.evaluate(inside), "the scene has the focus")
    for _ in range(60):
        shown.press("Tab")
        if not shown.page.evaluate(inside):
            break
    assert not shown.page.evaluate(inside), "sixty steps of the tab key stay within the scene"


def its_panel_leaves_room_and_keeps_its_folds(shown: SessionPage) -> None:
    """Beside both panels the picture of the scene has half of the width; its own panel keeps its folds."""
    drawn = "document.querySelector('canvas[data-engine]').getBoundingClientRect().width"
    for width in (1000, 1280):
        shown.resize(width)
        share = f"parent.innerWidth === {width} && {drawn} >= {0.5 * width}"
        shown.until(lambda share=share: shown.in_scene(share, False), "the picture has its share")
    radius = shown.number("Ball radius (px)")
    for frame in (8, 4):
        shown.go_to(frame)
    shown.change(ball_radius_px=9)
    shown.until(lambda: radius.input_value() == "9", "the panel shows the new value")
    assert radius.is_visible()


def test_lose_the_ball_go_back_and_save_it_with_another_tracker(watch: Watch, server: Server) -> None:
    """Few particles and a wide pillar lose the ball; from before the loss another tracker keeps it."""
    shown = watch(tracker="condensation")
    shown.change(occlusion_width_px=60, sample_count=150)

    shown.play_to_the_end()
    shown.until(lambda: shown.verdict.startswith("lost since"), "the page says that the ball is lost")
    first = shown.session["branch"]
    lost = server.column(shown.id, "lost")
    assert sum(lost) > len(lost) / 4
    loss = max(frame for frame in range(1, len(lost)) if lost[frame] and not lost[frame - 1])

    shown.page.click("text=Before the loss")
    shown.until(lambda: (shown.position or 99) < loss, "the page stands before the loss")
    shown.until(lambda: shown.verdict in {"held (by truth)", "hidden (by truth)"}, "the ball is not lost yet")
    at = shown.position

    shown.branch("apf")
    tracker = shown.page.locator(".controls").get_by_label("Tracker").first
    shown.until(lambda: tracker.input_value() == "apf", "the panel names the new tracker")
    shown.until(lambda: shown.page.locator(".branches .chip").count() == 2, "both branches are listed")
    shown.play_to_the_end()
    shown.until(lambda: shown.verdict in {"held (by truth)", "hidden (by truth)"}, "the ball is held to the end")

    second = shown.session["branch"]
    survived = server.column(shown.id, "lost", second)
    assert sum(survived[at:]) < sum(lost[at:]) / 2
    assert server.column(shown.id, "error", second)[: at + 1] == server.column(shown.id, "error", first)[: at + 1]  # type: ignore[operator]
    shown.until(lambda: shown.lines.get(f"error {second}") == 90, "the second branch is a line of its own")
    shown.until(lambda: shown.lines.get(f"error {first}") == 90, "the first one's is still there")


# Of the particles within the picture the furthest from all: its place there, and where it is seen, CSS pixels.
SEEN = """() => {
    const { camera, nodeRefFromName } = window.__viserMutable ?? {};
    const canvas = document.querySelector('canvas[data-engine]')?.getBoundingClientRect();
    let found = null;
    nodeRefFromName?.['/particles']?.traverse((item) => {
        if (!item.isPoints) return;
        const { array, count } = item.geometry.attributes.position;
        const place = (n) => [array[3 * n], array[3 * n + 1], array[3 * n + 2]];
        const all = Array.from({ length: count }, (_, n) => place(n));
        const [middle, level] = [0, 1].map((axis) => all.reduce((sum, each) => sum + each[axis], 0) / count);
        const off = ([x, y]) => Math.hypot(x - middle, y - level);
        const inside = all.filter(([x, y]) => x > 20 && x < 300 && y < -20 && y > -220);
        const furthest = inside.reduce((one, other) => (
            off(one) < off(other) ? other : one));
        const seen = item.localToWorld(camera.position.clone().set(...furthest)).project(camera);
        const [x, y] = [(seen.x + 1) / 2 * canvas.width, (1 - seen.y) / 2 * canvas.height];
        found = { at: [furthest[0], -furthest[1]], x, y };
    });
    return found;
}"""
GRIPS = "Boolean(window.__viserMutable?.nodeRefFromName?.['/grips'])"
EYE = "window.__viserMutable.camera.position.toArray().map((value) => Math.round(value))"


@pytest.mark.scene
def test_a_particle_is_dragged_with_shift_and_the_camera_turns_without(
    watch: Callable[..., SessionPage], server: Server, complaints: Complaints
) -> None:
    """The change stands on the timeline, the particle is drawn there, and the next frame begins with it."""
    # viser asks for it at each grip that is pressed, from a listener that cannot.
    complaints.expected = ("Unable to preventDefault inside passive event listener",)
    view = watch(tracker="condensation", seed=3)
    view.go_to(20)
    view.until(lambda: view.in_scene("window.pftrackScene?.drawn()", None) == "in place", "the picture stands still")
    view.until(lambda: view.in_scene(GRIPS, False), "there are grips")
    frame, mouse = view.page.locator(".scene-frame").bounding_box(), view.page.mouse
    seen = view.in_scene(f"({SEEN})()", None)
    at = frame["x"] + seen["x"], frame["y"] + seen["y"]
    a_click_takes_the_particle_that_it_hits(view)

    def drag(across: float, down: float) -> None:
        mouse.move(*at)
        mouse.down()
        for share in (0.2, 0.6, 1.0):
            mouse.move(at[0] + share * across, at[1] + share * down)
            view.page.wait_for_timeout(100)
        mouse.up()

    mouse.move(*at)
    view.page.wait_for_timeout(500)
    view.page.keyboard.down("Shift")
    eye = view.in_scene(EYE, None)
    drag(0.0, -60.0)
    view.page.keyboard.up("Shift")
    view.until(lambda: view.session["timeline"], "it is a change of the run")
    (change,) = view.session["timeline"]
    assert (change["frame"], change["moved"][0][:9]) == (21, "Particle ")
    assert view.in_scene(EYE, None) == eye
    view.until(lambda: (view.in_scene(f"({SEEN})()", None) or seen)["at"] != seen["at"], "it is drawn elsewhere")
    drag(40.0, -60.0)
    view.until(lambda: view.in_scene(EYE, None) != eye, "the camera turns")
    assert view.session["timeline"] == [change]


def a_click_takes_the_particle_that_it_hits(view: SessionPage) -> None:
    """In three dimensions as in the flat picture: the particle that is hit is told."""
    view.press("i")
    view.page.get_by_role("button", name="Particle", exact=True).click()
    card = view.page.locator(".inspection-card")
    view.until(lambda: "drawn by" in card.inner_text(), "some particle is told")
    frame, seen = view.page.locator(".scene-frame").bounding_box(), view.in_scene(f"({SEEN})()", None)
    view.page.mouse.click(frame["x"] + seen["x"], frame["y"] + seen["y"])
    wanted = "particle at {:.1f}, {:.1f} px".format(*seen["at"])
    view.until(lambda: wanted in card.inner_text(), f"the {wanted} is told")
    view.press("i")
    card.wait_for(state="hidden")


VERSIONED = re.compile(r"^.*/static/version/\w+/")


def test_the_gallery_fetches_ahead(gallery: Gallery) -> None:
    """Script of the session's page is there before somebody clicks, and is not asked for again afterwards."""
    page = gallery.page
    ahead = "[...document.querySelectorAll('link[rel=prefetch]')].map((it) => it.href)"
    here = "performance.getEntriesByType('resource').filter((it) => it.responseEnd > 0).map((it) => it.name)"

    def fetched() -> set[str]:
        return {VERSIONED.sub("", urlsplit(address).path) for address in page.evaluate(ahead)}

    gallery.until(lambda: "session/session_start.js" in fetched(), "the page's first module is fetched")
    gallery.until(lambda: set(page.evaluate(ahead)) <= set(page.evaluate(here)), "all of them have come")
    gallery.card("ball").locator("h4 a").click(no_wait_after=True)
    page.wait_for_url("**/session/*")
    sent = "performance.getEntriesByType('resource').filter((it) => it.transferSize > 0).map((it) => it.name)"
    again = {VERSIONED.sub("", urlsplit(address).path) for address in page.evaluate(sent)}
    assert not {path for path in again if path.endswith(".js")}
