"""The keyboard; test_scene.py tries it from inside the scene's frame."""

from tests.browser.conftest import Watch
from tests.browser.host import Server
from tests.browser.views import SessionPage


def test_the_keyboard_in_one_visit(watch: Watch, server: Server) -> None:
    """All keys on the page of one session; the preset comes last, since it opens another one."""
    shown = watch()
    help_lists_the_keys_and_takes_the_others(shown)
    shown.go_to(30)
    steps = {"ArrowLeft": 29, "ArrowRight": 30, "Shift+ArrowLeft": 20, "Shift+ArrowRight": 30, "Home": 0, "End": 30}
    for key, frame in steps.items():
        shown.press(key)
        shown.stands_at(frame)
    for key, speed in (("]", 2), ("[", 1), ("[", 0.5)):
        shown.press(key)
        shown.until(lambda speed=speed: shown.page.input_value("[aria-label=Speed]") == str(speed), f"speed {speed}")  # type: ignore[misc]
    shown.press(" ")
    shown.until(lambda: shown.session["playing"], "it plays")
    shown.until(lambda: "Pause" in shown.page.inner_text(".play"), "the button pauses now")
    shown.press(" ")
    shown.until(lambda: not shown.session["playing"], "it pauses")
    # Dragging shows the past; a release pauses there.
    shown.go_to(89)
    area = shown.page.locator(".scrubber").bounding_box()
    y, left, right = area["y"] + 30, area["x"] + 104, area["x"] + area["width"] - 10
    at = lambda frame: (left + (right - left) * frame / 89, y)  # noqa: E731 - one line of geometry
    shown.drag(at(89), at(60), at(33))
    shown.stands_at(33)
    assert not shown.session["playing"]
    shown.page.locator(".scrubber[aria-valuenow='33']").wait_for()
    shown.press("n")
    shown.page.locator("#branch-tracker:focus").wait_for()
    shown.press("Enter")
    shown.until(lambda: len(shown.session["branches"]) == 2, "enter in the dialog makes a branch")
    shown.page.locator("dialog").wait_for(state="detached")
    assert shown.session["branches"][1]["frame"] == 33
    a_run_that_has_ended_says_what_a_change_does(shown, server)
    for key in "123456789":  # a class answers polls by them
        shown.press(key)
    shown.press("ArrowLeft")
    shown.stands_at(0)
    # Ctrl+K and a few words lead to a control, also where the panel is folded.
    shown.resize(800, 700)
    shown.press("Control+k")
    shown.page.get_by_label("Search").fill("particles parameter")
    shown.press("Enter")
    focused = "document.activeElement.labels?.[0]?.textContent"
    shown.until(lambda: shown.page.evaluate(focused) == "Particles", "its field has the focus")
    shown.page.locator(".counter").click()
    # P lists the presets with what to look at; a chosen one starts its own session and plays.
    before = shown.id
    shown.press("p")
    chosen = shown.page.locator("[data-preset]:focus")
    chosen.wait_for()
    assert "when the pillar hides the ball" in chosen.inner_text()
    shown.press("Enter")
    shown.until(lambda: shown.id not in {before, "new"}, "another session is open")
    shown.ready()
    shown.until(lambda: (shown.position or 0) > 0, "it plays")


def help_lists_the_keys_and_takes_the_others(shown: SessionPage) -> None:
    """The question mark opens the list; while it is open, keys do nothing else; Escape closes it."""
    sent: list[str] = []
    shown.page.on("request", lambda request: sent.append(request.url))
    shown.press("?")
    dialog = shown.page.locator("dialog")
    dialog.wait_for()
    assert "Bookmark this frame" in dialog.inner_text()
    shown.press("ArrowRight")
    shown.press("Escape")
    dialog.wait_for(state="detached")
    shown.press("ArrowRight")
    shown.stands_at(1)
    assert len([url for url in sent if url.endswith("/commands")]) == 1


def a_run_that_has_ended_says_what_a_change_does(shown: SessionPage, server: Server) -> None:
    """At its end and in its past, the panel says where a change makes a branch; another tracker then makes it."""
    said, tracker = shown.page.locator(".control-effect"), shown.page.locator(".controls select").first
    shown.go_to(60)
    said.wait_for(state="hidden")
    assert said.text_content() == ""
    server.seek(shown.id, 40)
    said.get_by_text("A change at frame 40 makes a branch").wait_for()
    server.seek(shown.id, 89)
    said.get_by_text("The run has ended. A change runs it again from frame 0, as a branch").wait_for()
    branches = len(shown.session["branches"])
    tracker.select_option("condensation")
    shown.until(lambda: len(shown.session["branches"]) == branches + 1, "there is one more branch")
    shown.stands_at(0)
    said.wait_for(state="hidden")
    shown.press("ArrowRight")
    shown.stands_at(1)
    shown.until(lambda: "Condensation" in shown.page.inner_text(".flat-caption"), "the picture is the branch's")


def test_a_branch_may_change_parameters_and_begins_before_the_end(watch: Watch) -> None:
    """At the last frame, which leaves nothing to compute, it begins a frame before; its values count from there."""
    shown = watch(frames=12)
    shown.go_to(11)
    shown.press("n")
    frame = shown.page.locator("#branch-frame")
    frame.wait_for()
    assert frame.input_value() == "10"
    frame.fill("5")
    dialog = shown.page.locator("dialog")
    dialog.locator("summary").click()
    labels = dialog.locator(".control:has(> select) > label")
    assert labels.count() > 0
    is_above = "it.getBoundingClientRect().bottom <= it.nextSibling.getBoundingClientRect().top"
    assert labels.evaluate_all(f"(all) => all.every((it) => {is_above})")
    frame.fill("")
    dialog.get_by_role("button", name="Branch here").click()
    assert frame.evaluate("(it) => it.validity.valueMissing"), "it is not sent without a frame"
    frame.fill("5")
    particles = dialog.get_by_role("spinbutton", name="Particles", exact=True)
    particles.fill("123")
    particles.press("Tab")
    dialog.get_by_role("button", name="Branch here").click()
    dialog.wait_for(state="detached")
    shown.until(lambda: len(shown.session["branches"]) == 2, "there is a branch")
    assert (shown.session["branches"][1]["frame"], shown.session["parameters"]["sample_count"]) == (5, 123)
