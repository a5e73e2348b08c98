"""A filter of one's own, written beside the session that runs it."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pftrack.experiments import find
from pftrack.experiments.own.extension import example_of
from tests.browser.host import Server
from tests.browser.views import SessionPage

TEXT = example_of(find("ball"))
TOKEN = "a token of the owner"


@pytest.fixture
def owner(tmp_path: Path) -> Iterator[Server]:
    """A server that was started with a file."""
    file = tmp_path / "mine.py"
    file.write_text(TEXT)
    (tmp_path / "data").mkdir()
    server = Server(tmp_path / "data", token=TOKEN, PFTRACK_FILTERS=str(file))
    yield server
    server.stop()


def test_a_filter_is_changed_broken_and_mended_in_the_page(owner: Server, tmp_path: Path, chromium: Any) -> None:
    """Ctrl-S makes a branch; a mistake stands at its line while the run stands; what is mended goes on."""
    page = chromium.new_context(viewport={"width": 1280, "height": 720}).new_page()
    page.goto(f"{owner.url}/?token={TOKEN}")
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

    page.keyboard.press("Control+a")
    page.keyboard.insert_text(TEXT.replace("noise_px: float = 3.0", "noise_px: float = 6.0"))
    page.keyboard.press("Control+s")
    shown.until(lambda: "version 2" in state.inner_text(), "the new version is in force")
    page.keyboard.press("Control+a")
    page.keyboard.insert_text(TEXT.replace("return np.log(0.02", "return np.log(-0.5"))
    page.keyboard.press("Control+s")
    shown.until(lambda: "log_likelihood returned NaN" in state.inner_text(), "it is tried while the run stands")
    page.locator(".cm-lint-marker-error").wait_for()
    assert not shown.session["playing"]

    page.keyboard.press("Control+a")
    page.keyboard.insert_text(TEXT.replace("noise_px: float = 3.0", "noise_px: float = 6.0") + "\n")
    page.keyboard.press("Control+s")
    shown.until(lambda: "version 4" in state.inner_text(), "the mended version is in force")
    page.get_by_role("button", name="Parameters").click()
    noise = page.get_by_role("spinbutton", name="Noise (px)")
    shown.until(lambda: noise.input_value() == "6", "its default is in force")
    page.get_by_role("button", name="Close the editor").click()
    page.locator(".editor").wait_for(state="hidden")
