"""Axe finds no barrier on the pages, in the light and in the dark; and terms are explained."""

from tests.browser.accessible import check, fits, usable
from tests.browser.conftest import Complaints, Watch
from tests.browser.views import Gallery

NOTHING = "0123456789abcdef"
PAGES = {"learn": ".lesson-card", "learn/bayes": ".question button[type=submit]"} | dict.fromkeys(
    ("sweep/new", "references", "lectures", f"session/{NOTHING}", "failures/of-my-own", "docs", "help/start.html"),
    "main :is(section, form, .notice, h1)",
)
"""Pages with something that they show; My work, comparisons, failures and the glossary have their own tests."""


def test_pages_that_need_nothing(gallery: Gallery, complaints: Complaints) -> None:
    """The start page with its menu on a phone, pages as they are at first, and pages of what does not exist."""
    complaints.expected = ("404",)
    gallery.card("sine").wait_for()
    usable(gallery.page)
    gallery.resize(390)
    gallery.page.get_by_role("button", name="All parts").click()
    gallery.page.get_by_role("link", name="My work").wait_for()
    check(gallery.page)
    gallery.resize(1280)
    for path, part in PAGES.items():
        gallery.page.goto(path)
        gallery.page.locator(part).first.wait_for()
        usable(gallery.page)


def test_a_session_in_the_flat_view(watch: Watch) -> None:
    """With its plots, its panel unfolded, the help, and a note of the tour; also presented."""
    shown = watch(seed=0, parameters={"sample_count": 40})
    page = shown.page
    shown.until(lambda: shown.lines, "the plots are drawn")
    assert page.locator(".plots").get_attribute("tabindex") == "0", "it scrolls sooner or later"
    page.locator(".controls").get_by_text("More", exact=True).click()
    shown.press("?")
    page.locator("dialog [data-role=tour]").wait_for()
    check(page)
    shown.press("Escape")
    page.locator("dialog").wait_for(state="detached")
    shown.press("f")
    page.get_by_role("button", name="Leave the presentation").wait_for()
    check(page)
    shown.press("f")
    page.goto(f"{page.url}?tour=few")
    page.locator(".callout").wait_for()
    check(page)
    shown.press("Escape")
    fits(page)


def test_a_term_is_explained_by_pointer_and_keys(watch: Watch) -> None:
    """So are terms of readings, plots, parameters, measures and rows of the scrubber; the glossary lists all."""
    shown = watch(frames=30)
    page = shown.page
    shown.go_to(9)
    meaning = page.locator("#meaning")
    for place, word in (
        (".readout dt .term", "log evidence"),
        (".scrubber-rows .term", "P(lost)"),
        (".plots [data-panel=ess] .term", "ESS"),
    ):
        page.locator(place, has_text=word).first.hover()
        meaning.wait_for()
        assert len(meaning.inner_text()) > 2 * len(word)
        page.mouse.move(300, 300)
        meaning.wait_for(state="hidden")
    # Focus shows it, Escape hides it and does nothing else.
    term = page.locator(".readout dt .term", has_text="sigma")
    term.focus()
    meaning.get_by_text("standard deviation of the estimate").wait_for()
    assert term.get_attribute("aria-describedby") == "meaning"
    check(page)
    page.keyboard.press("Escape")
    meaning.wait_for(state="hidden")
    # A term in a fold's head or in a label is only explained.
    measures = page.locator(".measures")
    measures.locator(".leading .term").dispatch_event("click")
    meaning.get_by_text("Share of the labelled frames").wait_for()
    assert measures.locator("details[open]").count() == 0
    page.locator(".controls").get_by_text("Particles", exact=True).hover()
    shown.until(lambda: "particles" in meaning.inner_text().lower(), "a parameter is explained")
    page.goto("./")
    page.get_by_role("link", name="Glossary").click()
    page.get_by_role("region", name="Ball behind an occluder").get_by_text("gamma", exact=True).wait_for()
    assert "effective sample size" in page.get_by_role("region", name="What a tracker computes").inner_text()
    usable(page)
