"""Fitting in the page: noises are found, shown before and after, and opened as a branch; a fit can be cancelled."""

from collections.abc import Callable

from tests.browser.views import SessionPage

OPEN = "dialog[open] .fit"


def test_noises_are_fitted_to_what_was_seen(watch: Callable[..., SessionPage]) -> None:
    """What is found is told with both halves, and opens as a branch at the frame that was shown."""
    shown = watch(experiment="sine", tracker="kalman", parameters={"assumed_noise_sd": 0.4}, frames=121)
    page = shown.page
    page.locator(".controls").get_by_text("More", exact=True).click()
    begin = page.get_by_role("button", name="Fit noise to data")
    begin.click()
    page.get_by_role("button", name="Fit", exact=True).click()
    assert "at least 41 frames" in page.get_by_role("alert").inner_text()
    page.get_by_role("button", name="Cancel").click()

    shown.play_to_the_end()
    begin.click()
    dialog = page.locator(OPEN)
    dialog.get_by_role("checkbox").first.wait_for()
    assert dialog.get_by_role("checkbox", checked=True).count() == 2
    dialog.get_by_label("Process noise").uncheck()
    page.get_by_role("button", name="Fit", exact=True).click()
    dialog.locator(".fit-verdict").wait_for()
    assert dialog.locator(".fit-verdict").inner_text().startswith("Kept")
    rows = dialog.locator("tbody tr").all_inner_texts()
    assert [len(row.split("\t")) for row in rows] == [3, 1, 3, 3, 3, 3, 3, 1, 3, 3, 3, 3, 3]
    assert rows[0].startswith("Assumed observation noise\t0.4\t0.1") or rows[0].startswith(
        "Assumed observation noise\t0.4\t0.0"
    )
    before, after = (float(it) for it in rows[-1].split("\t")[1:])
    assert rows[-1].startswith("NIS (0.67 to 1.39 is right)")
    assert before < 0.2
    assert 0.67 < after < 1.39
    page.get_by_role("button", name="Open as a branch").click()
    shown.until(lambda: shown.session["branch"] == "b1" and shown.position == 120, "the branch is there, as far")
    assert 0.08 < shown.session["parameters"]["assumed_noise_sd"] < 0.12
