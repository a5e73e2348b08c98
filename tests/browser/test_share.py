"""What a session leaves behind: saved runs and bookmarks; each brings back the same numbers."""

from typing import Any

from tests.browser.accessible import usable
from tests.browser.conftest import Watch
from tests.browser.host import Server
from tests.browser.views import Gallery, SessionPage


def test_a_reload_keeps_everything(watch: Watch, server: Server) -> None:
    """Position, branches, bookmarks and curves come back; a bookmark leads to its frame."""
    shown = watch()
    shown.go_to(30)
    shown.press("b")
    shown.until(lambda: shown.page.inner_text(".amount") == "1", "the bookmark is counted")
    shown.go_to(15)
    shown.branch("s-spf")
    shown.until(lambda: shown.verdict != "not computed yet", "the numbers of this frame are shown")
    verdict = shown.page.inner_text(".readout dl")
    shown.page.reload()
    shown.ready()
    shown.stands_at(15)
    shown.until(lambda: shown.page.locator(".branches .chip").count() == 2, "both branches are listed")
    shown.until(lambda: shown.page.inner_text(".amount") == "1", "the bookmark is counted again")
    shown.until(lambda: shown.page.inner_text(".readout dl") == verdict, "the numbers of this frame are the same")
    first = shown.session["branches"][0]["id"]
    shown.until(lambda: shown.lines.get(f"error {first}") == 31, "the other branch's curve is back")
    # A bookmark with a note is listed; a click goes there; it can be removed.
    shown.page.click("button[aria-label=Bookmarks]")
    shown.page.fill("input[aria-label=Note]", "<b>here</b>")
    shown.page.click(".menu >> text=Add")
    entry = shown.page.locator(".menu li", has_text="<b>here</b>")
    entry.wait_for()
    shown.go_to(5)
    entry.locator("button").first.click()
    shown.stands_at(15)
    entry.locator("button[aria-label^=Remove]").click()
    entry.wait_for(state="detached")


def test_a_run_is_named_saved_exported_dropped_and_deleted(watch: Watch, server: Server, page: Any) -> None:
    """My work lists it by its name, renames it, and gives a table and a file, which has the same numbers when dropped.

    The page asks before it deletes a run.
    """
    shown = watch(tracker="s-spf", parameters={"sample_count": 60})
    shown.go_to(25)
    session, errors = shown.id, server.column(shown.id, "error")
    shown.menu("rename")
    page.get_by_label("Name", exact=True).fill("Tuesday")
    page.keyboard.press("Enter")
    page.locator("h1", has_text="Ball behind an occluder · Tuesday").wait_for()
    shown.menu("save")
    page.locator(".toast", has_text="Saved").wait_for()

    page.goto("work?q=tuesday")
    row = page.locator("[data-run]").first
    page.locator(f"[data-session='{session}'] .row-title", has_text="Tuesday").wait_for()
    row.get_by_role("button", name="Rename Tuesday").click()
    page.get_by_role("textbox", name="Name").fill("Tuesday 2")
    page.get_by_role("button", name="Rename", exact=True).click()
    row.get_by_role("button", name="Download Tuesday 2").click()
    with page.expect_download() as table:
        row.locator("[data-export=csv]").click()
    assert table.value.suggested_filename.endswith(".csv")
    with page.expect_download() as download:
        row.locator(".menu a[download]").click()
    page.goto("./")
    page.set_input_files("#file-picker", download.value.path().rename(download.value.path().with_suffix(".pft")))
    again = SessionPage(page, server).ready()
    server.seek(again.id, 25)
    assert server.column(again.id, "error")[:26] == errors

    page.goto("work")
    row = page.locator("[data-run]").first
    row.wait_for()
    usable(page)
    count = page.locator("[data-run]").count()
    row.locator("button[aria-label^=Delete]").click()
    page.click("text=Keep")
    assert page.locator("[data-run]").count() == count
    row.locator("button[aria-label^=Delete]").click()
    page.click("text=Delete it")
    Gallery(page).until(lambda: page.locator("[data-run]").count() == count - 1, "the run is gone from the list")
