"""Words that are explained: by the pointer, by keys and by a finger, from one glossary, which is a page."""

from collections.abc import Callable
from typing import Any

from tests.browser.accessible import check, fits
from tests.browser.host import Server
from tests.browser.views import SessionPage

Watch = Callable[..., SessionPage]


def test_a_word_is_explained_by_pointer_keys_and_finger(watch: Watch, server: Server) -> None:
    """Readings, plots, parameters, measures, rows of the scrubber and the title have one way of it."""
    shown = watch(frames=30)
    page = shown.page
    server.seek(shown.id, 9)
    shown.stands_at(9)
    meaning = page.locator("#meaning")
    for place, word in (
        (".readout dt .term", "log evidence"),
        (".scrubber-rows .term", "P(lost)"),
        (".plots [data-panel=ess] .term", "ESS"),
    ):
        page.locator(place, has_text=word).first.hover()
        meaning.wait_for()
        said = meaning.inner_text()
        assert len(said) > 2 * len(word), said
        page.mouse.move(300, 300)
        meaning.wait_for(state="hidden")
    # Focus shows it, Escape puts it away and does nothing else.
    term = page.locator(".readout dt .term", has_text="sigma")
    term.focus()
    meaning.get_by_text("standard deviation of the estimate").wait_for()
    assert term.get_attribute("aria-describedby") == "meaning"
    check(page)
    page.keyboard.press("Escape")
    meaning.wait_for(state="hidden")
    # What stands in a head that unfolds, or in a label, explains and does no more.
    measures = page.locator(".measures")
    measures.locator(".leading .term").dispatch_event("click")
    meaning.get_by_text("Share of the labelled frames").wait_for()
    assert measures.locator("details[open]").count() == 0
    page.locator(".controls").get_by_text("Particles", exact=True).hover()
    shown.until(lambda: "particles" in meaning.inner_text().lower(), "a parameter is explained")


def test_the_glossary_is_a_page(page: Any) -> None:
    """What all share, and what each experiment declares; the keys of a session and the start page lead there."""
    page.goto("./")
    page.get_by_role("link", name="Glossary").click()
    page.get_by_role("region", name="Ball behind an occluder").get_by_text("gamma", exact=True).wait_for()
    assert "effective sample size" in page.get_by_role("region", name="What a tracker computes").inner_text()
    check(page)
    fits(page)
