"""Whether everybody can use a page: what axe finds, and whether it fits small and enlarged windows."""

from typing import Any

import pytest

from tests.browser.views import View

OVERFLOW = "document.documentElement.scrollWidth - innerWidth"
SIZES = ((853, 533), (800, 800), (390, 800))
"""1280 x 800 at 150 %, a small window, and a phone."""
COLOURS = ["color-contrast", "link-in-text-block"]
"""The rules about colours."""
AXE = """async (rules) => {
    const runOnly = rules ? { type: "rule", values: rules } : undefined;
    const options = { preload: false, resultTypes: ["violations"], runOnly };
    return (await axe.run({ exclude: [["iframe"]] }, options)).violations;
}"""


def usable(page: Any) -> None:
    """Axe finds nothing, and nothing is wider than the window."""
    check(page)
    fits(page)


def check(page: Any) -> None:
    """Look at a page as it is, in both colours; in viser's own page only at the frame around it.

    In the dark only rules about colours are repeated: no other rule can have another result.
    """
    script = pytest.importorskip("axe_playwright_python.sync_playwright").Axe().axe_script
    if not page.evaluate("'axe' in window"):
        page.evaluate(script)
    for scheme, rules in (("light", None), ("dark", COLOURS)):
        page.emulate_media(color_scheme=scheme)
        found = [each for each in page.evaluate(AXE, rules) if each["impact"] != "minor"]
        wrong = [(each["impact"], each["id"], [node["target"] for node in each["nodes"]]) for each in found]
        assert wrong == [], f"{scheme}: {wrong}"
    page.emulate_media(color_scheme="light")


def fits(page: Any) -> None:
    """Nothing is wider than the window at any of the sizes; at the end it has its own size again."""
    before, view = page.viewport_size, View(page)
    for width, height in SIZES:
        view.resize(width, height)
        view.until(lambda: page.evaluate(OVERFLOW) <= 0, "nothing is wider")
    view.resize(before["width"], before["height"])
