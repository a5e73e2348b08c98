"""First sight of a session's page: controls, words and picture at 1280 x 800, for each experiment.

Controls are elements to press, type into or drag; a field and its slider count as one, as for the tab key. Words are
those visible without scrolling or unfolding. The picture's place is given as a share of the window's width, and the
picture itself as a share of the height above the strips.
"""

from collections.abc import Iterator
from typing import Any

from _server import Server, chromium, new_server, row, until
from _table import Size, arguments, progress, report

BALL_CONTROLS, BALL_WORDS, CONTROLS, WORDS, REQUESTS = 24, 90, 34, 130, 60

PAINTED = "() => document.querySelector('.flat-canvas')?.dataset.frame > 0"

SIGHT = r"""() => {
    const seen = (element) => {
        const box = element.getBoundingClientRect();
        const inside = box.width > 1 && box.height > 1 && box.bottom > 0 && box.top < innerHeight && box.right > 0;
        return inside && element.checkVisibility({ visibilityProperty: true, opacityProperty: true })
            && getComputedStyle(element).clipPath === 'none';
    };
    const acts = 'button, a[href], input, select, textarea, summary, [role=slider], [tabindex="0"]';
    const controls = [...document.querySelectorAll(acts)].filter((it) => it.tabIndex >= 0 && seen(it));
    const texts = [];
    const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    while (walker.nextNode()) {
        const { parentElement: parent, data } = walker.currentNode;
        if (parent && !parent.closest('option, script, noscript') && data.trim() && seen(parent)) texts.push(data);
    }
    for (const list of document.querySelectorAll('select')) if (seen(list)) texts.push(list.selectedOptions[0].text);
    const box = (selector) => document.querySelector(selector).getBoundingClientRect();
    return {
        controls: controls.length,
        words: texts.join(' ').split(/\s+/).filter((word) => /\p{L}/u.test(word)).length,
        requests: performance.getEntriesByType('resource').length + 1,
        width: box('.scene').width / innerWidth,
        height: box('.flat-canvas').height / (box('.deck').top - box('.scene').top),
    };
}"""


def look(server: Server, browser: Any, experiment: str) -> dict[str, float]:
    """Open a playing session, and count what is visible."""
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    recipe = {"recipe": {"experiment": experiment}}
    session = str(server.ask("POST", "/api/v1/sessions", recipe)["id"])
    page.goto(f"{server.url}/session/{session}?view=flat")
    page.locator(".play").wait_for()
    page.wait_for_timeout(1_000)
    page.locator(".play").click()
    until(page, PAINTED)
    page.wait_for_timeout(2_000)
    found: dict[str, float] = page.evaluate(SIGHT)
    page.close()
    server.end(session)
    return found


def measure(server: Server, most: int) -> Iterator[dict[str, object]]:
    """Yield the rows of the table, the ball first."""
    listed = server.ask("GET", "/api/v1/experiments")
    names = sorted((str(each["id"]) for each in listed), key=lambda name: (name != "ball", name))[:most]
    with chromium() as browser:
        if browser is None:
            return
        for name in names:
            progress(name)
            found = look(server, browser, name)
            is_ball = name == "ball"
            yield row(f"{name}, controls", found["controls"], None, BALL_CONTROLS if is_ball else CONTROLS)
            yield row(f"{name}, words", found["words"], None, BALL_WORDS if is_ball else WORDS)
            yield row(f"{name}, requests", found["requests"], None, REQUESTS)
            yield row(f"{name}, place of the picture, share of the width", found["width"], None)
            yield row(f"{name}, picture, share of the height above the strips", found["height"], None)


def main() -> None:
    """Measure and report."""
    given = arguments(__doc__.splitlines()[0], experiments=Size(20, 1, "experiments to look at"))
    with new_server() as server:
        rows = list(measure(server, given.experiments))
    report("First sight", rows, as_json=given.json)


if __name__ == "__main__":
    main()
