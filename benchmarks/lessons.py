"""Slider to figure: from the move of a lesson's slider to the painted figure, in a browser.

In Debian's Chromium, headless with software rendering, at 1280 x 800, every demonstration of the course at its
defaults. Measured is the time from the event until the figure from the server is painted: the request, the worker, the
answer's JSON and the drawing on canvases. Each move waits for the figure of the one before.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

from collections.abc import Iterator  # noqa: E402
from statistics import median  # noqa: E402
from typing import Any  # noqa: E402

from _server import Server, chromium, new_server, percentile, row, until  # noqa: E402

GOAL_MS = 50.0

# Moves a slider to and fro, each time after the figure of the last move is painted, and returns the times.
MOVE = """async (repeats) => {
    const slider = [...document.querySelectorAll('.lesson-control input[type=range]')][0];
    const show = document.querySelector('[data-part=show]');
    const painted = (from) => new Promise((resolve) => {
        const look = () => (show.dataset.shown === from ? setTimeout(look, 0) : resolve());
        look();
    });
    const [low, high] = [Number(slider.min), Number(slider.max)];
    const step = Number(slider.step) || (high - low) / 100;
    const first = Number(slider.value);
    const taken = [];
    for (let number = 0; number < repeats; number += 1) {
        await new Promise((resolve) => setTimeout(resolve, 30));
        const away = first + step * (1 + (number % 5));
        const next = number % 2 ? first : away > high ? Math.max(low, first - step * (1 + (number % 5))) : away;
        const from = show.dataset.shown;
        const began = performance.now();
        slider.value = String(next);
        slider.dispatchEvent(new Event('input', { bubbles: true }));
        await painted(from);
        taken.push(performance.now() - began);
    }
    return taken;
}"""


def lessons_of(server: Server) -> list[str]:
    """Return the demonstrations of the course."""
    listed = server.ask("GET", "/api/v1/lessons")["lessons"]
    return [each["id"] for each in listed if each["number"] and each["kind"] == "demonstration"]


def time_moves(page: Any, server: Server, lesson: str, repeats: int) -> list[float]:
    """Return the time of each move of a lesson's first slider, ms."""
    page.goto(f"{server.url}/learn/{lesson}")
    until(page, "document.querySelector('[data-part=show]')?.dataset.shown !== undefined")
    page.click(".question button.quiet")
    until(page, "document.querySelector('[data-part=question]')?.dataset.stage === 'skipped'")
    page.wait_for_timeout(300)
    page.evaluate(MOVE, 6)  # during the first moves the browser compiles the page's scripts
    taken: list[float] = page.evaluate(MOVE, repeats)
    return taken


def measure(server: Server, repeats: int, lessons: int) -> Iterator[dict[str, object]]:
    """Yield a row for each lesson, and one for all of them."""
    everything: list[float] = []
    with chromium() as browser:
        if browser is None:
            return
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        for lesson in lessons_of(server)[:lessons]:
            progress(lesson)
            taken = time_moves(page, server, lesson, repeats)
            everything += taken
            yield row(f"{lesson}, ms", median(taken), percentile(taken, 0.95), GOAL_MS)
    yield row("all, ms", median(everything), percentile(everything, 0.95), GOAL_MS)


def main() -> None:
    """Measure and report."""
    given = arguments(
        __doc__.splitlines()[0],
        repeats=Size(60, 2, "moves of each slider"),
        lessons=Size(100, 1, "most lessons"),
    )
    with new_server() as server:
        rows = list(measure(server, given.repeats, given.lessons))
    report("Slider to figure", rows, as_json=given.json)


if __name__ == "__main__":
    main()
