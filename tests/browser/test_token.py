"""The page that asks for a token, to whoever comes without it."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from server.settings import Settings
from tests.browser.host import Server
from tests.browser.views import SessionPage
from tests.server.host import running

TOKEN = "salt & pepper, 100 %"
ENCODED = """async () => {
    const { encode } = await import('/static/shared/share_link.js');
    return encode({ recipe: { experiment: 'ball', seed: 5, frames: 30 } });
}"""


@pytest.fixture
def guarded(tmp_path: Path) -> Iterator[str]:
    """The address of a server that asks for a token."""
    with running(Settings(data_dir=tmp_path, token=TOKEN)) as server:
        yield server.url


def test_a_link_to_a_run_asks_for_the_token_and_leads_there(guarded: str, server: Server, chromium: Any) -> None:
    """A wrong token is said to be one; with the right one the run of the link is there, and asked for no more."""
    context = chromium.new_context(viewport={"width": 390, "height": 800})
    page = context.new_page()
    page.goto(f"{server.url}/")
    link = f"{guarded}/session/new?view=flat#{page.evaluate(ENCODED)}"
    page.goto(link)
    box, go = page.get_by_label("Token"), page.get_by_role("button", name="Open")
    for width in (1280, 390):
        page.set_viewport_size({"width": width, "height": 800})
        assert go.is_visible()
        assert page.evaluate("document.documentElement.scrollWidth") <= width
    box.fill("another one altogether")
    go.click()
    page.get_by_text("is not this server's").wait_for()
    box.fill(TOKEN)
    go.click()
    shown = SessionPage(page, server).ready()
    shown.until(lambda: page.inner_text("h1").endswith("seed 5"), "the title names the run")
    assert "token" not in page.url
    page.goto(f"{guarded}/")
    page.get_by_role("heading", name="Experiments").wait_for()
    context.close()
